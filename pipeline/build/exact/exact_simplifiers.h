#pragma once
// Who simplifies exact blocks: a device, and the CPU, which steps in when the device is lost.
#include <algorithm>
#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "gpu/exact/simplify_block.h"
#include "gpu/measure/batch_meter.h"
#include "gpu/measure/surface_memory.h"

namespace cordillera::pipeline {

/// Simplifiers, one for each call that is under way. On a GPU blocks whose plans are the same and that wait for one go there
/// together: a block alone spends most of its time on steps that are too small for a GPU.
class ExactSimplifiers {
 public:
  /// Loops over the host's threads. While a GPU works its caller has nothing else to do, so there the caller takes part.
  struct Loops {
    gpu::ParallelFor on_threads, with_caller;
  };
  ExactSimplifiers(Loops loops, const std::atomic<bool>& stop) : loops_(std::move(loops)), stop_(stop) {}
  /// So many simplifiers are in use at once, and each takes so many blocks together.
  struct Room {
    std::size_t turns = 1, together = 1;
  };
  /// Once, before all else. It does not wait for a GPU, which may take a quarter of a second: whoever needs it does.
  void open(const std::string& device, Room on_cpu, Room on_gpu);
  /// Waits until the device is there. Problems: "unknown-device", "device-unavailable". simplify() has them, too.
  proto::Result<void> opened() const;
  /// One that is known by now.
  std::optional<proto::Problem> problem() const;
  std::size_t at_once() const;  ///< blocks
  bool on_gpu() const;          ///< or on what may turn out to be one
  std::size_t waiting() const;  ///< blocks that no simplifier has taken yet
  std::string device() const;   ///< where blocks are made now, and what became of a device that was lost; waits for it

  using TakeLevel = std::function<void(std::size_t level, gpu::exact::BlockMesh&& mesh)>;
  using TakeSquares = std::function<void(gpu::exact::Squares&& squares)>;
  /// May be called by several threads. Levels come in order, by one thread, before it returns. If a device fails, all come again.
  /// squares: before the levels; may be empty. somebody_waits: it does not wait for blocks for whom nobody does.
  proto::Result<void> simplify(const gpu::exact::Block& block, const gpu::exact::BlockPlan& plan, const TakeLevel& take,
                               const TakeSquares& squares, bool somebody_waits = false);
  /// Likewise, levels above blocks.
  proto::Result<void> simplify_above(const gpu::exact::Ground& ground, const gpu::exact::BlockMesh& start,
                                     const gpu::exact::BlockPlan& plan, const TakeLevel& take);
  /// Frees what is kept from call to call; another call takes longer for it.
  void give_back_memory();

  /// See BatchMeter, on the device; nothing where there is none. Waits while all of its meters are in use, so that no
  /// worker may call it; several threads may.
  std::vector<gpu::SurfaceMemory> measure(std::span<const gpu::SurfaceErrorInput> tiles, double limit_m);

 private:
  /// A block that somebody wants.
  struct Asked {
    const gpu::exact::Block& block;
    const gpu::exact::BlockPlan& plan;
    const TakeLevel& take;
    const TakeSquares& squares;
    bool somebody_waits;
    enum class State : std::uint8_t { waits, under_way, done } state = State::waits;
    std::optional<proto::Result<void>> made = {};  ///< once it is done; none: it failed as follows
    std::exception_ptr thrown = nullptr;
  };
  using Work = std::function<proto::Result<void>(gpu::exact::BlockSimplifier&)>;
  /// A simplifier in use.
  struct Turn {
    std::unique_ptr<gpu::exact::BlockSimplifier> simplifier;
    bool on_device = false;
    bool alone = false;  ///< no other is in use, nor will be meanwhile, and no meter
  };
  /// On the device; where it is lost, on the CPU. asked: whom it is for, may be null; none: another call made that.
  std::optional<proto::Result<void>> call(const Work& work, Asked* asked);
  /// A block that somebody waits for goes alone, for its finest level is there sooner, and takes a turn beside the others'.
  std::size_t most_in_use() const { return std::max(room_.turns, room_.together); }
  /// Waits until there is room for one more; none: what was asked is done.
  std::optional<Turn> begin(Asked* asked);
  void end(Turn turn);
  void failed(const Turn& turn, const std::string& how);
  proto::Result<void> simplify_together(gpu::exact::BlockSimplifier& simplifier, Asked& first);
  std::vector<Asked*> those_like(Asked& first);
  /// There are none from now on: memory is short, or the device is lost.
  void drop_meters() { most_meters_ = 0, idle_meters_.clear(); }
  proto::Result<std::unique_ptr<gpu::exact::BlockSimplifier>> make_simplifier(const std::string& device) const;
  proto::Result<void> open_device(const std::string& device);

  const Loops loops_;
  const std::atomic<bool>& stop_;
  mutable std::mutex mutex_;  ///< of all that follows
  std::condition_variable changed_;
  Room room_, on_cpu_;  ///< now; without a GPU
  std::size_t in_use_ = 0;
  std::vector<Asked*> asked_;                                       ///< those that wait
  std::string wanted_ = "cpu", device_ = "cpu";                     ///< as asked for, and as it calls itself
  std::vector<std::unique_ptr<gpu::exact::BlockSimplifier>> idle_;  ///< of device_
  std::string lost_;
  std::optional<proto::Problem> problem_;            ///< of opening
  std::size_t most_meters_ = 4, meters_in_use_ = 0;  ///< so many keep the threads busy
  std::vector<std::unique_ptr<gpu::BatchMeter>> idle_meters_;
  std::shared_future<proto::Result<void>> opening_;  ///< the last: it uses what is before it
};

}  // namespace cordillera::pipeline
