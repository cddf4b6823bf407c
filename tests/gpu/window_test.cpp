// What the driver does before and between the waves: rings of grids, the cut into windows, windows in floats and in integers.
#include <gtest/gtest.h>

#include <algorithm>
#include <numeric>
#include <set>

#include "gpu/simplify.h"
#include "gpu/waves/collapse/grid_rings.h"
#include "gpu/waves/collapse/host_team.h"
#include "gpu/waves/collapse/window_cut.h"
#include "tests/bench/pyramid/terrain.h"

namespace cordillera::gpu {
namespace {

proto::TileMesh terrain_grid(std::int32_t cells, std::int32_t step, bench::Terrain kind) {
  std::vector<std::int32_t> heights;
  for (int y = 0; y <= cells; ++y) {
    for (int x = 0; x <= cells; ++x) heights.push_back(bench::terrain_height(kind, x, y));
  }
  return grid_mesh(cells, step, heights);
}

TEST(GridRings, AreTheRingsOfTheTriangles) {
  for (const std::int32_t cells : {1, 2, 3, 16}) {
    const proto::TileMesh mesh = terrain_grid(cells, 3, bench::Terrain::plane);
    const auto rings = rings_from_triangles(mesh);
    ASSERT_TRUE(rings.ok());
    EXPECT_EQ(grid_cells(mesh), cells);
    for (std::uint32_t v = 0; v < mesh.vertices(); ++v) {
      std::uint32_t row[6];
      const auto across = static_cast<std::uint32_t>(cells + 1);
      const int valence = grid_ring(cells, static_cast<std::int32_t>(v % across), static_cast<std::int32_t>(v / across), 0, row);
      const auto ring = rings->ring(v);
      EXPECT_TRUE(std::equal(row, row + valence, ring.begin(), ring.end())) << "vertex " << v << " of " << cells << " cells";
    }
  }
}

TEST(GridRings, AnythingElseIsNoGrid) {
  const proto::TileMesh grid = terrain_grid(2, 2, bench::Terrain::plane);
  for (std::size_t t = 0; t < grid.triangles.size(); ++t) {
    for (std::size_t k = 0; k < 3; ++k) {
      proto::TileMesh mesh = grid;
      mesh.triangles[t][k] ^= 1;
      EXPECT_EQ(grid_cells(mesh), 0) << "corner " << k << " of triangle " << t;
    }
  }
  for (std::size_t v = 0; v < grid.vertices(); ++v) {
    proto::TileMesh mesh = grid;
    mesh.x[v] += 1;
    EXPECT_EQ(grid_cells(mesh), 0) << "x of " << v;
    mesh = grid;
    mesh.y[v] += 1;
    EXPECT_EQ(grid_cells(mesh), 0) << "y of " << v;
  }
  proto::TileMesh mesh = grid;
  mesh.triangles.pop_back();
  EXPECT_EQ(grid_cells(mesh), 0);
  mesh = grid;
  mesh.side = 5;
  EXPECT_EQ(grid_cells(mesh), 0);
}

/// A tile in the arrays of the driver.
struct Loaded {
  proto::TileMesh mesh;
  std::vector<float> elevation, carried, spent;
  std::vector<std::uint32_t> key, row, window;
  std::vector<std::uint16_t> local;
  std::vector<std::uint8_t> valence, mark;

