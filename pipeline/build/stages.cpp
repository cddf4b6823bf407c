#include "pipeline/build/stages.h"

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "gpu/device/device_choice.h"
#include "gpu/exact/simplify_block.h"
#include "pipeline/build/block_order.h"
#include "pipeline/build/in_flight.h"
#include "pipeline/build/water_build.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/plan.h"
#include "proto/cores.h"

namespace cordillera::pipeline {
namespace {

/// What of a stage is done, told by tasks side by side. A task's share never falls.
class Done {
 public:
  Done(Teller& teller, double before) : teller_(teller), sum_(before) {}
  /// For a task of so much: tells what its share has grown by.
  std::function<void(double)> of(double all) {
    return [this, all, told = std::make_shared<double>(0)](double share) {
      const std::lock_guard lock(mutex_);
      if (share <= *told) return;
      sum_ += all * (share - *told);
      *told = share;
      teller_.tell(sum_);
    };
  }

 private:
  Teller& teller_;
  std::mutex mutex_;
  double sum_;
};

/// Those that a build before this one has not committed.
std::vector<proto::TileAddress> unfinished(const Site& site, std::vector<proto::TileAddress> nodes) {
  std::erase_if(nodes, [&](const proto::TileAddress& node) { return site.store.finished(node); });
  return nodes;
}

proto::Result<void> commit(const Site& site, FinishedTask& task) {
  if (site.consumed == Consumed::kept) task.consumed.clear();
  return site.store.commit(task);
}

const proto::Problem kPaused{"paused", "blocks are made when somebody looks at them", "", ""};
const proto::Problem kTurnIsOver{"paused", "other builds have their turn", "", "turn"};

// So many of a thread, and a GPU is open before the threads are done with them.
constexpr double kSamplesOfThread = 400'000;

// A lazy build's process ends when nobody has looked at another block for so long, and after its turn. Who looks later waits for
// another process and for its device, several times as long as for a block: it ends early only where other builds wait.
constexpr auto kLinger = std::chrono::seconds(15), kLingerBeforeOthers = std::chrono::seconds(2);
constexpr auto kTurn = std::chrono::seconds(60), kTurnBeforeOthers = std::chrono::seconds(20);
constexpr auto kBetweenLooks = std::chrono::milliseconds(5);

using MakeBlock = std::function<proto::Result<FinishedTask>(const proto::TileAddress&)>;
using TakeBlock = std::function<proto::Result<void>(FinishedTask&&)>;

/// Those of the blocks that somebody looks at. In the end all of them; or kPaused, kTurnIsOver.
proto::Result<void> build_looked_at(const Site& site, const std::vector<proto::TileAddress>& blocks, BlockOrder& order,
                                    const MakeBlock& make, const TakeBlock& take) {
  using Clock = std::chrono::steady_clock;
  BlockFollower& follower = *site.follower;
  const auto has_tiles = [&](const proto::TileAddress& block) { return follower.has_tiles(block); };
  auto left = std::count_if(blocks.begin(), blocks.end(), has_tiles);
  const auto began = Clock::now();
  std::optional<Clock::time_point> made;
  RunningTasks running([&](std::size_t k) { return make(blocks[k]); });
  for (;;) {
    if (site.stop) return kCancelled;
    const bool others_wait = follower.others_wait();
    const bool is_over = made && Clock::now() - began > (others_wait ? kTurnBeforeOthers : kTurn);
    if (is_over && running.count() == 0) return kTurnIsOver;
    // Looks come one after the other, as a map draws: who looks later does not wait for what was begun before.
    const std::size_t at_once = std::max(site.shop.builder.tasks_at_once(), running.count());
    std::vector<std::size_t> wanted = order.looked_at(is_over ? 0 : at_once - running.count());
    if (wanted.empty() && running.count() == 0) {
      // What is shown of a store that was lost is nobody's wish any more, and is missing all the same.
      wanted = order.those([&](const proto::TileAddress& block) { return follower.shows(block); }, at_once);
      // Those of which nothing can be seen are no reason to wait.
      if (wanted.empty() && left == 0) wanted = order.those([](const proto::TileAddress&) { return true; }, at_once);
      if (wanted.empty() && left == 0) return {};
      const auto linger = !others_wait ? kLinger : made ? kLingerBeforeOthers : std::chrono::seconds(0);
      if (wanted.empty() && Clock::now() - made.value_or(began) > linger) return kPaused;
      if (wanted.empty()) {
        std::this_thread::sleep_for(kBetweenLooks);
        continue;
      }
    }
    for (const std::size_t k : wanted) running.begin(k);
    auto ended = running.ended(kBetweenLooks);
    if (!ended) continue;
    auto& [k, task] = *ended;
    if (!task.ok()) return task.problem();
    if (auto taken = take(std::move(task).value()); !taken.ok()) return taken;
    if (has_tiles(blocks[k])) --left;
    made = Clock::now();
  }
}

/// What a process before this one has made, and not shown any more.
void show_made(const Site& site, const std::vector<proto::TileAddress>& blocks) {
  for (const proto::TileAddress& node : blocks) {
    if (site.store.finished(node) && !site.follower->shows(node)) site.follower->take(site.store.block(node));
  }
}

/// A build's blocks as its follower sees them: begun and, on every way out, ended. follower: may be null.
class Followed {
 public:
  Followed(BlockFollower* follower, const proto::Plan& plan, Teller& teller) : follower_(follower) {
    if (follower_) follower_->begin(plan, [&teller] { teller.provisional(); });
  }
  ~Followed() {
    if (follower_) follower_->end();
  }
  Followed(const Followed&) = delete;
  Followed& operator=(const Followed&) = delete;

