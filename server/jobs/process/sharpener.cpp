#include "server/jobs/process/sharpener.h"

#include <time.h>

#include <algorithm>
#include <cstdio>
#include <exception>

#include "pipeline/build/sharpen.h"
#include "pipeline/store/mesh_files.h"
#include "server/data/layout.h"
#include "server/jobs/looked_at.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

// Between two steps: clients load all that they see again.
constexpr auto kLeastPause = std::chrono::milliseconds(1500);
constexpr int kShareOfBuild = 4;  // of the time so far, or more, unless somebody looks at a block that is done
constexpr int kTimesStep = 10;    // of the processor time that the last one took
constexpr auto kLeastLazyPause = std::chrono::milliseconds(500);
constexpr std::uintmax_t kTimesStore = 3;  // room for the next step, and as much again for the build

/// Of this thread: beside a build on all threads a step takes longer than it costs.
std::chrono::nanoseconds processor_time() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return std::chrono::seconds(now.tv_sec) + std::chrono::nanoseconds(now.tv_nsec);
}

std::set<proto::TileAddress> tiles_of_block_level(const std::string& store, int z) {
  std::set<proto::TileAddress> tiles;
  const auto reader = pipeline::StoreReader::open(store);
  if (!reader.ok()) return tiles;
  for (const proto::TileRecord& record : (*reader)->records_of(z)) tiles.insert(pipeline::address_of(record));
  return tiles;
}

bool is_under(const proto::TileAddress& tile, const proto::TileAddress& node) {
  return tile.z >= node.z && tile.at_level(node.z) == node;
}

/// What a process before this one left.
void remove_finest_stores(const fs::path& folder) {
  std::error_code error;
  for (const auto& entry : fs::directory_iterator(folder, error)) {
    if (is_finest_store(entry.path().filename().string())) fs::remove_all(entry.path(), error);
  }
}

}  // namespace

void Sharpener::begin(const proto::Plan& plan, std::function<void()> shown) {
  if (!thread_.joinable()) remove_finest_stores(folder_);
  const auto stands = pipeline::StoreReader::manifest_of((folder_ / kProvisionalStore).string());
  if (thread_.joinable() || !stands.ok() || !pipeline::can_show_blocks(plan, *stands)) return;
  plan_ = plan;
  can_show_ = true;
  shown_ = std::move(shown);
  shown_blocks_ = pipeline::blocks_in(*stands);
  started_ = step_began_ = Clock::now();
  // A step without blocks: from now on the service knows whose tiles wait for one.
  if (blocks_ == Blocks::looked_at && !stands->has_done_blocks()) {
    if (!make_step({})) return;
    shown_();
  }
  if (blocks_ == Blocks::looked_at)
    with_tiles_ = tiles_of_block_level((folder_ / kProvisionalStore).string(), static_cast<int>(plan.block_level()));
  thread_ = std::thread([this] { run(); });
}

std::vector<proto::TileAddress> Sharpener::looked_at() { return read_looked_at(folder_); }

bool Sharpener::others_wait() {
  std::error_code error;
  return fs::exists(folder_ / kOthersWaitFile, error);
}

bool Sharpener::shows(const proto::TileAddress& block) {
  const std::lock_guard lock(mutex_);
  return shown_blocks_.contains(block);
}

bool Sharpener::waits_for_finest(const proto::TileAddress& block) {
  if (!can_show_) return false;
  const auto looked = looked_at();
  return std::any_of(looked.begin(), looked.end(), [&](const proto::TileAddress& tile) {
    return tile.z == static_cast<int>(plan_.finest_level()) && is_under(tile, block);
  });
}

void Sharpener::take_finest(const proto::TileAddress& block, const std::vector<pipeline::EncodedTile>& tiles) {
  if (tiles.empty() || !waits_for_finest(block)) return;
  const fs::path file = folder_ / finest_store(block), next = file.string() + kBeingWritten;
  std::string why;
  try {
    pipeline::remove_store(next.string());
    const auto put = pipeline::put_finest((folder_ / kProvisionalStore).string(), plan_, {block, tiles, {}, {}}, next.string());
    if (put.ok()) fs::rename(next, file);
    if (put.ok()) return shown_();
    why = put.problem().line();
  } catch (const std::exception& error) {  // want of memory, a disk that fails
    why = error.what();
  }
  std::fprintf(stderr, "tiles are not shown before their block is done: %s\n", why.c_str());
  pipeline::remove_store(next.string());
}

