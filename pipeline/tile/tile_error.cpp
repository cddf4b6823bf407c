#include "pipeline/tile/tile_error.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "gpu/measure/sample_meter.h"
#include "gpu/measure/surface_memory.h"
#include "gpu/measure/upright.h"
#include "gpu/measure/upright_flips.h"
#include "gpu/refine/height_step.h"
#include "pipeline/plan/plan.h"
#include "proto/degrees.h"

namespace cordillera::pipeline {
namespace {

gpu::Upright upright_of(const LevelContext& context, const BuiltTile& built) {
  return gpu::Upright({context.lattice, built.tile, built.mesh.side, ecef_steps(*context.level)});
}

/// In a tile at a pole, collapses make fans of needles that plan has the right way up and space has not. A vertex more in each
/// makes them thinner; turning their edges first does not. Errors are for refinement to mend.
void stand_up(BuiltTile& built, const gpu::Upright& upright, const gpu::ErrorMeter& meter) {
  if (is_at_pole(built.tile)) gpu::flip_turned(built.mesh, upright, meter, INFINITY);
}

/// Until no triangle is over the limit, or nothing helps. over: says which are.
template <class Over>
void put_back(BuiltTile& built, const gpu::ErrorMeter& meter, double limit_m, const Over& over) {
  std::vector<std::uint32_t> left = over();
  if (left.empty()) return;
  const gpu::Refined refined = gpu::refine(built.mesh, meter, limit_m, left, SIZE_MAX);
  built.put_back += refined.inserted;
  if (refined.over == 0 || refined.over > kMostLeftOver) return;
  left = over();
  if (left.size() > kMostLeftOver) return;
  built.put_back += gpu::refine_stuck(built.mesh, meter, limit_m, left).inserted;
}

}  // namespace

std::vector<std::uint32_t> in_either(const std::vector<std::uint32_t>& a, const std::vector<std::uint32_t>& b) {
  std::vector<std::uint32_t> all;
  std::set_union(a.begin(), a.end(), b.begin(), b.end(), std::back_inserter(all));
  return all;
}

double rounding_m(const proto::LevelPlan& level, const proto::Lattice& lattice, const proto::TileAddress& tile) {
  // A coordinate moves by half of a step at the most, and counts as far as the normal leans that way.
  constexpr double kHalf = 0.5;
  const std::int64_t units = lattice.tile_units(tile.z);
  double lean = 0;
  for (int k = 0; k < 9; ++k) {
    const double latitude = lattice.latitude_deg(lattice.south(tile) + units * (k / 3) / 2) * proto::kDegree,
                 longitude = lattice.longitude_deg(lattice.west(tile) + units * (k % 3) / 2) * proto::kDegree;
    lean = std::max(lean, std::cos(latitude) * (std::abs(std::cos(longitude)) + std::abs(std::sin(longitude))) +
                              std::abs(std::sin(latitude)));
  }
  return kHalf * level.ecef_step() * lean + kHalf * height_step(level) * proto::kHeightStep_m;
}

double limit_of(const LevelContext& context) { return context.level->target() - gpu::kGrace_m; }
double limit_of(const LevelContext& context, const proto::TileAddress& tile) {
  const double limit_m = limit_of(context), rounding = rounding_m(*context.level, *context.lattice, tile);
  return limit_m >= kNearRounding * rounding ? limit_m : kNearRounding * rounding;
}

gpu::SurfaceErrorInput surface_input(const LevelContext& context, const BuiltTile& built) {
  gpu::SurfaceErrorInput input;
  input.lattice = context.lattice;
  input.tile = built.tile;
  input.mesh = &built.mesh;
  input.samples = context.samples;
  input.ecef_steps = ecef_steps(*context.level);
  input.frames = context.frames;
  return input;
}

void measure(const LevelContext& context, BuiltTile& built, gpu::SurfaceMemory& memory) {
  const gpu::SurfaceErrorInput input = surface_input(context, built);
  const double limit_m = limit_of(context, built.tile);
  const gpu::Upright upright = upright_of(context, built);
  const std::int32_t step = height_step(*context.level);
  const gpu::SampleMeter samples(input, step);
  stand_up(built, upright, samples);
  const auto over = [&] {
    return in_either(gpu::triangles_over(gpu::surface_error(input, limit_m, memory)), gpu::turned_triangles(upright, built.mesh));
  };
  const gpu::UprightMeter in_space(samples, upright);
  const gpu::SteppedMeter meter(in_space, step);
  put_back(built, meter, limit_m, over);
  gpu::flip_turned(built.mesh, upright, samples, limit_m);
  built.measured = gpu::surface_error(input, limit_m, memory);
  built.max_error_m = built.measured.max_m + gpu::kGrace_m;
}

}  // namespace cordillera::pipeline
