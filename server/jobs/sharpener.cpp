#include "server/jobs/sharpener.h"

#include <algorithm>
#include <cstdio>
#include <exception>

#include "pipeline/build/sharpen.h"
#include "pipeline/store/sqlite.h"
#include "server/datasets/layout.h"
#include "server/jobs/looked_at.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

// Between two steps: clients load all that they see again.
constexpr auto kLeastPause = std::chrono::milliseconds(1500);
constexpr int kShareOfBuild = 4;  // of the time so far, or more, unless somebody looks at a block that is done
constexpr int kTimesStep = 10;    // of what the last one took

bool is_under(const proto::TileAddress& tile, const proto::TileAddress& node) {
  const int up = tile.z - node.z;
  return up >= 0 && tile.x >> up == node.x && tile.y >> up == node.y;
}

}  // namespace

Sharpener::~Sharpener() {
  if (under_way_.valid()) under_way_.wait();
}

std::vector<proto::TileAddress> Sharpener::looked_at() { return read_looked_at(folder_); }

bool Sharpener::can_show(const proto::Plan& plan) {
  if (use_ != Use::unknown) return use_ == Use::yes;
  const auto shown = pipeline::StoreReader::manifest_of((folder_ / kProvisionalStore).string());
  use_ = shown.ok() && pipeline::can_show_blocks(plan, *shown) ? Use::yes : Use::no;
  plan_ = plan;
  return use_ == Use::yes;
}

bool Sharpener::is_due() const {
  const auto now = Clock::now();
  const Clock::duration usual = somebody_waits_ ? Clock::duration() : (now - started_) / kShareOfBuild;
  return now - step_began_ >= std::max({Clock::duration(kLeastPause), usual, step_took_ * kTimesStep});
}

bool Sharpener::take(const proto::Plan& plan, pipeline::FinishedTask&& block) {
  if (!can_show(plan)) return false;
  block.mesh.reset();
  block.consumed.clear();
  for (const proto::TileAddress& tile : looked_at()) somebody_waits_ = somebody_waits_ || is_under(tile, block.node);
  waiting_.push_back(std::move(block));
  const bool shown = has_ended();
  if (!under_way_.valid() && is_due()) begin();
  return shown;
}

bool Sharpener::end() {
  if (use_ != Use::yes) return false;
  if (under_way_.valid()) under_way_.wait();
  const bool shown = has_ended();
  if (waiting_.empty() || !is_due()) return shown;
  begin();
  under_way_.wait();
  return has_ended() || shown;
}

void Sharpener::begin() {
  step_began_ = Clock::now();
  somebody_waits_ = false;
  under_way_ = std::async(std::launch::async, [this, blocks = std::move(waiting_)] { return make_step(blocks); });
  waiting_.clear();
}

/// Whether a step came to its end that was under way, and stands.
bool Sharpener::has_ended() {
  if (!under_way_.valid() || under_way_.wait_for(std::chrono::seconds(0)) != std::future_status::ready) return false;
  const Took took = under_way_.get();
  if (took) step_took_ = *took;
  else use_ = Use::no, waiting_.clear();
  return took.has_value();
}

Sharpener::Took Sharpener::make_step(const std::vector<pipeline::FinishedTask>& blocks) const {
  const fs::path next = folder_ / kNextProvisional;
  const auto began = Clock::now();
  std::string why;
  try {
    pipeline::remove_database(next.string());  // what an attempt that was ended left
    const auto made = pipeline::put_done_blocks((folder_ / kProvisionalStore).string(), plan_, blocks, next.string());
    std::error_code error;
    if (made.ok()) fs::rename(next, folder_ / kProvisionalStore, error);
    if (made.ok() && !error) return Clock::now() - began;
    why = made.ok() ? error.message() : made.problem().line();
  } catch (const std::exception& error) {  // want of memory, a disk that fails
    why = error.what();
  }
  std::fprintf(stderr, "finished blocks are not shown before the build is done: %s\n", why.c_str());
  pipeline::remove_database(next.string());
  return std::nullopt;
}

}  // namespace cordillera::server
