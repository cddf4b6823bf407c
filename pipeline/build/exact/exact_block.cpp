#include "pipeline/build/exact/exact_block.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "gpu/exact/ground.h"
#include "gpu/exact/side_chain.h"
#include "gpu/measure/upright.h"
#include "pipeline/build/exact/joined_mesh.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/ecef_step.h"
#include "pipeline/plan/plan.h"
#include "pipeline/tile/tile_error.h"
#include "proto/ellipsoid.h"
#include "proto/integers.h"

namespace cordillera::pipeline {
namespace {

using gpu::exact::kSideReach;
using gpu::exact::SideKind;

constexpr double kMostTolerance_m = 16384;  // see gpu::exact::BlockLevel
constexpr int kRimShare = 64;               // of the data's narrow side, for what rims may move

using proto::floor_divide;

/// From line to line of tiles, at least one tile; first and last are within 0 .. size.
std::pair<std::int64_t, std::int64_t> to_tile_lines(std::int64_t first, std::int64_t last, std::int64_t size) {
  constexpr std::int64_t kTile = proto::kTileCells;
  const std::int64_t from = std::min(first / kTile, size / kTile - 1) * kTile;
  return {from, std::max((last + kTile - 1) / kTile * kTile, from + kTile)};
}

/// The rectangle alone; west > east: the node has no part of the window.
BlockPlace rectangle_of(const proto::Plan& plan, const proto::TileAddress& node) {
  const proto::Lattice lattice = lattice_of(plan);
  const raster::Source::Window window = node_window(plan, node);
  BlockPlace place;
  if (window.west > window.east || window.south > window.north) {
    place.west = 1;
    return place;
  }
  const std::int64_t units = lattice.tile_units(node.z), south = lattice.south(node);
  std::int64_t west = lattice.west(node);  // of the node, on the turn that the window is on
  west += floor_divide(window.west - west, lattice.columns()) * lattice.columns();
  const auto columns = to_tile_lines(window.west - west, window.east - west, units),
             rows = to_tile_lines(window.south - south, window.north - south, units);
  place.west = west + columns.first, place.east = west + columns.second;
  place.south = south + rows.first, place.north = south + rows.second;
  return place;
}

/// The same, but for data that ends on a side of the node: no triangle of it lies there. A raster that is a line has none
/// anywhere.
BlockPlace rectangle_with_area(const proto::Plan& plan, const proto::TileAddress& node) {
  const raster::Source::Window window = node_window(plan, node);
  const bool only_touches = (window.west == window.east && plan.window(0) < plan.window(2)) ||
                            (window.south == window.north && plan.window(1) < plan.window(3));
  return only_touches ? BlockPlace{1} : rectangle_of(plan, node);
}

/// On the turn that the rectangle is on.
BlockPlace whole_node(const proto::Plan& plan, const proto::TileAddress& node, const BlockPlace& rectangle) {
  const proto::Lattice lattice = lattice_of(plan);
  const std::int64_t units = lattice.tile_units(node.z), west = lattice.west(node);
  BlockPlace place;
  place.west = west + floor_divide(rectangle.west - west, lattice.columns()) * lattice.columns();
  place.south = lattice.south(node);
  place.east = place.west + units;
  place.north = place.south + units;
  place.sides.fill(SideKind::shared);
  place.merged_above = true;
  return place;
}

std::int64_t narrow_side(const proto::Plan& plan) { return std::min(columns_of(plan), rows_of(plan)); }

bool is_on(std::int64_t line, std::int64_t other, std::int64_t circle) { return (line - other) % circle == 0; }

}  // namespace

raster::Source::Window BlockPlace::window() const {
  return {west - kSideReach, south - kSideReach, east + kSideReach, north + kSideReach};
}

proto::Samples BlockPlace::empty_samples() const { return raster::void_samples(window()); }

BlockPlace place_alone(const proto::Plan& plan, const proto::TileAddress& node) { return rectangle_of(plan, node); }

BlockPlace place_of_block(const proto::Plan& plan, const proto::TileAddress& node) {
  const auto exists = [](const BlockPlace& other) { return other.west <= other.east; };
  if (has_levels_above(plan)) {
    const BlockPlace rectangle = rectangle_of(plan, node);
    return exists(rectangle) ? whole_node(plan, node, rectangle) : rectangle;
  }
  BlockPlace place = rectangle_with_area(plan, node);
  const std::int64_t circle = lattice_of(plan).columns();
  const std::int32_t across = proto::tiles_across(node.z), up = proto::tiles_up(node.z);
  const auto beside = [&](std::int32_t dx, std::int32_t dy) {
    return rectangle_with_area(plan, {node.z, (node.x + dx + across) % across, node.y + dy});
  };
  const auto share = [&](gpu::exact::Side side, bool shared) { place.sides[side] = shared ? SideKind::shared : SideKind::outer; };
  const BlockPlace east = beside(1, 0), west = beside(-1, 0);
  share(gpu::exact::kEast, exists(east) && is_on(place.east, east.west, circle));
  share(gpu::exact::kWest, exists(west) && is_on(place.west, west.east, circle));
  if (node.y > 0) {
    const BlockPlace south = beside(0, -1);
    share(gpu::exact::kSouth, exists(south) && south.north == place.south);
  }
  if (node.y + 1 < up) {
    const BlockPlace north = beside(0, 1);
    share(gpu::exact::kNorth, exists(north) && north.south == place.north);
  }
  return place;
}

namespace {

/// Between the ends of a chord its middle is nearer to the pole than the parallel, by tan(lat) / 8 of the square of its width (an
/// angle on the ground); a chord that rises from row to row is beside its line by up to tan(lat) / 4 of width times height. A
/// sample between the two may be shown by the next triangle, whose slope is another one: so more than that. A hundredth of
/// the next row stands for a pole's own.
gpu::exact::CurveRow curve_row(const proto::RowFrame& row, double cell_rad, double half_squared) {
  constexpr double kShare = 3.0 / 8;
  const double least = cell_rad / 100;
  return {static_cast<float>(row.radius_m * row.cos_lat * half_squared),
          static_cast<float>(kShare * cell_rad * std::abs(row.sin_lat) / std::max(row.cos_lat, least)),
          static_cast<float>(row.cos_lat < least ? 0 : row.cos_lat)};
}

}  // namespace

BlockCurve curve_of(const proto::Plan& plan, const BlockPlace& place) {
  // A parallel of radius r = N cos(lat) leaves its tangent by the square of the way over 2 r, of which cos(lat) is upright.
  const proto::Lattice lattice = lattice_of(plan);
  const double cell_rad = lattice.cell_deg() * std::numbers::pi / 180,
               half_squared = cell_rad * cell_rad / 2 / proto::kHeightStep_m;
  BlockCurve curve;
  for (const proto::RowFrame& row :
       proto::row_frames(lattice, place.south, static_cast<std::size_t>(place.north - place.south + 1))) {
    const std::int64_t at = place.south + static_cast<std::int64_t>(curve.rows.size());
    curve.rows.push_back(curve_row(row, cell_rad, half_squared));
    curve.rows.back().to_pole = static_cast<std::int32_t>(std::min({at, lattice.rows() - at, std::int64_t{INT32_MAX}}));
  }
  curve.up = static_cast<float>(proto::kSemiMajor_m * half_squared);
  return curve;
}

gpu::exact::Block block_at(const proto::Plan& plan, const BlockPlace& place, const proto::Samples& samples,
                           const BlockCurve& curve) {
  gpu::exact::Block block;
  block.samples = &samples;
  block.west = place.west, block.south = place.south;
  block.columns = static_cast<std::int32_t>(place.east - place.west + 1);
  block.rows = static_cast<std::int32_t>(place.north - place.south + 1);
  block.sides = place.sides;
  block.curve = curve.rows;
  block.curve_up = curve.up;
  block.sample_m = sample_m(plan);
  return block;
}

int most_rim_reach(const proto::Plan& plan) {
  return std::clamp(std::ilogb(static_cast<double>(narrow_side(plan)) / kRimShare), -1, gpu::exact::kMostRimReach);
}

double sample_m(const proto::Plan& plan) {
  const proto::Lattice lattice = lattice_of(plan);
  return proto::cell_height_m(lattice, lattice.rows() / 2);
}

gpu::exact::BlockPlan levels_of_block(const proto::Plan& plan, int coarsest) {
  const std::string& quality = plan.options().quality();
  gpu::exact::BlockPlan levels;
  levels.tile_side = proto::kTileCells;
  levels.measured = false;  // tiles are, as they will be decoded
  levels.quality = quality == "fast"   ? gpu::exact::Quality::fast
                   : quality == "best" ? gpu::exact::Quality::best
                                       : gpu::exact::Quality::standard;
  // One cell of the level, but at the finest level all data is there; small data keeps its outline, however coarse the level.
  const int most_reach = most_rim_reach(plan);
  for (int l = static_cast<int>(plan.finest_level()); l >= coarsest; --l) {
    const proto::LevelPlan& level = level_plan(plan, l);
    gpu::exact::BlockLevel asked;
    // Where somebody asks for less than a float32 can tell, rounding takes all of it: half is left, and the error is stated as it
    // is.
    const double target_m = std::min(level.target(), kMostTolerance_m);
    asked.tolerance_m = std::max(target_m - gpu::kGrace_m - usual_step_m(plan, level), target_m / 2);
    asked.height_step = height_step(level);
    constexpr double kBoth = 3.5;  // corners move by up to half of a cube's diagonal; the area by that times twice the length
    asked.rounding_m = kBoth * usual_step_m(plan, level);
    if (!levels.levels.empty())
      asked.tolerance_m = std::max(asked.tolerance_m, least_tolerance_m(levels.levels.back(), asked.height_step));
    asked.rim_reach = levels.levels.empty() ? -1 : std::min(static_cast<int>(levels.levels.size()), most_reach);
    levels.levels.push_back(asked);
  }
  return levels;
}

gpu::exact::BlockPlan levels_of_block(const proto::Plan& plan, int coarsest, const BlockPlace& place,
                                      const proto::Samples& samples) {
  gpu::exact::BlockPlan levels = levels_of_block(plan, coarsest);
  const bool is_all = !has_levels_above(plan) && std::ranges::count(place.sides, SideKind::shared) == 0;
  if (is_all) keep_narrow_data(places_of_data(samples), 0, levels);
  return levels;
}

void keep_narrow_data(const gpu::exact::Ground& all, int least, gpu::exact::BlockPlan& levels) {
  const int reach = gpu::exact::reach_of_narrow_data(all, least, levels.levels.back().rim_reach);
  for (gpu::exact::BlockLevel& level : levels.levels) level.rim_reach = std::min(level.rim_reach, reach);
}

gpu::exact::Ground places_of_data(const proto::Samples& samples) {
  gpu::exact::Ground ground;
  ground.columns = samples.columns, ground.rows = samples.rows;
  ground.squares.depth.assign(ground.across() * ground.up(), gpu::exact::void_depth(gpu::exact::kFarthest));
  for (std::int32_t y = 0; y < samples.rows; ++y) {
    const std::int32_t* const row =
        samples.height.data() + static_cast<std::size_t>(y) * static_cast<std::size_t>(samples.columns);
    gpu::exact::Depth* const squares = ground.squares.depth.data() + static_cast<std::size_t>(y / 8) * ground.across();
    for (std::int32_t x = 0; x < samples.columns; ++x) {
      if (row[x] != proto::kNoHeight) squares[x / 8] = gpu::exact::valid_depth(gpu::exact::kFarthest);
    }
  }
  return ground;
}

namespace {

/// Triangles of a tile, and the greatest bound of them.
struct TileTriangles {
  std::vector<std::uint32_t> all;
  float bound = 0;
};

}  // namespace

proto::TileMesh tile_mesh_of_block(const gpu::exact::BlockMesh& mesh, std::int32_t side) {
  proto::TileMesh tile;
  tile.side = side;
  tile.x.assign(mesh.x.begin(), mesh.x.end());
  tile.y.assign(mesh.y.begin(), mesh.y.end());
  tile.height = mesh.height;
  for (const std::uint8_t is_void : mesh.is_void) tile.mark.push_back(is_void ? proto::kVoid : 0);
  tile.triangles = mesh.triangles;
  return tile;
}

std::vector<BuiltTile> tiles_of_block(const proto::Plan& plan, const BlockPlace& place, int z, const gpu::exact::BlockMesh& mesh,
                                      TileParts parts) {
  const proto::Lattice lattice = lattice_of(plan);
  const std::int64_t units = lattice.tile_units(z);
  const std::int64_t west = floor_divide(place.west, units), south = floor_divide(place.south, units),
                     columns = floor_divide(place.east - 1, units) - west + 1,
                     rows = floor_divide(place.north - 1, units) - south + 1;
  std::vector<TileTriangles> by_tile(static_cast<std::size_t>(columns * rows));  // row by row from the south
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& triangle = mesh.triangles[t];
    if (parts == TileParts::published && !is_published(mesh, triangle)) continue;
    const std::int64_t x = std::min({mesh.x[triangle[0]], mesh.x[triangle[1]], mesh.x[triangle[2]]}),
                       y = std::min({mesh.y[triangle[0]], mesh.y[triangle[1]], mesh.y[triangle[2]]});
    TileTriangles& of_tile = by_tile[static_cast<std::size_t>((floor_divide(place.south + y, units) - south) * columns +
                                                              floor_divide(place.west + x, units) - west)];
    of_tile.all.push_back(t);
    if (!mesh.bound.empty()) of_tile.bound = std::max(of_tile.bound, mesh.bound[t]);
  }
  std::vector<BuiltTile> tiles;
  MeshParts cut(mesh);
  for (std::size_t k = 0; k < by_tile.size(); ++k) {
    if (by_tile[k].all.empty()) continue;
    const std::int64_t across = proto::tiles_across(z), row = south + static_cast<std::int64_t>(k) / columns,
                       column = west + static_cast<std::int64_t>(k) % columns;
    BuiltTile tile;
    tile.tile = {z, static_cast<std::int32_t>(column - floor_divide(column, across) * across), static_cast<std::int32_t>(row)};
    tile.max_error_m = by_tile[k].bound * proto::kHeightStep_m;
    std::vector<std::uint32_t> vertices = cut.vertices_of(by_tile[k].all);
    std::sort(vertices.begin(), vertices.end());
    tile.mesh = cut.part(vertices, by_tile[k].all, place.west - column * units, place.south - row * units);
    tile.mesh.side = static_cast<std::int32_t>(units);
    tiles.push_back(std::move(tile));
  }
  std::sort(tiles.begin(), tiles.end(),
            [](const BuiltTile& a, const BuiltTile& b) { return std::pair(a.tile.y, a.tile.x) < std::pair(b.tile.y, b.tile.x); });
  return tiles;
}

double measure_exact(const LevelContext& context, BuiltTile& tile, gpu::SurfaceMemory& memory) {
  const double limit_m = limit_of(context, tile.tile);
  tile.measured = gpu::surface_error(surface_input(context, tile), limit_m, memory);
  tile.max_error_m = tile.measured.max_m + gpu::kGrace_m;
  const gpu::Upright upright({context.lattice, tile.tile, tile.mesh.side, ecef_steps(*context.level)});
  // Steep walls meet rounded points, and needles the earth's curve: vertices go in there, away from the tile's sides.
  if (context.put_back && (!tile.measured.over_limit.empty() || !gpu::turned_triangles(upright, tile.mesh).empty()))
    measure(context, tile, memory);
  return std::max(0.0, tile.max_error_m - gpu::kGrace_m - limit_m);
}

}  // namespace cordillera::pipeline
