#include "pipeline/build/exact/exact_simplifiers.h"

#include <algorithm>
#include <utility>

#include "gpu/device/device_choice.h"
#include "gpu/device/device_lost.h"

namespace cordillera::pipeline {
namespace {

const std::string kCpu = "cpu";

bool has_shared_sides(const gpu::exact::Block& block) {
  return std::find(block.sides.begin(), block.sides.end(), gpu::exact::SideKind::shared) != block.sides.end();
}

}  // namespace

proto::Result<std::unique_ptr<gpu::exact::BlockSimplifier>> ExactSimplifiers::make_simplifier(const std::string& device) const {
  return gpu::exact::make_block_simplifier(device, device == kCpu ? loops_.on_threads : loops_.with_caller);
}

void ExactSimplifiers::open(const std::string& device, Room on_cpu, Room on_gpu) {
  const bool is_cpu = device == kCpu || (gpu::is_any_device(device) && !gpu::has_cuda_driver());
  wanted_ = is_cpu ? kCpu : device;
  on_cpu_ = on_cpu;
  room_ = is_cpu ? on_cpu : on_gpu;
  constexpr auto kInTheBackground = std::launch::async | std::launch::deferred;  // the latter where no thread is to be had
  const auto work = [this, wanted = wanted_] { return open_device(wanted); };
  opening_ = std::async(is_cpu ? std::launch::deferred : kInTheBackground, work).share();
}

proto::Result<void> ExactSimplifiers::opened() const { return opening_.get(); }

proto::Result<void> ExactSimplifiers::open_device(const std::string& device) {
  auto simplifier = make_simplifier(device);
  if (simplifier.ok() && (*simplifier)->device() == kCpu) simplifier = make_simplifier(kCpu);  // "auto" did not know
  const std::lock_guard lock(mutex_);
  if (!simplifier.ok()) {
    problem_ = simplifier.problem();
    wanted_ = kCpu, room_ = {1, 1};  // nothing is read for it any more
    return *problem_;
  }
  device_ = (*simplifier)->device();
  wanted_ = device_.substr(0, device_.find(' '));  // "auto" might be the CPU the next time
  if (device_ == kCpu) room_ = on_cpu_;
  idle_.push_back(std::move(*simplifier));
  return {};
}

std::optional<proto::Problem> ExactSimplifiers::problem() const {
  const std::lock_guard lock(mutex_);
  return problem_;
}

std::size_t ExactSimplifiers::at_once() const {
  const std::lock_guard lock(mutex_);
  return room_.turns * room_.together;
}

bool ExactSimplifiers::on_gpu() const {
  const std::lock_guard lock(mutex_);
  return wanted_ != kCpu;
}

std::size_t ExactSimplifiers::waiting() const {
  const std::lock_guard lock(mutex_);
  return asked_.size();
}

std::string ExactSimplifiers::device() const {
  opening_.wait();
  const std::lock_guard lock(mutex_);
  return device_ + lost_;
}

std::optional<ExactSimplifiers::Turn> ExactSimplifiers::begin(Asked* asked) {
  std::unique_lock lock(mutex_);
  const auto has_room = [&] {
    if (most_meters_ == 0 && meters_in_use_ > 0) return false;  // they end soon, and have memory that was short
    if (asked && asked->somebody_waits) return in_use_ < most_in_use();
    // While another works, half as many as may go together are waited for.
    return in_use_ == 0 || (in_use_ < room_.turns && (!asked || 2 * asked_.size() >= room_.together));
  };
  const auto is = [&](Asked::State state) { return asked && asked->state == state; };
  changed_.wait(lock, [&] { return is(Asked::State::done) || (!is(Asked::State::under_way) && has_room()); });
  if (is(Asked::State::done)) return std::nullopt;
  if (asked) {
    asked->state = Asked::State::under_way;
    std::erase(asked_, asked);
  }
  ++in_use_;
  Turn turn;
  turn.on_device = device_ != kCpu;
  turn.alone = room_.turns == 1 && room_.together == 1 && most_meters_ == 0;
  if (!idle_.empty()) {
    turn.simplifier = std::move(idle_.back());
    idle_.pop_back();
  }
  return turn;
}

void ExactSimplifiers::end(Turn turn) {
  std::unique_lock lock(mutex_);
  if (turn.simplifier && turn.on_device == (device_ != kCpu) && idle_.size() + in_use_ <= most_in_use())
    idle_.push_back(std::move(turn.simplifier));
  lock.unlock();
  turn.simplifier.reset();  // who comes next may need its memory
  lock.lock();
  --in_use_;
  changed_.notify_all();
}

/// Beside others it may have had too little memory: one block at a time, then, and once more. The one that fails alone is lost.
void ExactSimplifiers::failed(const Turn& turn, const std::string& how) {
  const std::lock_guard lock(mutex_);
  idle_.clear();
  drop_meters();
  room_ = {1, 1};
  if (!turn.alone) return;
  lost_ = ", after " + device_ + " was lost: " + how;
  wanted_ = device_ = kCpu;
  room_ = on_cpu_;
}

std::optional<proto::Result<void>> ExactSimplifiers::call(const Work& work, Asked* asked) {
  for (;;) {
    std::optional<Turn> turn = begin(asked);
    if (!turn) return std::nullopt;
    const std::shared_ptr<void> at_the_end(nullptr, [&](void*) { end(std::move(*turn)); });
    try {
      if (!turn->simplifier) {
        auto made = make_simplifier(turn->on_device ? wanted_ : kCpu);
        if (!made.ok()) throw gpu::DeviceLost(made.problem().detail);
        turn->simplifier = std::move(*made);
      }
      return work(*turn->simplifier);
    } catch (const gpu::DeviceLost& lost) {
      turn->simplifier.reset();  // its memory is free for the next
      failed(*turn, lost.what());
      const std::lock_guard lock(mutex_);
      if (asked) asked->state = Asked::State::waits, asked_.push_back(asked);
    }
  }
}

/// What waits and can go with it: it is under way from now on.
std::vector<ExactSimplifiers::Asked*> ExactSimplifiers::those_like(Asked& first) {
  const std::lock_guard lock(mutex_);
  std::vector<Asked*> together{&first};
  for (Asked* other : asked_) {
    if (together.size() >= room_.together || first.somebody_waits) break;
    if (!other->somebody_waits && other->plan == first.plan && has_shared_sides(other->block) == has_shared_sides(first.block) &&
        (other->squares == nullptr) == (first.squares == nullptr))
      together.push_back(other);
  }
  for (Asked* one : together) one->state = Asked::State::under_way;
  std::erase_if(asked_, [](const Asked* one) { return one->state == Asked::State::under_way; });
  return together;
}

proto::Result<void> ExactSimplifiers::simplify_together(gpu::exact::BlockSimplifier& simplifier, Asked& first) {
  const std::vector<Asked*> together = those_like(first);
  gpu::exact::Watch watch;
  watch.stop = &stop_;
  watch.level = [&](std::size_t level, std::vector<gpu::exact::BlockMesh>& meshes) {
    for (std::size_t b = 0; b < together.size(); ++b) together[b]->take(level, std::move(meshes[b]));
  };
  if (first.squares) watch.squares = [&](std::size_t b, gpu::exact::Squares&& known) { together[b]->squares(std::move(known)); };
  const auto give_to_others = [&](const auto& give) {
    const std::lock_guard lock(mutex_);
    for (Asked* one : together) {
      if (one != &first) give(*one);
    }
    changed_.notify_all();
  };
  try {
    std::vector<gpu::exact::Block> blocks;
    for (const Asked* one : together) blocks.push_back(one->block);
    const auto made = simplifier.simplify(blocks, first.plan, watch);
    const proto::Result<void> result = made.ok() ? proto::Result<void>() : made.problem();
    give_to_others([&](Asked& one) { one.made = result, one.state = Asked::State::done; });
    return result;
  } catch (const gpu::DeviceLost&) {
    give_to_others([&](Asked& one) { one.state = Asked::State::waits, asked_.push_back(&one); });
    throw;
  } catch (...) {
    give_to_others([&](Asked& one) { one.thrown = std::current_exception(), one.state = Asked::State::done; });
    throw;
  }
}

proto::Result<void> ExactSimplifiers::simplify(const gpu::exact::Block& block, const gpu::exact::BlockPlan& plan,
                                               const TakeLevel& take, const TakeSquares& squares, bool somebody_waits) {
  if (const auto ready = opened(); !ready.ok()) return ready;
  Asked asked{block, plan, take, squares, somebody_waits};
  {
    const std::lock_guard lock(mutex_);
    asked_.push_back(&asked);
    changed_.notify_all();  // there may be enough of them now
  }
  const std::shared_ptr<void> at_the_end(nullptr, [&](void*) {
    const std::lock_guard lock(mutex_);
    std::erase(asked_, &asked);
  });
  const auto made = call([&](gpu::exact::BlockSimplifier& simplifier) { return simplify_together(simplifier, asked); }, &asked);
  if (made) return *made;
  if (asked.thrown) std::rethrow_exception(asked.thrown);
  return *asked.made;
}

proto::Result<void> ExactSimplifiers::simplify_above(const gpu::exact::Ground& ground, const gpu::exact::BlockMesh& start,
                                                     const gpu::exact::BlockPlan& plan, const TakeLevel& take) {
  if (const auto ready = opened(); !ready.ok()) return ready;
  gpu::exact::Watch watch;
  watch.stop = &stop_;
  watch.level = [&](std::size_t level, std::vector<gpu::exact::BlockMesh>& meshes) { take(level, std::move(meshes.front())); };
  const Work work = [&](gpu::exact::BlockSimplifier& simplifier) -> proto::Result<void> {
    const auto made = simplifier.simplify_above(ground, start, plan, watch);
    return made.ok() ? proto::Result<void>() : made.problem();
  };
  return *call(work, nullptr);
}

void ExactSimplifiers::give_back_memory() {
  const std::lock_guard lock(mutex_);
  idle_.clear();
  idle_meters_.clear();
}

std::vector<gpu::SurfaceMemory> ExactSimplifiers::measure(std::span<const gpu::SurfaceErrorInput> tiles, double limit_m) {
  std::unique_ptr<gpu::BatchMeter> meter;
  std::string device;
  {
    std::unique_lock lock(mutex_);
    // Who waits is no worker: those may have other blocks' tiles to finish meanwhile.
    changed_.wait(lock, [this] { return wanted_ == kCpu || most_meters_ == 0 || meters_in_use_ < most_meters_; });
    if (wanted_ == kCpu || most_meters_ == 0) return {};
    ++meters_in_use_;
    device = wanted_;
    if (!idle_meters_.empty()) {
      meter = std::move(idle_meters_.back());
      idle_meters_.pop_back();
    }
  }
  bool works = false;
  const std::shared_ptr<void> at_the_end(nullptr, [&](void*) {
    const std::lock_guard lock(mutex_);
    --meters_in_use_;
    if (!works) drop_meters();
    if (works && most_meters_ > 0) idle_meters_.push_back(std::move(meter));
    meter.reset();
    changed_.notify_all();
  });
  try {
    if (!meter) {
      if (auto made = gpu::make_batch_meter(device); made.ok()) meter = std::move(*made);
    }
    if (!meter) return {};
    std::vector<gpu::SurfaceMemory> memories(tiles.size());
    meter->measure(tiles, limit_m, memories);
    works = true;
    return memories;
  } catch (const gpu::DeviceLost&) { return {}; }
}

}  // namespace cordillera::pipeline
