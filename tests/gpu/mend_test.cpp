#include "gpu/waves/border/mend.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <random>
#include <string>

#include "gpu/simplify.h"
#include "tests/pipeline/mesh_laws.h"

namespace cordillera::gpu {
namespace {

using proto::TileMesh;

constexpr ValenceCaps kWithData{kInnerValence, kSharedSideValence, kSharedCornerValence};

enum class Labels { none, holes, random };

TileMesh grid(std::int32_t cells, Labels labels, std::mt19937& random) {
  std::vector<std::int32_t> heights(static_cast<std::size_t>((cells + 1) * (cells + 1)), 0);
  for (std::size_t k = 0; k < heights.size(); ++k) {
    const std::size_t i = k % (cells + 1), j = k / (cells + 1);
    const bool hole = labels == Labels::random ? random() % 2 == 0 : labels == Labels::holes && (i / 11 + j / 7) % 3 == 0;
    heights[k] = hole ? proto::kNoHeight : 100;
  }
  return grid_mesh(cells, 1, heights);
}

// Only every stride-th border vertex stays.
std::size_t thin_border(TileMesh& mesh, std::int32_t stride) {
  std::size_t gone = 0;
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    if (!test::on_west_or_east(mesh, v) && !test::on_south_or_north(mesh, v)) continue;
    const bool stays = mesh.x[v] % stride == 0 && mesh.y[v] % stride == 0;
    mesh.mark[v] = static_cast<std::uint8_t>((mesh.mark[v] & proto::kVoid) | (stays ? proto::kKeep : proto::kRemove));
    gone += stays ? 0 : 1;
  }
  return gone;
}

// Vertices with data keep to the caps, void ones to theirs.
void expect_valences(const TileMesh& mesh, const std::string& what) {
  const auto found = test::neighbours(mesh);
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    const int sides = int{test::on_west_or_east(mesh, v)} + int{test::on_south_or_north(mesh, v)};
    const bool none = is_void(mesh, v);
    const std::size_t most = sides == 2   ? (none ? kVoidCorner : kWithData.corner)
                             : sides == 1 ? (none ? kVoidSide : kWithData.side)
                                          : (none ? kVoidInside : kMostValence);
    EXPECT_LE(found[v].size(), most) << what << " vertex " << mesh.x[v] << ' ' << mesh.y[v];
  }
}

// What the mend must do: keep the laws and what is marked kKeep, and say truly how many border vertices are left.
std::size_t expect_lawful_mesh(const TileMesh& input, const std::string& what) {
  auto rings = rings_from_triangles(input);
  EXPECT_TRUE(rings.ok()) << what;
  const std::size_t said = mend(*rings, input, kWithData);
  const TileMesh mesh = mesh_from_rings(input, *rings);
  EXPECT_EQ(test::broken_law(mesh), "") << what;
  std::size_t kept = 0, left = 0, want = 0;
  for (const std::uint8_t mark : mesh.mark) {
    kept += mark & proto::kKeep ? 1 : 0;
    left += mark & proto::kRemove ? 1 : 0;
  }
  for (const std::uint8_t mark : input.mark) want += mark & proto::kKeep ? 1 : 0;
  EXPECT_EQ(kept, want) << what;
  EXPECT_EQ(left, said) << what;
  expect_valences(mesh, what);
  return left;
}

void expect_mended(const TileMesh& input, const std::string& what) { EXPECT_EQ(expect_lawful_mesh(input, what), 0u) << what; }

TEST(Mend, HarshChainsOnGrids) {
  std::mt19937 random(1);
  for (const std::int32_t cells : {16, 32, 64, 128, 256})
    for (const std::int32_t stride : {2, 8, 16, cells / 4, cells})
      for (const Labels labels : {Labels::none, Labels::holes, Labels::random}) {
        if (cells == 256 && stride < 16) continue;
        TileMesh mesh = grid(cells, labels, random);
        ASSERT_GT(thin_border(mesh, stride), 0u);
        const std::string what =
            std::to_string(cells) + " stride " + std::to_string(stride) + " labels " + std::to_string(static_cast<int>(labels));
        // A dense inside leaves no room for a sparse border: that is for who asks to mend, not for the mend to force.
        const std::size_t left = expect_lawful_mesh(mesh, what);
        if (stride == 2) { EXPECT_EQ(left, 0u) << what; }
      }
}

TEST(Mend, RandomChains) {
  std::mt19937 random(2);
  for (int round = 0; round < 60; ++round) {
    TileMesh mesh = grid(32, static_cast<Labels>(round % 3), random);
    thin_border(mesh, 32);
    const std::uint32_t one_in = 2 + round % 9;
    for (std::size_t v = 0; v < mesh.vertices(); ++v)
      if ((mesh.mark[v] & proto::kRemove) && random() % one_in == 0) mesh.mark[v] ^= proto::kRemove | proto::kKeep;
    const std::size_t left = expect_lawful_mesh(mesh, "round " + std::to_string(round));
    if (one_in <= 2) { EXPECT_EQ(left, 0u) << round; }
  }
}

