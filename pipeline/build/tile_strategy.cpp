#include "pipeline/build/tile_strategy.h"

#include <algorithm>
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

proto::TileMesh with_rounded_heights(proto::TileMesh mesh, std::int32_t step) {
  for (std::int32_t& height : mesh.height) height = gpu::rounded_height(height, step);
  return mesh;
}

/// Places of a tile whose samples are to be kept.
using KeptBoxes = std::vector<TileRectangle>;

/// Around the triangles that are over the limit.
void add_boxes(const BuiltTile& made, std::int64_t step, KeptBoxes& boxes) {
  const auto around = static_cast<std::int32_t>(2 * step);
  const proto::TileMesh& mesh = made.mesh;
  for (const std::uint32_t k : gpu::triangles_over(made.measured)) {
    const auto& [a, b, c] = mesh.triangles[k];
    const auto [west, east] = std::minmax({mesh.x[a], mesh.x[b], mesh.x[c]});
    const auto [south, north] = std::minmax({mesh.y[a], mesh.y[b], mesh.y[c]});
    boxes.push_back({west - around, south - around, east + around, north + around});
  }
}

void keep_in(const KeptBoxes& boxes, std::int64_t step, proto::TileMesh& grid) {
  const std::int64_t across = grid.side / step + 1;
  std::vector<char> kept(static_cast<std::size_t>(across * across));
  for (const TileRectangle& box : boxes) {
    for (std::int64_t y = std::max<std::int64_t>(box.south / step, 0); y <= std::min(box.north / step, across - 1); ++y)
      for (std::int64_t x = std::max<std::int64_t>(box.west / step, 0); x <= std::min(box.east / step, across - 1); ++x)
        kept[static_cast<std::size_t>(y * across + x)] = 1;
  }
  for (std::size_t v = 0; v < grid.vertices(); ++v)
    if (kept[static_cast<std::size_t>(grid.y[v] / step * across + grid.x[v] / step)]) grid.mark[v] |= proto::kKeep;
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
  // A worker may not begin a loop: it would wait for workers.
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

proto::TileMesh TileStrategy::run_engine(const gpu::SimplifyJob& job, unsigned worker) {
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

void TileStrategy::simplify(const LevelContext& context, BuiltTile& tile, unsigned worker) {
  constexpr int kAttempts = 4;
  const proto::TileMesh exact = published_part(tile.mesh);
  gpu::SimplifyJob job;
  job.unit_m = static_cast<float>(proto::kSemiMajor_m * std::numbers::pi / static_cast<double>(context.lattice->rows()));
  job.tolerance_m = static_cast<float>(context.level->target());
  job.rim_units = static_cast<float>(context.level->rim_tolerance());
  std::int64_t step = step_of(options_, *context.lattice, tile.tile.z);
  KeptBoxes boxes;
  const bool may_try = !is_at_pole(tile.tile) && !exact.triangles.empty();
  for (int attempt = 0; may_try && attempt < kAttempts && !stop_; ++attempt) {
    proto::TileMesh grid = tile_grid(*context.lattice, tile, *context.samples, step);
    keep_in(boxes, step, grid);
    const std::vector<float> elevation = elevations(*context.lattice, tile.tile, grid);
    job.input = &grid, job.elevation = elevation;
    BuiltTile made;
    made.tile = tile.tile;
    made.mesh = with_rounded_heights(published_part(run_engine(job, worker)), height_step(*context.level));
    if (made.mesh.triangles.empty()) break;
    gpu::SurfaceMemory memory;
    if (measure_exact(context, made, memory) == 0 || !context.put_back) {
      if (is_upright(context, made) && shows_its_data(context, made, exact)) return void(tile = std::move(made));
      break;
    }
    add_boxes(made, step, boxes);
    step = std::max<std::int64_t>(step / 2, 1);
  }
  tile.mesh = exact;
  gpu::SurfaceMemory memory;
  if (!exact.triangles.empty()) measure_exact(context, tile, memory);
}

}  // namespace cordillera::pipeline
