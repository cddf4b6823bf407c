#include "pipeline/work/lanes.h"

#include "pipeline/plan.h"

namespace cordillera::pipeline::work {
namespace {

constexpr int kManyTilesBelow = 3;  // levels: a block of 64 tiles and more has work for all threads

}  // namespace

proto::Result<std::unique_ptr<Lanes>> Lanes::open(const BuildRequest& request, const proto::Plan& plan,
                                                  const std::atomic<bool>& stop) {
  std::unique_ptr<Lanes> lanes(new Lanes(stop));
  const auto add = [&](unsigned threads) -> proto::Result<void> {
    lanes->lanes_.push_back(std::make_unique<Lane>(threads, request, plan, stop));
    return lanes->lanes_.back()->builder.prepare();
  };
  const bool large = plan.finest_level() - plan.block_level() >= kManyTilesBelow;
  if (const auto first = add(large ? request.options.threads() : 1); !first.ok()) return first.problem();
  unsigned count = 1;
  if (!large && lanes->lanes_.front()->builder.device() == "cpu") {
    count = Workers(request.options.threads()).threads();
    while (lanes->lanes_.size() < count) {
      if (const auto more = add(1); !more.ok()) return more.problem();
    }
  } else if (!large) {
    lanes->lanes_.clear();
    if (const auto one = add(request.options.threads()); !one.ok()) return one.problem();
  }
  lanes->crew_ = std::make_unique<Workers>(count);
  return lanes;
}

proto::Result<void> Lanes::each(std::size_t count, const Task& task) {
  std::mutex mutex;
  std::optional<proto::Problem> problem;
  std::atomic<bool> failed{false};
  crew_->each(count, [&](std::size_t k, unsigned worker) {
    if (stop_ || failed) return;
    const auto done = task(lanes_[worker]->builder, k);
    if (done.ok()) return;
    const std::lock_guard lock(mutex);
    if (!problem) problem = done.problem();
    failed = true;
  });
  if (problem) return *problem;
  if (stop_) return proto::Problem{"cancelled", "the build was cancelled", "", ""};
  return {};
}

}  // namespace cordillera::pipeline::work
