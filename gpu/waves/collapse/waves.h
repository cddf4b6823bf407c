#pragma once
// Strategy `waves`: the production simplifier. Parallel half-edge collapse in windows, as waves of independent sets.
//
// The driver (waves.inl, batch, window_cut) is written once, in steps over arrays; a Device runs the steps:
//   use()                                        the calling thread works with it
//   kInStep                                      threads that run in step; 1 on a host
//   Array<T>, Staging<T>                         its memory; host memory that is quickly copied to it. reserve(n), data()
//   copy_in(to, from, n), copy_out(to, from, n)  copy_out returns when the values are there
//   zero(to, n)
//   each(n, f)                                   f(i) for i in 0..n-1, in any order
//   cooperate(n, f)                              f(team), the team as large as n pays for; team.each(n, g), team.barrier()
//   select(n, keep, to)                          the i in 0..n-1 with keep(i), ascending; returns how many
//   exclusive_sum(from, to, n)
//   group(values, group_of, first, to)           values by group, group g from first[g], in their old order within a group
//   simplify(mesh, cut, tiles, row_width)        the windows of a pass
//   vertices_at_once()                           how large a batch pays
//   name()
#include <memory>
#include <vector>

#include "gpu/waves/collapse/batch.h"
#include "gpu/waves/collapse/window_cut.h"
#include "proto/stop_watch.h"

namespace cordillera::gpu {

Rules rules_of(const SimplifyJob& job);
/// Some input is no manifold: throws, and says which vertex.
[[noreturn]] void refuse_broken(std::span<const SimplifyJob> jobs);
/// The survivors of a tile as a mesh; removes what must go and is still there.
proto::TileMesh finish_tile(const SimplifyJob& job, const Survivors& survivors);

template <class Device>
class WaveSimplifier final : public Simplifier {
 public:
  WaveSimplifier(std::unique_ptr<Device> device, ParallelFor parallel)
      : device_(std::move(device)), parallel_(std::move(parallel)), batch_(*device_) {}

  std::vector<proto::TileMesh> simplify(std::span<const SimplifyJob> jobs) override;
  std::string device() const override { return device_->name(); }
  std::span<const proto::StageTime> stages() const override { return stages_; }

 private:
  static constexpr int kPasses = 2;  // at least: seams of one lie inside windows of the next
  static constexpr int kMostPasses = 12;
  void simplify_batch(std::span<const SimplifyJob> jobs, std::span<proto::TileMesh> results);
  void end_stage(const std::string& name) { proto::add_time(stages_, name, watch_.lap()); }

  std::unique_ptr<Device> device_;
  ParallelFor parallel_;
  Batch<Device> batch_;
  WindowCutter<Device> cutter_;
  std::vector<proto::StageTime> stages_;
  proto::StopWatch watch_;
};

std::unique_ptr<Simplifier> make_host_waves(ParallelFor parallel);
/// Fails with a reason when the device cannot be used.
proto::Result<std::unique_ptr<Simplifier>> make_cuda_waves(int device, ParallelFor parallel);

}  // namespace cordillera::gpu
