#include "pipeline/faces/tiles_3d/normal_map.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include "pipeline/encode/encode.h"
#include "pipeline/faces/tiles_3d/lattice_heights.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {
namespace {

using proto::Vec3;

/// How much finer the meshes are. tests/bench/normals has what more and less come to.
constexpr int kFiner_levels = 3;
/// Rings around the surface that get its normals: rims of two levels differ by a cell or so, and clients mix neighbouring pixels.
constexpr int kRings = 2;
/// Of the surroundings on each side: what the outermost ring of a pixel on the side depends on.
constexpr std::int32_t kMargin = kRings + 1;
constexpr auto kPixels = static_cast<std::int32_t>(kNormalMapSide);
constexpr std::int32_t kSide = kPixels + 2 * kMargin;

using Normals2D = std::vector<std::optional<Vec3>>;  // in east, north and up; by row from the north, then column
std::size_t index(std::int32_t row, std::int32_t column) { return static_cast<std::size_t>(row) * kSide + static_cast<std::size_t>(column); }

LatticeWindow window_of(const proto::Lattice& lattice, const proto::TileAddress& tile) {
  const std::int64_t step = lattice.cell_units(tile.z);
  return {lattice.west(tile) - kMargin * step, lattice.south(tile) + (proto::kTileCells + kMargin) * step, step, kSide, kSide, {}};
}

std::optional<Vec3> scaled(const Vec3& v) {
  const double most = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return most > 0 ? std::optional((1 / most) * v) : std::nullopt;
}

/// Central differences in space, so that the earth's curvature counts; on one side only where the other has no data.
class Surface {
 public:
  explicit Surface(const LatticeWindow& window) : window_(window) {}

  std::optional<Vec3> normal(std::int32_t row, std::int32_t column) const {
    if (!has(row, column)) return std::nullopt;
    const auto along = [&](std::int32_t dr, std::int32_t dc) {
      const Vec3 ahead = point(row + dr, column + dc, row, column), behind = point(row - dr, column - dc, row, column);
      return ahead - behind;
    };
    const proto::RowFrame& r = window_.row_frames[static_cast<std::size_t>(row)];
    const proto::ColumnFrame& c = window_.column_frames[static_cast<std::size_t>(column)];
    const Vec3 across = proto::cross(along(0, 1), along(-1, 0));
    const Vec3 up = proto::normal(r, c), east{-c.sin_lon, c.cos_lon, 0};
    return scaled({dot(across, east), dot(across, proto::cross(up, east)), dot(across, up)});
  }

 private:
  bool has(std::int32_t row, std::int32_t column) const {
    return row >= 0 && row < window_.rows && column >= 0 && column < window_.columns && !std::isnan(window_.at(row, column));
  }
  /// Of a neighbour; where it has no data, of the pixel itself.
  Vec3 point(std::int32_t row, std::int32_t column, std::int32_t own_row, std::int32_t own_column) const {
    if (!has(row, column)) return point(own_row, own_column);
    return point(row, column);
  }
  Vec3 point(std::int32_t row, std::int32_t column) const {
    return proto::ecef(window_.row_frames[static_cast<std::size_t>(row)], window_.column_frames[static_cast<std::size_t>(column)], window_.at(row, column));
  }
  const LatticeWindow& window_;
};

/// The mean of the eight around.
Vec3 around(const Normals2D& normals, std::int32_t row, std::int32_t column) {
  Vec3 sum;
  for (std::int32_t r = std::max(row - 1, 0); r <= std::min(row + 1, kSide - 1); ++r) {
    for (std::int32_t c = std::max(column - 1, 0); c <= std::min(column + 1, kSide - 1); ++c) {
      if (const auto& n = normals[index(r, c)]) sum = sum + *n;
    }
  }
  return sum;
}

void add_ring(Normals2D& normals) {
  const Normals2D before = normals;
  for (std::int32_t r = 0; r < kSide; ++r) {
    for (std::int32_t c = 0; c < kSide; ++c) {
      if (!before[index(r, c)]) normals[index(r, c)] = scaled(around(before, r, c));
    }
  }
}

/// -1 to 1 in a byte. No byte is zero. What is nearly zero gets the one next above it: roundings alone would choose between the two, and level
/// ground would be speckled.
std::uint8_t byte_of(double v) {
  constexpr double kSteps = 127.5, kLevel = 0.25 / kSteps;
  if (std::abs(v) < kLevel) return 128;
  return static_cast<std::uint8_t>(std::nearbyint(kSteps + kSteps * v));
}

}  // namespace

std::vector<std::uint8_t> normal_map(const Terrain& terrain, const proto::TileAddress& tile) {
  LatticeWindow window = window_of(terrain.lattice(), tile);
  // While a dataset is being built, what is finer may go or come.
  const int finer = terrain.manifest().provisional() ? 0 : kFiner_levels;
  draw_lattice(terrain, std::min(tile.z + finer, static_cast<int>(terrain.manifest().max_level())), window);
  const Surface surface(window);
  Normals2D normals;
  normals.reserve(static_cast<std::size_t>(kSide) * kSide);
  for (std::int32_t r = 0; r < kSide; ++r) {
    for (std::int32_t c = 0; c < kSide; ++c) normals.push_back(surface.normal(r, c));
  }
  for (int ring = 0; ring < kRings; ++ring) add_ring(normals);
  std::vector<std::uint8_t> out;
  out.reserve(std::size_t{3} * kNormalMapSide * kNormalMapSide);
  for (std::int32_t r = 0; r < kPixels; ++r) {
    for (std::int32_t c = 0; c < kPixels; ++c) {
      const Vec3 n = normals[index(r + kMargin, c + kMargin)].value_or(Vec3{0, 0, 1});
      for (const double v : {n.x, n.y, n.z}) out.push_back(byte_of(v));
    }
  }
  return out;
}

}  // namespace cordillera::pipeline::faces
