#include "pipeline/faces/quantized_mesh/terrain_tileset_subtree.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "pipeline/encode/little_endian.h"
#include "pipeline/faces/quantized_mesh/quantized_mesh_bounds.h"
#include "pipeline/tileset/subtree_file.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr int kLevels = kTerrainSubtreeLevels;

/// The node at a place of the Morton order of a depth.
proto::TileAddress node(const proto::TileAddress& root, int depth, std::uint32_t place) {
  std::int32_t x = 0, y = 0;
  for (int bit = 0; bit < depth; ++bit) {
    x |= static_cast<std::int32_t>(place >> (2 * bit) & 1) << bit;
    y |= static_cast<std::int32_t>(place >> (2 * bit + 1) & 1) << bit;
  }
  return {root.z + depth, (root.x << depth) + x, (root.y << depth) + y};
}

/// Heights that the surfaces of the tile and of all below it stay within, whole metres: those of the data, of the coarsest level
/// where there is no mesh, and the sea's. Regions are those of .glb tiles, whose points are rounded otherwise. A client takes a
/// tile for hidden by them before it knows its descendants.
std::array<double, 2> heights(const Terrain& terrain, const proto::TileAddress& tile) {
  double low_m = -kSea_m, high_m = kSea_m;
  const auto coarsest = terrain.manifest().min_level();
  // Half a step on each of three axes, at most; of levels without meshes that of the coarsest with some.
  const double apart_m = terrain.store().glb_step_m(std::max(tile.z, static_cast<int>(coarsest)));
  const auto include = [&](double low, double high) {
    low_m = std::min(low_m, std::floor(low - apart_m) - 1);
    high_m = std::max(high_m, std::ceil(high + apart_m) + 1);
  };
  for (const TileExtent& extent : terrain.store().extents(tile.z, tile.x, tile.y, tile.x, tile.y))
    include(extent.region[4], extent.region[5]);
  for (const proto::LevelSummary& level : terrain.manifest().levels()) {
    if (tile.z < static_cast<int>(coarsest) && level.level() == coarsest) include(level.min_height(), level.max_height());
  }
  return {low_m, high_m};
}

/// Bounds of all that may be in the tile, without making it: a grid of places at its least and greatest heights, and as much as
/// the ellipsoid rises between them.
QuantizedBounds bounds_of(const proto::TileAddress& tile, const std::array<double, 2>& heights) {
  constexpr std::int32_t kCells = 8;
  QuantizedSurface grid;
  grid.angles = geodetic_angles(tile);
  grid.step_m = 1;
  for (const double height_m : heights) {
    for (std::int32_t j = 0; j <= kCells; ++j) {
      for (std::int32_t i = 0; i <= kCells; ++i) {
        grid.vertices.push_back({kMostQuanta * i / kCells, kMostQuanta * j / kCells, static_cast<std::int32_t>(height_m), {}});
      }
    }
  }
  QuantizedBounds out = quantized_bounds(grid, positions(grid));
  const double cell = std::numbers::pi / std::ldexp(kCells, tile.z);
  out.radius_m += std::ceil((proto::kSemiMajor_m + heights[1]) * cell * cell / 4);
  return out;
}

struct SubtreeTables {
  std::string lows, highs, spheres, horizons;

  void add(const Terrain& terrain, const proto::TileAddress& tile) {
    const auto range = heights(terrain, tile);
    const QuantizedBounds bounds = bounds_of(tile, range);
    append_little_endian(lows, range[0]);
    append_little_endian(highs, range[1]);
    for (const double number : {bounds.centre.x, bounds.centre.y, bounds.centre.z, bounds.radius_m}) {
      append_little_endian(spheres, number);
    }
    for (const double number : {bounds.horizon.x, bounds.horizon.y, bounds.horizon.z}) append_little_endian(horizons, number);
  }
};

std::size_t places(int depth) { return std::size_t{1} << (2 * depth); }

}  // namespace

std::optional<std::string> terrain_subtree(const Terrain& terrain, const proto::TileAddress& root) {
  const GeodeticGrid grid(terrain);
  if (root.z % kLevels != 0 || !has_quantized_tile(grid, root)) return std::nullopt;
  AvailabilityBits tiles((places(kLevels) - 1) / 3), below(places(kLevels));
  SubtreeTables tables;
  std::size_t first = 0;  // of the depth, in the availability
  for (int depth = 0; depth <= kLevels; ++depth) {
    for (std::uint32_t place = 0; place < places(depth); ++place) {
      const proto::TileAddress tile = node(root, depth, place);
      if (!has_quantized_tile(grid, tile)) continue;
      if (depth == kLevels) {
        below.set(place);
      } else {
        tiles.set(first + place);
        tables.add(terrain, tile);
      }
    }
    first += places(depth);
  }
  SubtreeFile file;
  const Json availability = file.availability(tiles), children = file.availability(below);
  const Json properties = {{"minimum_height", {{"values", file.add(tables.lows)}}},
                           {"maximum_height", {{"values", file.add(tables.highs)}}},
                           {"bounding_sphere", {{"values", file.add(tables.spheres)}}},
                           {"horizon_occlusion_point", {{"values", file.add(tables.horizons)}}}};
  Json json;
  json["propertyTables"] = Json::array({{{"class", "tile"}, {"count", tiles.available()}, {"properties", properties}}});
  json["tileAvailability"] = availability;
  json["contentAvailability"] = Json::array({availability});
  json["childSubtreeAvailability"] = children;
  json["tileMetadata"] = 0;
  return file.bytes(json);
}

}  // namespace cordillera::pipeline::faces
