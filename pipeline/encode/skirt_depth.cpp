#include "pipeline/encode/skirt_depth.h"

#include <algorithm>

#include "proto/ellipsoid.h"

namespace cordillera::pipeline {
namespace {

constexpr int kLevelsApart = 2;  // of neighbours that a viewer shows side by side
constexpr double kRoundingSteps = 8;
// A coarser neighbour's chain runs on beyond this tile, down into valleys that it does not hold.
constexpr double kReliefBeyond_m = 500;

struct MinMax {
  std::int32_t low = INT32_MAX, high = INT32_MIN;
  void add(std::int32_t value) {
    low = std::min(low, value);
    high = std::max(high, value);
  }
  double size() const { return static_cast<double>(high) - low; }
};

/// Below the data's lowest point a coarser neighbour may reach by what flat triangles are off: by their stated errors or, where
/// the data is small, by the earth's curvature below them. Targets of coarse levels allow for far more. apart: errors that two
/// neighbours may be apart.
double floor_m(const EncodeInput& input, const PublishedMesh& published, double apart) {
  MinMax x, y, height;
  for (const std::uint32_t v : published.source) {
    x.add(input.mesh->x[v]);
    y.add(input.mesh->y[v]);
    height.add(input.mesh->height[v]);
  }
  const proto::Lattice& lattice = *input.lattice;
  const std::int64_t south = lattice.south(input.tile);
  const double widest =
      std::max(proto::row_frame(lattice, south + y.low).cos_lat, proto::row_frame(lattice, south + y.high).cos_lat);
  const double reach_m = std::max(x.size() * widest, y.size()) * proto::cell_height_m(lattice, lattice.rows() / 2);
  const double sag_m = reach_m * reach_m / (2 * proto::kSemiMajor_m);  // of a chord twice as long
  return height.low * proto::kHeightStep_m - std::max(kReliefBeyond_m, std::min(apart * input.geometric_error_m, sag_m));
}

}  // namespace

Skirts skirts_of(const EncodeInput& input, const PublishedMesh& published, const proto::LevelPlan& level, int coarsest_level) {
  // Both levels' border chains may be off, in opposite directions. Finer ones are off by less, coarser ones, if there are any, by
  // more.
  const double apart = 2 + std::clamp(input.tile.z - coarsest_level, 0, kLevelsApart);
  const double rounding_m = kRoundingSteps * input.ecef_steps.coarsest_m;
  return {apart * level.chain_tolerance() + rounding_m, floor_m(input, published, apart) - rounding_m};
}

}  // namespace cordillera::pipeline