 private:
  BlockFollower* const follower_;
};

proto::Result<void> build_blocks(const Site& site, const std::vector<proto::TileAddress>& all) {
  std::vector<proto::TileAddress> blocks = unfinished(site, all);
  // The largest first: a large one at the end would leave most threads without work.
  std::stable_sort(blocks.begin(), blocks.end(),
                   [&](const auto& a, const auto& b) { return samples_of(site.plan, a) > samples_of(site.plan, b); });
  double total = 0, left = 0;
  for (const proto::TileAddress& node : all) total += samples_of(site.plan, node);
  for (const proto::TileAddress& node : blocks) left += samples_of(site.plan, node);
  const Followed followed(site.follower, site.plan, site.teller);  // first: whoever is told of blocks can see them
  site.teller.stage("build", total, total - left);
  Done done(site.teller, total - left);
  const auto make = [&](const proto::TileAddress& node) -> proto::Result<FinishedTask> {
    if (site.stop) return kCancelled;
    const auto tell = done.of(samples_of(site.plan, node));
    FinestSink finest;
    if (BlockFollower* const follower = site.follower) {
      finest.waits = [=] { return follower->lazy() || follower->waits_for_finest(node); };
      finest.take = [=](const std::vector<EncodedTile>& tiles) { follower->take_finest(node, tiles); };
    }
    auto task = site.shop.builder.block(node, tell, finest);
    if (!task.ok()) return task;
    site.store.keep(*task);  // it takes longer than the rest of a commit, which is for one thread
    tell(1);
    return task;
  };
  const auto take = [&](FinishedTask&& task) {
    auto committed = commit(site, task);
    if (committed.ok()) site.teller.committed_block();
    task.mesh.reset();  // a follower shows tiles
    if (committed.ok() && site.follower) site.follower->take(std::move(task));
    return committed;
  };
  const bool lazy = site.follower && site.follower->lazy();
  if (lazy)
    show_made(site, all);
  else if (has_levels_above(site.plan) && !blocks.empty())
    site.shop.builder.gather_for_merge();
  BlockOrder order(blocks, site.follower);
  auto built = lazy ? build_looked_at(site, blocks, order, make, take)
                    : in_flight_as_they_end(
                          blocks.size(), [&] { return site.shop.builder.tasks_at_once() + site.shop.builder.tasks_ahead(); },
                          [&](std::size_t) { return make(blocks[order.next()]); }, take);
  if (built.ok()) site.teller.tell(total);  // parts add up to it but for rounding
  return built;
}

/// The task above the blocks, if there is one that is not done.
proto::Result<void> merge_upwards(const Site& site, const Stages& stages) {
  if (stages.size() == 1 || unfinished(site, stages.back()).empty()) return {};
  site.teller.stage("merge", 1);
  Done done(site.teller, 0);
  const auto tell = done.of(1);
  if (site.stop) return kCancelled;
  auto task = site.shop.builder.merge([&](const proto::TileAddress& block) { return site.store.mesh(block); }, tell);
  if (!task.ok()) return task.problem();
  tell(1);
  return commit(site, *task);
}

}  // namespace

std::string device_of(const proto::Plan& plan, const std::string& asked, unsigned threads) {
  const double samples = static_cast<double>(columns_of(plan)) * static_cast<double>(rows_of(plan));
  const bool is_soon_done = strategy_of(plan) == gpu::kExact && samples < kSamplesOfThread * threads;
  return gpu::is_any_device(asked) && is_soon_done ? "cpu" : asked;
}

std::future<void> wake_device(const proto::BuildOptions& options, const proto::Source& source) {
  const std::string& asked = options.device();
  const bool is_any = gpu::is_any_device(asked);
  if (asked == "cpu" || (is_any && !gpu::has_cuda_driver())) return {};
  // A build of the whole raster has a sample for each pixel, or more.
  const bool is_whole = options.bbox_size() == 0 && !options.has_max_level();
  const unsigned threads = proto::threads_for(options.threads());
  const bool is_large = 1.0 * source.columns() * source.rows() >= kSamplesOfThread * threads;
  if (is_any && !(is_whole && is_large)) return {};
  return std::async(std::launch::async | std::launch::deferred,
                    [asked] { static_cast<void>(gpu::exact::make_block_simplifier(asked, gpu::ParallelFor())); });
}

Workshop::Workshop(const BuildRequest& request, const proto::Plan& plan, const std::atomic<bool>& stop)
    : workers(request.options.threads()),
      open([&request] { return open_source(request); }),
      builder(plan, workers, open,
              {device_of(plan, request.options.device(), workers.threads()), request.options.memory(), request.quarter_side},
              stop) {}

Stages stages_of(const proto::Plan& plan) {
  Stages stages{touched_tiles(plan, static_cast<int>(plan.block_level()))};
  if (has_levels_above(plan)) stages.push_back({node_above(plan)});
  return stages;
}

proto::Result<void> make_stages(const Site& site, const Stages& stages) {
  if (const auto built = build_blocks(site, stages.front()); !built.ok()) return built;
  if (const auto merged = merge_upwards(site, stages); !merged.ok()) return merged;
  site.teller.stage("publish", 1);
  return build_water_above(site.plan, site.store, site.stop);
}

}  // namespace cordillera::pipeline
