#include "pipeline/faces/tiles_3d/normal_map.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/encode/encode.h"
#include "pipeline/faces/tiles_3d/lattice_heights.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {
namespace {

using proto::Vec3;

/// Rings around the surface that get its normals: rims of two levels differ by a cell or so, and clients mix neighbouring pixels.
constexpr int kRings = 2;
/// Pixels of the surroundings on each side: what the outermost ring of a pixel on the side depends on.
constexpr std::int32_t kAround = kRings;
constexpr auto kPixels = static_cast<std::int32_t>(kNormalMapSide);
constexpr std::int32_t kSide = kPixels + 2 * kAround;
/// Heights are half a pixel apart, and go half a pixel further on each side.
constexpr std::int32_t kHeights = 2 * kSide + 1;

using PixelNormals = std::vector<std::optional<Vec3>>;  // in east, north and up; by row from the north, then column
std::size_t index(std::int32_t row, std::int32_t column) {
  return static_cast<std::size_t>(row) * kSide + static_cast<std::size_t>(column);
}

LatticeWindow window_of(const proto::Lattice& half, const proto::TileAddress& tile) {
  const std::int64_t step = half.cell_units(tile.z) / 2, beyond = 2 * kAround + 1;
  return {
      half.west(tile) - beyond * step, half.south(tile) + half.tile_units(tile.z) + beyond * step, step, kHeights, kHeights, {}};
}

std::optional<Vec3> scaled(const Vec3& v) {
  const double most = std::max({std::abs(v.x), std::abs(v.y), std::abs(v.z)});
  return most > 0 ? std::optional((1 / most) * v) : std::nullopt;
}

/// Slopes of the eight heights around a pixel's own, half a pixel away, by the method of Horn (1981) as gradient.h has it, in
/// space: the earth's curvature counts. A neighbour without data counts as the pixel itself.
class PictureSurface {
 public:
  explicit PictureSurface(const LatticeWindow& window) : window_(window) {}

  std::optional<Vec3> normal(std::int32_t pixel_row, std::int32_t pixel_column) const {
    const std::int32_t row = 2 * pixel_row + 1, column = 2 * pixel_column + 1;
    if (std::isnan(window_.at(row, column))) return std::nullopt;
    const proto::RowFrame& r = window_.row_frames[static_cast<std::size_t>(row)];
    const proto::ColumnFrame& c = window_.column_frames[static_cast<std::size_t>(column)];
    const Vec3 own = proto::ecef(r, c, window_.at(row, column));
    const auto at = [&](std::int32_t dr, std::int32_t dc) {
      const double height_m = window_.at(row + dr, column + dc);
      if (std::isnan(height_m)) return Vec3{};
      return proto::ecef(window_.row_frames[static_cast<std::size_t>(row + dr)],
                         window_.column_frames[static_cast<std::size_t>(column + dc)], height_m) -
             own;
    };
    const Vec3 north_west = at(-1, -1), north_east = at(-1, 1), south_west = at(1, -1), south_east = at(1, 1);
    const Vec3 eastward = north_east + 2 * at(0, 1) + south_east - north_west - 2 * at(0, -1) - south_west;
    const Vec3 northward = north_west + 2 * at(-1, 0) + north_east - south_west - 2 * at(1, 0) - south_east;
    const Vec3 across = proto::cross(eastward, northward);
    const Vec3 up = proto::normal(r, c), east{-c.sin_lon, c.cos_lon, 0};
    return scaled({dot(across, east), dot(across, proto::cross(up, east)), dot(across, up)});
  }

 private:
  const LatticeWindow& window_;
};

/// The mean of the eight around.
Vec3 around(const PixelNormals& normals, std::int32_t row, std::int32_t column) {
  Vec3 sum;
  for (std::int32_t r = std::max(row - 1, 0); r <= std::min(row + 1, kSide - 1); ++r) {
    for (std::int32_t c = std::max(column - 1, 0); c <= std::min(column + 1, kSide - 1); ++c) {
      if (const auto& n = normals[index(r, c)]) sum = sum + *n;
    }
  }
  return sum;
}

void add_ring(PixelNormals& normals) {
  const PixelNormals before = normals;
  for (std::int32_t r = 0; r < kSide; ++r) {
    for (std::int32_t c = 0; c < kSide; ++c) {
      if (!before[index(r, c)]) normals[index(r, c)] = scaled(around(before, r, c));
    }
  }
}

/// -1 to 1 in a byte. No byte is zero. What is nearly zero gets the one next above it: roundings alone would choose between the
/// two, and level ground would be speckled.
std::uint8_t byte_of(double v) {
  constexpr double kSteps = 127.5, kLevel = 0.25 / kSteps;
  if (std::abs(v) < kLevel) return 128;
  return static_cast<std::uint8_t>(std::nearbyint(kSteps + kSteps * v));
}

}  // namespace

std::vector<std::uint8_t> normal_map(const Terrain& terrain, const proto::TileAddress& tile, int finer_levels) {
  LatticeWindow window = window_of(half_lattice(terrain), tile);
  // While a dataset is being built, what is finer may go or come.
  const int finer = terrain.manifest().provisional() ? 0 : finer_levels;
  draw_lattice(terrain, std::min(tile.z + finer, static_cast<int>(terrain.manifest().max_level())), window);
  const PictureSurface surface(window);
  PixelNormals normals;
  normals.reserve(static_cast<std::size_t>(kSide) * kSide);
  for (std::int32_t r = 0; r < kSide; ++r) {
    for (std::int32_t c = 0; c < kSide; ++c) normals.push_back(surface.normal(r, c));
  }
  for (int ring = 0; ring < kRings; ++ring) add_ring(normals);
  std::vector<std::uint8_t> out;
  out.reserve(std::size_t{3} * kNormalMapSide * kNormalMapSide);
  for (std::int32_t r = 0; r < kPixels; ++r) {
    for (std::int32_t c = 0; c < kPixels; ++c) {
      const Vec3 n = normals[index(r + kAround, c + kAround)].value_or(Vec3{0, 0, 1});
      for (const double v : {n.x, n.y, n.z}) out.push_back(byte_of(v));
    }
  }
  return out;
}

}  // namespace cordillera::pipeline::faces
