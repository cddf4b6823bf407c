#include "pipeline/faces/mercator/mercator_grid.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/faces/mesh_pixels.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/store/levels_shown.h"
#include "proto/degrees.h"

namespace cordillera::pipeline::faces {
namespace {

// Far finer than the 32767ths of the format: what is rounded twice is nowhere rounded worse than once.
constexpr std::int32_t kLeastSide = 1 << 22;

}  // namespace

std::int32_t MercatorGrid::side(int z) const { return mercator_side(terrain(), z, kLeastSide); }

QuantizedLevel MercatorGrid::quantized(int z) const {
  const proto::LevelSummary* const summary = summary_of(terrain().manifest(), level(z));
  const double room_m = summary != nullptr ? std::ceil(summary->stated_max_error()) + 1 : 1;
  return quantized_level(terrain().manifest(), level(z), room_m);
}

std::shared_ptr<const MeshIndex> MercatorGrid::mesh(const proto::TileAddress& tile) const {
  const auto [found, fresh] = meshes_.try_emplace(tile);
  if (!fresh) return found->second;
  const MercatorMesh cut = mercator_mesh(terrain(), tile, MercatorNormals::none);
  if (!cut.triangles.empty()) {
    found->second = std::make_shared<const MeshIndex>(on_lattice(cut, tile, MercatorRows::latitude, side(tile.z)).mesh);
  }
  return found->second;
}

std::vector<proto::Vec3> MercatorGrid::normals(const proto::TileAddress& tile) const {
  const MercatorMesh cut = mercator_mesh(terrain(), tile, MercatorNormals::all);
  std::vector<proto::Vec3> out;
  for (const std::uint32_t vertex : on_lattice(cut, tile, MercatorRows::latitude, side(tile.z)).source)
    out.push_back(cut.vertices[vertex].normal);
  return out;
}

TileAngles MercatorGrid::angles(const proto::TileAddress& tile) const {
  const double width = 2 * std::numbers::pi / std::ldexp(1, tile.z);
  const double south = mercator_latitude_deg(tile.z, tile.y) * proto::kDegree,
               north = mercator_latitude_deg(tile.z, tile.y + 1) * proto::kDegree;
  return {tile.x * width - std::numbers::pi, south, width, north - south};
}

/// A point of a common side has one place, whichever tile asks.
MercatorGrid::Place MercatorGrid::place(const proto::TileAddress& tile, const Units& units) const {
  const double all = side(tile.z), south = mercator_latitude_deg(tile.z, tile.y),
               north = mercator_latitude_deg(tile.z, tile.y + 1);
  const double longitude = (tile.x + units[0] / all) * 360 / std::ldexp(1, tile.z) - 180;
  const double latitude = units[1] == side(tile.z) ? north : south + (north - south) * (units[1] / all);
  return {longitude < 180 ? longitude : longitude - 360, latitude};
}

double MercatorGrid::beside_m(const proto::TileAddress& tile, const Units& units, const QuantizedLevel& level) const {
  const Place at = place(tile, units);
  if (!level.stored) {
    const proto::Lattice lattice = terrain().lattice();
    const double cells_a_degree = 1 / lattice.cell_deg();
    const auto coarsest = static_cast<int>(terrain().manifest().min_level());
    const std::int64_t column = std::llround((at.longitude_deg + 180) * cells_a_degree),
                       row = std::llround((at.latitude_deg + 90) * cells_a_degree);
    if (const auto height_m = plan_height_m(terrain(), coarsest, column % lattice.columns(), row)) return *height_m;
  }
  return sea_level_m(terrain(), at.longitude_deg, at.latitude_deg);
}

proto::Vec3 MercatorGrid::up_at(const proto::TileAddress& tile, const Units& units) const {
  const Place at = place(tile, units);
  return proto::normal(row_frame_at(at.latitude_deg), column_frame_at(at.longitude_deg));
}

/// The pixels of the dataset's own masks that hold the centres of this one's.
WaterPixels MercatorGrid::water(const proto::TileAddress& tile) const {
  const int level = mercator_level(tile.z);
  const std::int32_t first = tile.z == 0 ? 0 : tile.x, tiles = tile.z == 0 ? 2 : 1;
  const double south = mercator_latitude_deg(tile.z, tile.y), north = mercator_latitude_deg(tile.z, tile.y + 1);
  const double rows_a_degree = proto::tiles_up(level) * kWaterSide / 180.0;
  std::map<proto::TileAddress, WaterPixels> masks;
  WaterPixels out;
  for (int r = 0; r < kWaterSide; ++r) {
    const double latitude = north + (south - north) * (r + 0.5) / kWaterSide;
    const auto row = static_cast<std::int32_t>((latitude + 90) * rows_a_degree);
    const int from_north = kWaterSide - 1 - row % kWaterSide;
    for (int c = 0; c < kWaterSide; ++c) {
      const int column = c * tiles + tiles / 2;
      const proto::TileAddress own{level, first + column / kWaterSide, row / kWaterSide};
      const auto [mask, fresh] = masks.try_emplace(own);
      if (fresh) mask->second = unpack_water(terrain().store().water(own));
      if (mask->second.empty()) continue;
      if (out.empty()) out.assign(std::size_t{kWaterSide} * kWaterSide, 0);
      out[static_cast<std::size_t>(r * kWaterSide + c)] =
          mask->second[static_cast<std::size_t>(from_north * kWaterSide + column % kWaterSide)];
    }
  }
  return out;
}

std::vector<MeshGrid::Under> MercatorGrid::under(int z, const TileRange& range) const {
  const int at = level(z);
  const double rows_a_degree = proto::tiles_up(at) / 180.0;
  const double south_deg = mercator_latitude_deg(z, range.start_y), north_deg = mercator_latitude_deg(z, range.end_y + 1);
  const auto south = static_cast<std::int32_t>((south_deg + 90) * rows_a_degree);
  const auto north = static_cast<std::int32_t>((north_deg + 90) * rows_a_degree);
  const int wide = z == 0 ? 1 : 0;
  std::vector<Under> out;
  for (const TileExtent& node : terrain().store().extents(at, range.start_x << wide, south, (range.end_x << wide) + wide,
                                                          std::min(north, proto::tiles_up(at) - 1))) {
    // Towards the poles a node is many rows of the map high, and its data may lie in others.
    const bool lies_in = node.region[1] <= north_deg * proto::kDegree && node.region[3] >= south_deg * proto::kDegree;
    if (lies_in) out.push_back({node.tile.x >> wide});
  }
  return out;
}

double MercatorGrid::rows_to(int z, double latitude_deg) const {
  const double latitude = std::clamp(latitude_deg, -kMercatorEnd_deg, kMercatorEnd_deg);
  return std::ldexp(1, z) - latitude_pixel(z, latitude) / kTilePixels;
}

}  // namespace cordillera::pipeline::faces
