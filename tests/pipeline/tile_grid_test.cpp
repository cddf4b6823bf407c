// The regular mesh that a published algorithm begins with: sides that are given, and all samples between them.
#include "pipeline/tile/tile_grid.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>
#include <set>

#include "tests/bench/terrain.h"
#include "tests/pipeline/mesh_laws.h"

namespace cordillera::pipeline {
namespace {

const proto::Lattice kFourteen{14};
constexpr proto::TileAddress kParent{13, 8192 + 320, 6144};
constexpr std::int32_t kUnits = 512, kCell = 2;

proto::Samples samples() {
  proto::Samples samples{kFourteen.west(kParent) - 3, kFourteen.south(kParent) - 3, kUnits + 7, kUnits + 7, {}, {}};
  for (int y = 0; y < samples.rows; ++y)
    for (int x = 0; x < samples.columns; ++x)
      samples.height.push_back(std::hypot(x - 90, y - 3) < 30 ? proto::kNoHeight
                                                              : bench::terrain_height(bench::Terrain::alpine, x, y));
  return samples;
}

/// A tile that has nothing but the vertices of its sides: one in `often` of its samples there, and the corners of a rectangle
/// that is so wide and so high.
BuiltTile sides(std::int32_t wide, std::int32_t high, unsigned often) {
  BuiltTile tile;
  tile.tile = kParent;
  tile.mesh.side = kUnits;
  std::mt19937 random(7);
  for (std::int32_t y = 0; y <= high; ++y) {
    for (std::int32_t x = 0; x <= wide; ++x) {
      const bool on_meridian = x % wide == 0, on_parallel = y % high == 0;
      if (!(on_meridian || on_parallel) || (!(on_meridian && on_parallel) && random() % often != 0)) continue;
      tile.mesh.x.push_back(x);
      tile.mesh.y.push_back(y);
      tile.mesh.height.push_back(1000 + x + y);
      tile.mesh.mark.push_back(x < 50 && y == 0 ? proto::kVoid : 0);
    }
  }
  return tile;
}

using Vertices = std::set<std::array<std::int32_t, 4>>;
/// Place, height and label.
Vertices vertices(const proto::TileMesh& mesh, std::int32_t wide, std::int32_t high, bool on_border) {
  Vertices all;
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    if ((mesh.x[v] % wide == 0 || mesh.y[v] % high == 0) != on_border) continue;
    const bool none = is_void(mesh, v);
    all.insert({mesh.x[v], mesh.y[v], none ? 0 : mesh.height[v], none});
  }
  return all;
}

TEST(TileGrid, HasTheSidesThatAreGivenAndNoOthers) {
  for (const unsigned often : {1u, 2u, 5u, 40u, 1000u}) {
    const BuiltTile tile = sides(kUnits, kUnits, often);
    const proto::TileMesh grid = tile_grid(kFourteen, tile, samples(), kCell);
    SCOPED_TRACE(often);
    EXPECT_EQ(vertices(grid, kUnits, kUnits, true), vertices(tile.mesh, kUnits, kUnits, true));
    for (std::size_t v = 0; v < grid.vertices(); ++v)
      EXPECT_EQ((grid.mark[v] & proto::kKeep) != 0, grid.x[v] % kUnits == 0 || grid.y[v] % kUnits == 0);
  }
}

TEST(TileGrid, CoversTheRectangleWithFewNeighbours) {
  for (const unsigned often : {1u, 2u, 5u, 40u, 1000u, 100000u}) {
    for (const int step : {1, 2, 8, 16}) {
      const proto::TileMesh grid = tile_grid(kFourteen, sides(kUnits, kUnits, often), samples(), step);
      SCOPED_TRACE(std::to_string(often) + ", " + std::to_string(step));
      EXPECT_EQ(test::broken_law(grid), "");
      const test::Valences most = test::valences(grid);
      EXPECT_LE(most.inside, 11u);
      EXPECT_LE(most.sides, 8u);
      EXPECT_LE(most.corners, 4u);
    }
  }
}

TEST(TileGrid, HasAVertexForEveryCellAFewRowsInside) {
  const proto::Samples all = samples();
  const proto::TileMesh grid = tile_grid(kFourteen, sides(kUnits, kUnits, 1000), all, kCell);
  std::set<std::array<std::int32_t, 2>> there;
  for (std::size_t v = 0; v < grid.vertices(); ++v) {
    if (grid.mark[v] & proto::kKeep) continue;
    there.insert({grid.x[v], grid.y[v]});
    const std::int32_t height = all.at(kFourteen.west(kParent) + grid.x[v], kFourteen.south(kParent) + grid.y[v]);
    EXPECT_EQ(is_void(grid, v) ? proto::kNoHeight : grid.height[v], height);
  }
  constexpr std::int32_t kRows = 12 * kCell;  // a gap of 256 cells is halved eight times
  for (std::int32_t y = kRows; y <= kUnits - kRows; y += kCell)
    for (std::int32_t x = kRows; x <= kUnits - kRows; x += kCell) ASSERT_TRUE(there.contains({x, y})) << x << " " << y;
  EXPECT_LT(there.size(), 1.1 * kUnits * kUnits / kCell / kCell);
}

TEST(TileGrid, OfATileThatReachesBeyondItsBlockIsTheBlocksPart) {
  const proto::TileMesh grid = tile_grid(kFourteen, sides(256, kUnits, 9), samples(), kCell);
  EXPECT_EQ(*std::ranges::max_element(grid.x), 256);
  std::int64_t area = 0;
  for (const auto& t : grid.triangles) {
    ASSERT_GT(test::twice_area(grid, t), 0);
    area += test::twice_area(grid, t);
  }
  EXPECT_EQ(area, std::int64_t{2} * 256 * kUnits);
}

TEST(TileGrid, TellsAFlatSeaFromAPlane) {
  proto::TileMesh sea = tile_grid(kFourteen, sides(kUnits, kUnits, 9), samples(), kCell);
  std::ranges::fill(sea.height, 0);
  const std::vector<float> elevation = elevations(kFourteen, kParent, sea);
  const auto [least, greatest] = std::ranges::minmax_element(elevation);
  // By the square of the way from the middle to a corner over twice the radius, with the row's width taken as it is.
  const proto::RowFrame row = proto::row_frame(kFourteen, kFourteen.south(kParent) + kUnits / 2);
  const double half_m = kUnits / 2.0 * proto::cell_height_m(kFourteen, kFourteen.rows() / 2);
  const double sag_m = half_m * half_m * (1 + row.cos_lat * row.cos_lat) / (2 * proto::kSemiMajor_m);
  EXPECT_NEAR(*greatest - *least, sag_m, 0.02 * sag_m);
}

}  // namespace
}  // namespace cordillera::pipeline