  explicit Loaded(const proto::TileMesh& from) : mesh(from) {
    const auto rings = rings_from_triangles(mesh);
    EXPECT_TRUE(rings.ok());
    const std::size_t n = mesh.vertices();
    for (const std::int32_t h : mesh.height) elevation.push_back(static_cast<float>(h) / 1024);
    carried.resize(n);
    spent.resize(n);
    key.resize(n);
    window.resize(n);
    local.resize(n);
    row = rings->neighbour;
    valence = rings->valence;
    const int border = kOnSide | static_cast<int>(proto::kKeep);
    for (std::size_t v = 0; v < n; ++v) mark.push_back(static_cast<std::uint8_t>(mesh.mark[v] | (rings->open[v] ? border : 0)));
  }
  MeshView view() {
    return {mesh.x.data(), mesh.y.data(),  elevation.data(), carried.data(), spent.data(), key.data(),
            row.data(),    valence.data(), mark.data(),      window.data(),  local.data()};
  }
};

/// Simplifies the whole mesh as one window.
std::size_t simplify_all(Loaded& tile, float cells_per_unit, bool small) {
  const auto n = static_cast<std::uint32_t>(tile.mesh.vertices());
  std::vector<std::uint32_t> order(n);
  for (std::uint32_t v = 0; v < n; ++v) order[v] = v;
  std::vector<float> outer(kOuterFloats * n);
  std::vector<unsigned char> storage(window_bytes(kWindowVertices, kRowWidth));
  Rules rules;
  rules.cells_per_unit = cells_per_unit;
  rules.inverse_guard = 0.1f;
  rules.inverse_rim = 1 / (2 / cells_per_unit);
  rules.cost = 100;
  HostTeam team;
  simplify_window(team, tile.view(), {order.data(), outer.data(), n, 0, small}, rules, storage.data(), kWindowVertices);
  return static_cast<std::size_t>(std::count_if(tile.mark.begin(), tile.mark.end(), [](std::uint8_t m) { return m & kGone; }));
}

class Windows : public testing::TestWithParam<int> {};

TEST_P(Windows, FloatsAndIntegersGiveTheSameBits) {
  const proto::TileMesh mesh =
      terrain_grid(32, 128, static_cast<bench::Terrain>(GetParam()));  // 4096 units: as large as floats go
  Loaded floats(mesh), integers(mesh);
  const std::size_t gone = simplify_all(floats, 1.0f / 128, true);
  EXPECT_EQ(simplify_all(integers, 1.0f / 128, false), gone);
  EXPECT_GT(gone, mesh.vertices() / 20);
  EXPECT_EQ(floats.mark, integers.mark);
  EXPECT_EQ(floats.valence, integers.valence);
  EXPECT_EQ(floats.row, integers.row);
  EXPECT_EQ(floats.key, integers.key);
  EXPECT_EQ(floats.carried, integers.carried);
  EXPECT_EQ(floats.spent, integers.spent);
}

INSTANTIATE_TEST_SUITE_P(Terrains, Windows, testing::Values(0, 1, 3),
                         [](const auto& terrain) { return std::string(bench::kTerrainNames[terrain.param]); });

/// A plane grid, whole, and all that a cut of it writes.
struct WholeTile {
  explicit WholeTile(std::int32_t cells, std::int32_t step)
      : tile(terrain_grid(cells, step, bench::Terrain::plane)),
        n(static_cast<std::uint32_t>(tile.mesh.vertices())),
        vertices(n),
        node_of(n),
        counts(1000),
        nodes(1000) {
    std::iota(vertices.begin(), vertices.end(), 0u);
    batch_tile.side = tile.mesh.side;
  }
  CutArrays arrays() {
    return {tile.view(), {&batch_tile, 1}, vertices.data(), n, nodes.data(), node_of.data(), counts.data(), &progress, &facts};
  }

  Loaded tile;
  std::uint32_t n;
  std::vector<std::uint32_t> vertices, node_of, counts;
  std::vector<QuadNode> nodes;
  BatchTile batch_tile;
  TileProgress progress;
  CutFacts facts;
};

TEST(WindowCut, EveryVertexIsInOneWindowThatIsNotTooFull) {
  WholeTile whole(100, 7);
  const auto& [tile, n, vertices, node_of, counts, nodes, batch_tile, progress, facts] = whole;
  const CutArrays cut = whole.arrays();
  std::set<std::uint32_t> seams[3];
  for (int pass = 0; pass < 3; ++pass) {
    HostTeam team;
    CutTiles{cut, pass, false}(team);
    ASSERT_LE(facts.nodes, nodes.size());
    EXPECT_EQ(facts.in_work, n);
    std::vector<std::uint32_t> found(facts.nodes);
    for (std::uint32_t v = 0; v < n; ++v) {
      const QuadNode& node = nodes[node_of[v]];
      ++found[node_of[v]];
      EXPECT_TRUE(node.is_window());
      EXPECT_GE(tile.mesh.x[v], node.box.west);
      EXPECT_LE(tile.mesh.x[v], node.box.west + node.box.size);
      const bool inside = std::all_of(tile.row.begin() + v * kRowWidth, tile.row.begin() + v * kRowWidth + tile.valence[v],
                                      [&](std::uint32_t u) { return tile.window[u] == tile.window[v]; });
      if (!inside) seams[pass].insert(v);
    }
    for (std::uint32_t k = 0; k < facts.nodes; ++k) {
      EXPECT_EQ(counts[k], found[k]);
      EXPECT_LE(found[k], static_cast<std::uint32_t>(kWindowVertices));
    }
  }
  EXPECT_FALSE(seams[0].empty());
  for (const std::uint32_t v : seams[0])
    EXPECT_FALSE(seams[1].contains(v) && seams[2].contains(v)) << "vertex " << v << " is always at a seam";
}

TEST(WindowCut, TilesAtWhichAPassTookLittleAreLeftAlone) {
  WholeTile whole(40, 1);
  const std::uint32_t n = whole.n;
  const CutFacts& facts = whole.facts;
  CutArrays cut = whole.arrays();
  HostTeam team;
  CutTiles{cut, 0, false}(team);
  cut.count = n * 83 / 100;
  CutTiles{cut, 3, true}(team);
  EXPECT_EQ(facts.in_work, cut.count) << "more than a sixth went: goes on";
  cut.count = cut.count * 84 / 100;
  CutTiles{cut, 4, true}(team);
  EXPECT_EQ(facts.in_work, 0u);
  cut.count = n / 2;
  CutTiles{cut, 5, true}(team);
  EXPECT_EQ(facts.in_work, 0u) << "done is done";
}

}  // namespace
}  // namespace cordillera::gpu