void Sharpener::forget_finest(const std::set<proto::TileAddress>& blocks) const {
  for (const proto::TileAddress& block : blocks) pipeline::remove_store((folder_ / finest_store(block)).string());
}

void Sharpener::take(pipeline::FinishedTask&& block) {
  if (!thread_.joinable()) return;
  block.mesh.reset();
  block.consumed.clear();
  const std::lock_guard lock(mutex_);
  if (ending_) return;
  waiting_.push_back(std::move(block));
  changed_.notify_all();
}

void Sharpener::end() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

/// Whether somebody looks at one of the blocks that a step would show.
bool Sharpener::somebody_waits() {
  const auto looked = looked_at();
  return std::any_of(waiting_.begin(), waiting_.end(), [&](const pipeline::FinishedTask& block) {
    return std::any_of(looked.begin(), looked.end(), [&](const proto::TileAddress& tile) { return is_under(tile, block.node); });
  });
}

Sharpener::Clock::time_point Sharpener::due_at() const {
  const bool lazy = blocks_ == Blocks::looked_at;
  if (lazy && somebody_waits_) return step_began_ + std::max<Clock::duration>(kLeastLazyPause, step_took_);
  const Clock::duration usual = lazy || somebody_waits_ ? Clock::duration() : (Clock::now() - started_) / kShareOfBuild;
  return step_began_ + std::max({Clock::duration(kLeastPause), usual, step_took_ * kTimesStep});
}

void Sharpener::run() {
  std::set<proto::TileAddress> before;  // shown by the last step: who had opened the one before it has found them meanwhile
  std::unique_lock lock(mutex_);
  for (;;) {
    somebody_waits_ = somebody_waits_ || somebody_waits();
    // A lazy build's last blocks may be its last ones for long.
    const bool due = !waiting_.empty() && (Clock::now() >= due_at() || (ending_ && blocks_ == Blocks::looked_at));
    if (!due && ending_) return;
    if (!due && waiting_.empty())
      changed_.wait(lock);
    else if (!due)
      changed_.wait_until(lock, std::min(due_at(), Clock::now() + kLeastLazyPause));  // somebody may look meanwhile
    if (!due) continue;
    const std::vector<pipeline::FinishedTask> blocks = std::move(waiting_);
    waiting_.clear();
    somebody_waits_ = false;
    step_began_ = Clock::now();
    lock.unlock();
    const Took took = make_step(blocks);
    if (took) shown_();
    forget_finest(before);
    before.clear();
    for (const pipeline::FinishedTask& block : blocks) before.insert(block.node);
    lock.lock();
    if (!took) {
      ending_ = true;
      continue;
    }
    step_took_ = *took;
    for (const pipeline::FinishedTask& block : blocks) shown_blocks_.insert(block.node);
  }
}

Sharpener::Took Sharpener::make_step(const std::vector<pipeline::FinishedTask>& blocks) const {
  const fs::path shown = folder_ / kProvisionalStore, next = folder_ / kNextProvisional;
  const auto began = processor_time();
  std::string why;
  try {
    pipeline::remove_store(next.string());  // what an attempt that was ended left
    if (fs::space(folder_).available < kTimesStore * fs::file_size(shown)) {
      why = "there is little room on the disk";
    } else {
      const auto made = pipeline::put_done_blocks(shown.string(), plan_, blocks, next.string());
      if (made.ok()) fs::rename(next, shown);
      if (made.ok()) return processor_time() - began;
      why = made.problem().line();
    }
  } catch (const std::exception& error) {  // want of memory, a disk that fails
    why = error.what();
  }
  std::fprintf(stderr, "finished blocks are not shown before the build is done: %s\n", why.c_str());
  pipeline::remove_store(next.string());
  return std::nullopt;
}

}  // namespace cordillera::server