TEST(Mend, SomeInnerVerticesMustStay) {
  std::mt19937 random(3);
  TileMesh mesh = grid(64, Labels::holes, random);
  thin_border(mesh, 4);
  for (std::size_t v = 0; v < mesh.vertices(); ++v)
    if (!(mesh.mark[v] & proto::kRemove) && random() % 20 == 0) mesh.mark[v] |= proto::kKeep;
  expect_mended(mesh, "kept inside");
}

TEST(Mend, EasyChainsTouchNothingInside) {
  std::mt19937 random(4);
  TileMesh mesh = grid(64, Labels::holes, random);
  const std::size_t gone = thin_border(mesh, 2);
  auto rings = rings_from_triangles(mesh);
  ASSERT_EQ(mend(*rings, mesh, kWithData), 0u);
  EXPECT_EQ(mesh_from_rings(mesh, *rings).vertices(), mesh.vertices() - gone);
}

// Is (x, y) under a triangle with data at all corners?
bool shown(const TileMesh& mesh, std::int64_t x, std::int64_t y) {
  return std::any_of(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
    for (unsigned k = 0; k < 3; ++k) {
      const std::uint32_t a = t[k], b = t[(k + 1) % 3];
      const std::int64_t turn =
          (std::int64_t{mesh.x[b]} - mesh.x[a]) * (y - mesh.y[a]) - (std::int64_t{mesh.y[b]} - mesh.y[a]) * (x - mesh.x[a]);
      if (turn < 0 || is_void(mesh, a)) return false;
    }
    return true;
  });
}

// A void next to a side: a triangle on a long edge of that side would have it for its third corner, and uncover the edge.
TEST(Mend, NoSlitReachesAlongASide) {
  constexpr std::int32_t kCells = 16;
  std::vector<std::int32_t> heights((kCells + 1) * (kCells + 1), 100);
  heights[kCells + 1 + 8] = proto::kNoHeight;  // (8, 1)
  TileMesh input = grid_mesh(kCells, 1, heights);
  thin_border(input, kCells);
  auto rings = rings_from_triangles(input);
  ASSERT_TRUE(rings.ok());
  mend(*rings, input, kWithData, 0.5F);
  const TileMesh mesh = mesh_from_rings(input, *rings);
  EXPECT_EQ(test::broken_law(mesh), "");
  for (std::int32_t y = 0; y <= kCells; ++y)
    for (std::int32_t x = 0; x <= kCells; ++x)
      if (std::max(std::abs(x - 8), std::abs(y - 1)) > 1) { EXPECT_TRUE(shown(mesh, x, y)) << x << ' ' << y; }
}

TEST(Rings, GridThereAndBack) {
  std::mt19937 random(5);
  const TileMesh mesh = grid(16, Labels::none, random);
  const auto rings = rings_from_triangles(mesh);
  ASSERT_TRUE(rings.ok());
  const std::uint32_t centre = 8 * 17 + 8;
  EXPECT_EQ(rings.value().valence[centre], 6u);
  EXPECT_EQ(rings.value().open[centre], 0u);
  EXPECT_EQ(rings.value().ring(centre)[0], centre - 18);
  const auto south_west = rings.value().ring(0);
  EXPECT_EQ(std::vector<std::uint32_t>(south_west.begin(), south_west.end()), (std::vector<std::uint32_t>{1, 18, 17}));
  EXPECT_EQ(rings.value().triangles_at(0), 2u);
  const TileMesh back = mesh_from_rings(mesh, *rings);
  EXPECT_EQ(back.triangles.size(), mesh.triangles.size());
  EXPECT_EQ(test::broken_law(back), "");
}

TEST(Rings, RefusesWhatIsNoManifold) {
  std::mt19937 random(6);
  const TileMesh good = grid(16, Labels::none, random);
  TileMesh bad = good;
  bad.triangles.push_back(bad.triangles[40]);
  EXPECT_FALSE(rings_from_triangles(bad).ok()) << "a triangle twice";
  bad = good;
  bad.triangles.erase(bad.triangles.begin() + 40);
  EXPECT_FALSE(rings_from_triangles(bad).ok()) << "a triangle missing";
  bad = good;
  std::swap(bad.triangles[40][0], bad.triangles[40][1]);
  EXPECT_EQ(rings_from_triangles(bad).problem().type, "mesh-not-manifold") << "a triangle upside down";
}

}  // namespace
}  // namespace cordillera::gpu
