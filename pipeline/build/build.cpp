#include "pipeline/build/build.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <thread>
#include <utility>

#include "gpu/simplify.h"
#include "pipeline/build/blank_manifest.h"
#include "pipeline/build/block_order.h"
#include "pipeline/build/builder.h"
#include "pipeline/build/in_flight.h"
#include "pipeline/build/pilot.h"
#include "pipeline/build/provisional.h"
#include "pipeline/build/teller.h"
#include "pipeline/build/water_build.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/store/store.h"
#include "proto/mesh.h"
#include "proto/version.h"
#include "raster/pixels/decimation.h"
#include "raster/pixels/short_number.h"
#include "raster/sample/back_projection.h"
#include "raster/storage/storage.h"
#include "raster/voids/filled_source.h"

namespace cordillera::pipeline {
namespace {

/// What of a stage is done, told by tasks side by side. A task's share never falls.
class Done {
 public:
  explicit Done(Teller& teller) : teller_(teller) {}
  void add(double part) {
    const std::lock_guard lock(mutex_);
    teller_.tell(sum_ += part);
  }
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
  double sum_ = 0;
};

struct Site {
  Builder& builder;
  const proto::Plan& plan;
  StoreWriter& store;
  Teller& teller;
  const std::atomic<bool>& stop;
  unsigned threads;
  BlockFollower* follower;
};

/// Those that a build before this one has not committed.
std::vector<proto::TileAddress> unfinished(const Site& site, std::vector<proto::TileAddress> nodes) {
  std::erase_if(nodes, [&](const proto::TileAddress& node) { return site.store.finished(node); });
  return nodes;
}

const proto::Problem kPaused{"paused", "blocks are made when somebody looks at them", "", ""};
const proto::Problem kTurnIsOver{"paused", "other builds have their turn", "", "turn"};

// A lazy build's process ends when nobody has looked at another block for so long, and after its turn. Who looks later waits for
// another process and for its device, several times as long as for a block: it ends early only where other builds wait.
constexpr auto kLinger = std::chrono::seconds(15), kLingerBeforeOthers = std::chrono::seconds(2);
constexpr auto kTurn = std::chrono::seconds(60), kTurnBeforeOthers = std::chrono::seconds(20);
constexpr auto kBetweenLooks = std::chrono::milliseconds(5);

using MakeBlock = std::function<proto::Result<FinishedTask>(const proto::TileAddress&)>;
using TakeBlock = std::function<proto::Result<void>(std::size_t, FinishedTask&&)>;

/// Those of the blocks that somebody looks at. In the end all of them; or kPaused, kTurnIsOver.
proto::Result<void> build_looked_at(const Site& site, const std::vector<proto::TileAddress>& blocks, BlockOrder& order,
                                    const MakeBlock& make, const TakeBlock& take) {
  using Clock = std::chrono::steady_clock;
  BlockFollower& follower = *site.follower;
  const auto has_tiles = [&](const proto::TileAddress& block) { return follower.has_tiles(block); };
  auto left = std::count_if(blocks.begin(), blocks.end(), has_tiles);
  const std::size_t at_once = site.builder.tasks_at_once();
  const auto began = Clock::now();
  std::optional<Clock::time_point> made;
  RunningTasks running([&](std::size_t k) { return make(blocks[k]); });
  for (;;) {
    if (site.stop) return kCancelled;
    const bool others_wait = follower.others_wait();
    const bool is_over = made && Clock::now() - began > (others_wait ? kTurnBeforeOthers : kTurn);
    if (is_over && running.count() == 0) return kTurnIsOver;
    // Looks come one after the other, as a map draws: who looks later does not wait for what was begun before.
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
    if (auto taken = take(k, std::move(task).value()); !taken.ok()) return taken;
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

proto::Result<void> build_blocks(const Site& site) {
  const auto level = static_cast<int>(site.plan.block_level());
  const std::vector<proto::TileAddress> all = touched_tiles(site.plan, level);
  std::vector<proto::TileAddress> blocks = unfinished(site, all);
  // The largest first: a large one at the end would leave most threads without work.
  std::stable_sort(blocks.begin(), blocks.end(),
                   [&](const auto& a, const auto& b) { return samples_of(site.plan, a) > samples_of(site.plan, b); });
  double total = 0, left = 0;
  for (const proto::TileAddress& node : all) total += samples_of(site.plan, node);
  for (const proto::TileAddress& node : blocks) left += samples_of(site.plan, node);
  site.teller.stage("build", total);
  Done done(site.teller);
  done.add(total - left);
  const auto make = [&](const proto::TileAddress& node) -> proto::Result<FinishedTask> {
    if (site.stop) return kCancelled;
    const auto tell = done.of(samples_of(site.plan, node));
    FinestSink finest;
    if (BlockFollower* const follower = site.follower) {
      finest.waits = [=] { return follower->waits_for_finest(node); };
      finest.take = [=](const std::vector<EncodedTile>& tiles) { follower->take_finest(node, tiles); };
    }
    auto task = site.builder.block(node, tell, finest);
    if (task.ok()) tell(1);
    return task;
  };
  const auto take = [&](std::size_t, FinishedTask&& task) {
    auto committed = site.store.commit(task);
    if (committed.ok()) site.teller.committed_block();
    task.mesh.reset();  // a follower shows tiles
    if (committed.ok() && site.follower) site.follower->take(std::move(task));
    return committed;
  };
  const Followed followed(site.follower, site.plan, site.teller);
  const bool lazy = site.follower && site.follower->lazy();
  if (lazy) show_made(site, all);
  BlockOrder order(blocks, site.follower);
  auto built =
      lazy ? build_looked_at(site, blocks, order, make, take)
           : in_flight(
                 blocks.size(), site.builder.tasks_at_once(), [&](std::size_t) { return make(blocks[order.next()]); }, take);
  if (built.ok()) site.teller.tell(total);  // parts add up to it but for rounding
  return built;
}

proto::Result<void> merge_upwards(const Site& site) {
  const std::vector<std::vector<proto::TileAddress>> stages = stages_above(site.plan);
  double total = 0;
  for (const auto& stage : stages) total += static_cast<double>(stage.size());
  if (total == 0) return {};
  site.teller.stage("merge", total);
  Done done(site.teller);
  for (const auto& stage : stages) {
    const std::vector<proto::TileAddress> nodes = unfinished(site, stage);
    done.add(static_cast<double>(stage.size() - nodes.size()));
    const auto make = [&](std::size_t k) -> proto::Result<FinishedTask> {
      if (site.stop) return kCancelled;
      return site.builder.merge(nodes[k], [&](const proto::TileAddress& child) { return site.store.mesh(child); });
    };
    // A merge is one tile: as many side by side as there are threads.
    const auto merged = in_flight(nodes.size(), site.threads, make, [&](std::size_t, FinishedTask&& task) {
      done.add(1);
      return site.store.commit(task);
    });
    if (!merged.ok()) return merged.problem();
  }
  return {};
}

/// What a raster without a triangle holds all the same.
struct HeightsSeen {
  bool within = false;                           ///< a height within the limit
  std::optional<std::pair<double, double>> far;  ///< the least and the greatest of those beyond it, in metres
  int own_level = -1;                            ///< the first level as fine as the raster; negative: unknown
};

/// At places spread over one raster, until a height within the limit is found. A reader takes what is out of range for a void. So
/// the raster is read once more at a scale where every height is within it.
HeightsSeen heights_seen(const BuildRequest& request) {
  constexpr double kScale = 1e-26;  // 1e30 is the greatest value that is no void
  constexpr int kAcross = 64;
  HeightsSeen seen;
  if (!request.members.empty()) return seen;
  proto::BuildOptions options = request.options;
  options.set_z_scale((options.has_z_scale() ? options.z_scale() : 1) * kScale);
  options.clear_z_offset();
  options.clear_max_level();
  const auto source = raster::open_source(request.raster_path, request.raster_name, request.trust, options);
  if (!source.ok() || (*source)->description().bbox_size() != 4) return seen;
  if (const auto levels = level_range((*source)->description(), options); levels.ok()) seen.own_level = levels->first;
  const auto& bbox = (*source)->description().bbox();
  const double width_deg = bbox[2] - bbox[0] + (bbox[0] > bbox[2] ? 360 : 0);  // over the antimeridian
  for (int row = 0; row < kAcross; ++row) {  // a row at a time: what is read at once stays small
    std::array<double, kAcross> longitude_deg{}, latitude_deg{}, height{};
    latitude_deg.fill(bbox[1] + (bbox[3] - bbox[1]) * (row + 0.5) / kAcross);
    for (std::size_t k = 0; k < kAcross; ++k)
      longitude_deg[k] = std::remainder(bbox[0] + width_deg * (static_cast<double>(k) + 0.5) / kAcross, 360);
    if (!(*source)->nearest(longitude_deg, latitude_deg, height.data()).ok()) return {};
    for (const double scaled : height) {
      if (std::isnan(scaled)) continue;
      const double height_m = scaled / kScale + request.options.z_offset();
      seen.within = std::abs(height_m) <= proto::kMaxHeight_m;
      if (seen.within) return seen;
      if (!seen.far) seen.far.emplace(height_m, height_m);
      seen.far->first = std::min(seen.far->first, height_m);
      seen.far->second = std::max(seen.far->second, height_m);
    }
  }
  return seen;
}

/// Data between the samples of a level whose cells are as wide as they, or wider.
proto::Problem between_samples(const BuildRequest& request, int own_level) {
  const std::string level = std::to_string(request.options.max_level());
  return {
      "option-invalid",
      "the cells of level " + level + " are so wide that no three neighbouring samples lie on the data of " + request.raster_name,
      "a finer max_level; the first that is as fine as the raster is " + std::to_string(own_level), "max_level"};
}

}  // namespace

proto::Result<std::unique_ptr<raster::Source>> open_source(const BuildRequest& request) {
  const std::uint32_t limit_cells = raster::fill_limit_cells(request.options);
  if (!request.members.empty())
    return raster::fill_enclosed_voids(raster::make_mosaic(request.members, request.options.feather()), limit_cells);
  if (!request.decimation)
    return raster::open_filled_source(request.raster_path, request.raster_name, request.trust, request.options);
  auto source =
      raster::open_decimated(request.raster_path, request.raster_name, request.trust, request.options, request.decimation);
  return source.ok() ? raster::fill_enclosed_voids(std::move(*source), limit_cells) : std::move(source);
}

std::unique_ptr<raster::Source> source_of_tiles(const proto::Plan& plan, std::unique_ptr<raster::Source> source) {
  const double within_m = pixels_within_m(plan);
  return within_m > 0 ? raster::project_back(std::move(source), static_cast<int>(plan.finest_level()), within_m)
                      : std::move(source);
}

proto::Result<proto::Plan> plan_of(const BuildRequest& request, raster::Source& source) {
  if (const auto checked = check_water(request.options); !checked.ok()) return checked.problem();
  auto plan = make_plan(source, request.options);
  if (!plan.ok()) return plan;
  if (request.block_samples > 0) use_smaller_blocks(*plan, request.block_samples);
  plan->set_program(proto::kProgram);
  plan->set_source_state(state_of(request));
  return plan;
}

std::string state_of(const BuildRequest& request) {
  std::string state = request.members.empty() ? raster::state_of(request.raster_path) : "";
  for (const raster::MosaicMember& member : request.members)
    state += member.path + "\n" + member.state + "\n" + member.options.SerializeAsString();
  if (!request.members.empty()) state = hex(content_hash(state));
  const std::string& mask = request.options.water_mask();
  return mask.empty() ? state : state + "; water mask " + raster::state_of(mask);
}

proto::Problem without_data(const BuildRequest& request) {
  const bool boxed = request.options.bbox_size() > 0;
  const std::string where = boxed ? " inside the bbox" : "";
  const HeightsSeen seen = heights_seen(request);
  if (seen.within && request.options.has_max_level() && static_cast<int>(request.options.max_level()) < seen.own_level)
    return between_samples(request, seen.own_level);
  if (const auto& far = seen.far; far && !seen.within)
    return {
        "raster-heights-out-of-range",
        request.raster_name + " has no heights within 16384 m of zero" + where + ": they are " +
            raster::short_number(far->first) + " to " + raster::short_number(far->second) +
            " m at the places that were looked at",
        "heights in metres, z_scale= for another unit (z_scale=0.001 for millimetres), or nodata= for a value that means no data",
        "z_scale"};
  return {"raster-all-nodata",
          request.raster_name + " has no data" + where +
              ": nowhere do three neighbouring samples have heights within 16384 m of zero",
          "a raster with some data, z_scale= for heights in another unit than metres, or voids= with a height to put where there "
          "are none",
          boxed ? "bbox" : ""};
}

proto::Result<proto::Manifest> build(const BuildRequest& request, const ProgressCallback& progress,
                                     const std::atomic<bool>& stop) {
  Teller teller(progress);
  teller.stage("open", 1);
  const std::future<void> waking = gpu::wake_device(request.options.device());  // while the raster is opened
  const auto source = open_source(request);
  if (!source.ok()) return source.problem();
  auto plan = plan_of(request, **source);
  if (!plan.ok()) return plan.problem();
  Workers workers(request.options.threads());
  Builder builder(
      *plan, workers, [&] { return open_source(request); }, {request.options.device(), request.options.memory()}, stop);
  if (const auto ready = builder.prepare(); !ready.ok()) return ready.problem();
  if (request.options.keep_size() > 0) {
    teller.stage("plan", 1);
    if (const auto piloted = run_pilot(builder, *plan, stop); !piloted.ok()) return piloted.problem();
    builder.use(*plan);
  }
  auto store = StoreWriter::open(request.store_path, *plan, request.other);
  if (!store.ok()) return store.problem();
  const Site site{builder, *plan, **store, teller, stop, workers.threads(), request.follower};
  if (const auto built = build_blocks(site); !built.ok()) return built.problem();
  if (const auto merged = merge_upwards(site); !merged.ok()) return merged.problem();
  teller.stage("publish", 1);
  if (const auto masked = build_water(
          *plan, workers, [&] { return open_source(request); }, **store, stop);
      !masked.ok())
    return masked.problem();
  const proto::Source& described = request.decimation ? request.decimation->of : (*source)->description();
  proto::Manifest manifest = blank_manifest(request, *plan, described, {workers.threads(), builder.device()});
  manifest.set_provisional(is_provisional(request));
  if (!is_provisional(request)) note_values(**source, manifest);
  manifest.set_device(builder.device());  // in the manifest alone: tiles are the same bytes wherever they were made
  auto published = (*store)->publish(std::move(manifest));
  if (!published.ok() && published.problem().type == "no-data") return without_data(request);
  teller.tell(1);
  return published;
}

}  // namespace cordillera::pipeline
