#include "pipeline/faces/quantized_mesh/quantized_mesh_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "proto/ellipsoid.h"
#include "proto/mesh.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr std::int32_t kMostSeaCells = 64;

/// A flat cell sags below the sea by s = R (angle)^2 / 8: as many cells as keep that within the level's own promise.
std::int32_t sea_cells(int z, double target_m) {
  const double side = std::numbers::pi / std::ldexp(1, z);
  std::int32_t cells = 1;
  while (cells < kMostSeaCells && proto::kSemiMajor_m * side * side / (8.0 * cells * cells) > target_m) cells *= 2;
  return cells;
}

std::optional<double> height_in(const MeshIndex& index, std::int32_t u, std::int32_t v) {
  const auto found = index.triangle_at(u, v);
  if (!found) return std::nullopt;
  const LatticeMesh& mesh = index.mesh();
  const Triangle& t = mesh.triangles[*found];
  double sum = 0, area = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const auto &p = mesh.points[t[(k + 1) % 3]], &q = mesh.points[t[(k + 2) % 3]];
    const double share = (static_cast<double>(p[0]) - u) * (q[1] - v) - (static_cast<double>(p[1]) - v) * (q[0] - u);
    sum += share * mesh.points[t[k]][2];
    area += share;
  }
  return sum / area * mesh.height_step;
}

}  // namespace

std::optional<double> plan_height_m(const Terrain& terrain, int level, std::int64_t column, std::int64_t row) {
  const std::int64_t side = terrain.lattice().tile_units(level);
  const std::int32_t across = proto::tiles_across(level);
  // On a common side either tile may be the one that has data there.
  for (const std::int64_t y : {row / side, (row + side - 1) / side - 1}) {
    for (const std::int64_t x : {column / side, (column + side - 1) / side - 1}) {
      if (y < 0 || y >= proto::tiles_up(level)) continue;
      const auto mesh = terrain.mesh({level, static_cast<std::int32_t>((x + across) % across), static_cast<std::int32_t>(y)});
      if (!mesh) continue;
      const auto height_m =
          height_in(*mesh, static_cast<std::int32_t>(column - x * side), static_cast<std::int32_t>(row - y * side));
      if (height_m) return height_m;
    }
  }
  return std::nullopt;
}

QuantizedLevel quantized_level(const proto::Manifest& manifest, int z, double room_m) {
  QuantizedLevel out{z, proto::kHeightStep_m, kMostSeaCells};
  double low_m = -kSea_m, high_m = kSea_m;
  for (const proto::LevelSummary& level : manifest.levels()) {
    // Levels without meshes take their heights from the coarsest that has some.
    const auto at = static_cast<int>(level.level());
    if (at != std::max(z, static_cast<int>(manifest.min_level()))) continue;
    low_m = std::min(low_m, level.min_height() - room_m);
    high_m = std::max(high_m, level.max_height() + room_m);
    out.stored = at == z;
    if (out.stored) out.sea_cells = sea_cells(z, std::max(level.target(), proto::kHeightStep_m));
  }
  while ((high_m - low_m) / out.step_m > kMostQuanta - 2) out.step_m *= 2;
  if (room_m > 0) {
    out.low_m = low_m;
    out.high_m = high_m;
  }
  return out;
}

double sea_level_m(const Terrain& terrain, double longitude_deg, double latitude_deg) {
  const auto found = terrain.undulation_m(longitude_deg, latitude_deg);
  return found.ok() ? std::clamp(*found, -kSea_m, kSea_m) : 0;
}

}  // namespace cordillera::pipeline::faces
