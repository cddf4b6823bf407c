#include "pipeline/build/tile_strategy.h"

#include <numbers>
#include <utility>

#include "gpu/device/device_lost.h"
#include "gpu/measure/surface_memory.h"
#include "gpu/measure/upright.h"
#include "gpu/mesh/mesh_point.h"
#include "gpu/refine/height_step.h"
#include "pipeline/bound/cover.h"
#include "pipeline/build/exact/exact_block.h"
#include "pipeline/build/pilot.h"
#include "pipeline/plan/plan.h"
#include "pipeline/tile/tile_grid.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

/// Without void triangles, and without vertices that no triangle has.
proto::TileMesh published_part(const proto::TileMesh& whole) {
  constexpr std::uint32_t kNone = UINT32_MAX;
  proto::TileMesh part;
  part.side = whole.side;
  std::vector<std::uint32_t> number(whole.vertices(), kNone);
  for (const auto& triangle : whole.triangles) {
    if (!is_published(whole, triangle)) continue;
    for (const std::uint32_t v : triangle) number[v] = 0;
    part.triangles.push_back(triangle);
  }
  for (std::uint32_t v = 0; v < number.size(); ++v) {
    if (number[v] == kNone) continue;
    number[v] = static_cast<std::uint32_t>(part.vertices());
    part.x.push_back(whole.x[v]);
    part.y.push_back(whole.y[v]);
    part.height.push_back(whole.height[v]);
    part.mark.push_back(0);
  }
  for (auto& triangle : part.triangles)
    for (std::uint32_t& v : triangle) v = number[v];
  return part;
}

/// Between the samples that a level begins with: a cell, or less where a share of triangles is asked for that needs more of them.
std::int64_t step_of(const proto::BuildOptions& options, const proto::Lattice& lattice, int z) {
  constexpr double kMostShare = 0.3;  // of what it begins with
  std::int64_t step = lattice.cell_units(z);
  if (options.keep_size() == 0) return step;
  const double share = kept_share(options, lattice.finest_level - z);
  while (step > 1 && share * static_cast<double>(step * step) > kMostShare) step /= 2;
  return step;
}

double published_area(const proto::TileMesh& mesh) {
  const auto point = [&](std::uint32_t v) { return gpu::MeshPoint{mesh.x[v], mesh.y[v], 0}; };
  double doubled = 0;
  for (const auto& t : mesh.triangles) doubled += static_cast<double>(gpu::twice_area(point(t[0]), point(t[1]), point(t[2])));
  return doubled / 2;
}

/// Nearly as much as exact does, and all that is well inside the data.
bool shows_its_data(const LevelContext& context, const BuiltTile& tile, const proto::TileMesh& exact) {
  constexpr double kLeastShare = 0.9;
  if (published_area(tile.mesh) < kLeastShare * published_area(exact)) return false;
  return uncovered_inside(*context.lattice, tile.tile, tile.mesh, *context.samples,
                          part_in_window(*context.lattice, tile.tile, *context.samples))
      .empty();
}

bool is_upright(const LevelContext& context, const BuiltTile& tile) {
  const gpu::Upright upright({context.lattice, tile.tile, tile.mesh.side, ecef_steps(*context.level)});
  return gpu::turned_triangles(upright, tile.mesh).empty();
}

}  // namespace

proto::Result<void> TileStrategy::open(const std::string& device, const proto::Plan& plan) {
  const std::string strategy = strategy_of(plan);
  options_ = plan.options();
  if (strategy == gpu::kExact) return {};
  // What remains on the host is one tile: a loop of the workers would take up others, which wait for the device.
  auto simplifier = gpu::make_simplifier(device, gpu::one_after_the_other, strategy);
  if (!simplifier.ok()) return simplifier.problem();
  if ((*simplifier)->device() != "cpu") on_device_ = std::move(*simplifier);
  has_device_ = on_device_ != nullptr;
  for (unsigned k = 0; k < workers_.threads(); ++k)
    on_cpu_.push_back(gpu::make_simplifier("cpu", gpu::one_after_the_other, strategy).value());
  return {};
}

std::string TileStrategy::device() const {
  const std::lock_guard lock(device_mutex_);
  return on_device_ ? on_device_->device() : "cpu" + lost_;
}

proto::TileMesh TileStrategy::simplified(const gpu::SimplifyJob& job, unsigned worker) {
  if (has_device_) {
    const std::lock_guard lock(device_mutex_);
    try {
      if (on_device_) return std::move(on_device_->simplify({&job, 1}).front());
    } catch (const gpu::DeviceLost& lost) {  // the CPU gives the same bytes
      lost_ = ", after " + on_device_->device() + " was lost: " + lost.what();
      has_device_ = false;
      on_device_.reset();
    }
  }
  return std::move(on_cpu_[worker]->simplify({&job, 1}).front());
}

proto::TileMesh TileStrategy::simplified(const LevelContext& context, const BuiltTile& tile, double caution, unsigned worker) {
  const proto::TileMesh grid =
      tile_grid(*context.lattice, tile, *context.samples, step_of(options_, *context.lattice, tile.tile.z));
  const std::vector<float> elevation = elevations(*context.lattice, tile.tile, grid);
  gpu::SimplifyJob job;
  job.input = &grid;
  job.elevation = elevation;
  job.unit_m = static_cast<float>(proto::kSemiMajor_m * std::numbers::pi / static_cast<double>(context.lattice->rows()));
  job.tolerance_m = static_cast<float>(context.level->target() / caution);
  job.rim_units = static_cast<float>(context.level->rim_tolerance());
  proto::TileMesh mesh = published_part(simplified(job, worker));
  const std::int32_t step = height_step(*context.level);
  for (std::int32_t& height : mesh.height) height = gpu::rounded_height(height, step);
  return mesh;
}

void TileStrategy::simplify(const LevelContext& context, BuiltTile& tile, unsigned worker) {
  const BuiltTile given = std::move(tile);
  const proto::TileMesh exact = published_part(given.mesh);
  tile = {};
  tile.tile = given.tile;
  if (!is_at_pole(given.tile) && !exact.triangles.empty()) {
    for (const double caution : {1.0, 2.0, 4.0}) {
      tile.mesh = simplified(context, given, caution, worker);
      if (tile.mesh.triangles.empty()) break;
      gpu::SurfaceMemory memory;
      const bool keeps_target = measure_exact(context, tile, memory) == 0 || !context.put_back;
      if (keeps_target && is_upright(context, tile) && shows_its_data(context, tile, exact)) return;
    }
  }
  tile.mesh = exact;
  tile.put_back = 0;
}

}  // namespace cordillera::pipeline
