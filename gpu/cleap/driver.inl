#pragma once
// The steps of Figure 4.1, pass after pass: connect, select, windows, rearrange.
#include "gpu/cleap/engine.h"
#include "gpu/cleap/metrics.h"
#include "gpu/cleap/pool_maker.h"
#include "gpu/cleap/windows.h"
#include "gpu/cleap/working_mesh.h"
#include "proto/stop_watch.h"

namespace cordillera::gpu::cleap {

template <class Device>
class Driver : public Engine {
 public:
  explicit Driver(std::unique_ptr<Device> device) : device_(std::move(device)), mesh_(*device_), pool_(*device_) {}

  Outcome simplify(const fit::HeightMesh& from, const CollapseTarget& target, const Options& options) override {
    device_->use();
    device_->forget_stamps();
    Outcome outcome;
    with_metric(AllMetrics{}, options.metric,
                [&]<class Metric>(Metric) { outcome.crowded_edge = !simplify<Metric>(from, target, options, outcome.result); });
    return outcome;
  }

  Outcome simplify_tile(const fit::HeightMesh& from, TileTags& tile, const Options& options) override {
    device_->use();
    device_->forget_stamps();
    Outcome outcome;
    outcome.crowded_edge = !simplify<QuadricOnTile>(from, {}, options, outcome.result, &tile);
    return outcome;
  }
  std::string device() const override { return device_->name(); }

  fit::HeightMesh smooth(const fit::HeightMesh& from, std::uint32_t steps, double lambda, double mu) override {
    device_->use();
    mesh_.load(from);
    if (!mesh_.connect(false)) return {};
    for (std::uint32_t step = 0; step < steps; ++step) {
      mesh_.smooth(lambda);
      mesh_.smooth(mu);
    }
    return mesh_.taken_out();
  }

 private:
  /// False: an edge has more than two triangles.
  template <class Metric>
  bool simplify(const fit::HeightMesh& from, const CollapseTarget& target, const Options& options, Simplified& result,
                TileTags* tile = nullptr) {
    Report& report = result.report;
    report.device = device_->name();
    watch_.lap();
    mesh_.load(from);
    if (tile) mesh_.load_tags(tile->tags, tile->rim_units);
    report.copy_seconds += lap();
    Goal goal{target, from.triangles.size(), 0};
    Windows<Device> windows(*device_, options, report);
    for (bool again = true; again;) {
      if (!mesh_.connect(options.repair == Repair::around || options.around_first > 0)) return false;
      if (Metric::kQuadrics && report.passes == 0) mesh_.sum_planes();
      report.build_seconds += lap();
      const std::uint64_t before = goal.collapses,
                          idle = static_cast<std::uint64_t>(options.idle_share * mesh_.arrays().vertices);
      const std::uint32_t size = pool_.template make<Metric>(mesh_.arrays(), options, report.passes);
      report.select_seconds += lap();
      windows.template run<Metric>(mesh_.arrays(), pool_.data(), size, goal);
      report.collapse_seconds += lap();
      ++report.passes;
      again = goal.left() > 0 && goal.collapses > before + idle && report.passes < options.most_passes;
      mesh_.rearrange(again ? Rearrange::scan : options.rearrange);
      report.rearrange_seconds += lap();
      if (options.delaunay == Delaunay::between || (options.delaunay == Delaunay::at_end && !again)) refine(report);
    }
    result.mesh = mesh_.taken_out();
    if (tile) tile->tags = mesh_.tags();
    report.copy_seconds += lap();
    report.vertices = result.mesh.vertices();
    report.triangles = result.mesh.triangles.size();
    return true;
  }

  void refine(Report& report) {
    mesh_.connect(false);
    mesh_.make_delaunay();
    report.refine_seconds += lap();
  }

  /// Since the last one; the device has come to an end.
  double lap() {
    mesh_.wait();
    return watch_.lap();
  }

  std::unique_ptr<Device> device_;
  WorkingMesh<Device> mesh_;
  PoolMaker<Device> pool_;
  proto::StopWatch watch_;
};

}  // namespace cordillera::gpu::cleap
