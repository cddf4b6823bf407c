// The worked examples of the thesis' appendices, phase by phase. Its figures are pictures; the meshes here are ones that fit
// every number its text gives.
#include "tests/gpu/cleap_example.h"

#include <algorithm>
#include <cmath>

#include "gpu/cleap/cleap.h"
#include "gpu/cleap/integrity_tests.h"
#include "gpu/cleap/lock_down.h"
#include "gpu/cleap/phases.h"
#include "gpu/cleap/rearrange.h"

namespace cordillera::gpu::cleap {
namespace {

using Numbers = std::vector<std::int32_t>;

/// A window over edges of an example, loaded.
struct Tried {
  std::vector<std::uint32_t> pool;
  std::vector<Fate> fate;
  std::vector<std::int32_t> edge, left;
  std::vector<Position> to;
  Window window;

  Tried(const Example& mesh, const Numbers& edges, Border border = Border::keep) {
    for (const std::int32_t e : edges) pool.push_back(static_cast<std::uint32_t>(e));
    fate.resize(pool.size());
    edge.resize(pool.size());
    left.resize(3 * pool.size());
    to.resize(pool.size());
    window = {
        static_cast<std::uint32_t>(pool.size()), pool.data(), nullptr, 0, 0, fate.data(), edge.data(), to.data(), left.data()};
    each(LoadCandidate<EdgeLength>{mesh.arrays, window, border});
  }
  template <class F>
  void each(const F& f) {
    Example::each(pool.size(), f);
  }
};

// Appendix A.1: an end of the red edge is a corner opposite to the blue one.
struct Rivals {
  Example mesh = grid_example(9, 8);
  std::int32_t blue = mesh.edge_number(3 * 9 + 3, 4 * 9 + 3), red = mesh.edge_number(4 * 9 + 4, 5 * 9 + 4);
};

Numbers vicinity(const Example& mesh, std::int32_t e) {
  Numbers found;
  all_in_vicinity(mesh.arrays, mesh.edge[static_cast<std::size_t>(e)], [&](std::int32_t triangle) {
    found.push_back(triangle);
    return true;
  });
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

TEST(CleapAppendixA, OneOfTwoThatShareTrianglesGetsThemAll) {
  Rivals rivals;
  EXPECT_EQ(diamond_of(rivals.mesh.arrays, rivals.mesh.edge[static_cast<std::size_t>(rivals.blue)]).op1 == 4 * 9 + 4 ||
                diamond_of(rivals.mesh.arrays, rivals.mesh.edge[static_cast<std::size_t>(rivals.blue)]).op2 == 4 * 9 + 4,
            true);
  Tried tried(rivals.mesh, {rivals.blue, rivals.red});
  tried.each(ClaimOrdered{rivals.mesh.arrays, tried.window});
  tried.each(DecideOrdered{rivals.mesh.arrays, tried.window});
  EXPECT_EQ(tried.fate[0], Fate::collapsed);
  EXPECT_EQ(tried.fate[1], Fate::locked);
  for (const std::int32_t triangle : vicinity(rivals.mesh, rivals.blue)) {
    EXPECT_EQ(rivals.mesh.flag[static_cast<std::size_t>(triangle)], number_of(0));
  }
  tried.each(Release{rivals.mesh.arrays, tried.window, false});
  for (const std::uint32_t flag : rivals.mesh.flag) EXPECT_EQ(flag, kFree);
}

TEST(CleapAppendixA, WhoLosesTheRaceReleasesWhatItTook) {
  Rivals rivals;
  Tried tried(rivals.mesh, {rivals.red, rivals.blue});
  tried.each(LockRaced{rivals.mesh.arrays, tried.window});
  EXPECT_EQ(tried.fate[0], Fate::collapsed);
  EXPECT_EQ(tried.fate[1], Fate::locked);
  const Numbers held = vicinity(rivals.mesh, rivals.red);
  for (std::size_t t = 0; t < rivals.mesh.flag.size(); ++t) {
    const bool is_held = std::binary_search(held.begin(), held.end(), static_cast<std::int32_t>(t));
    EXPECT_EQ(rivals.mesh.flag[t], is_held ? number_of(0) : kFree) << "triangle " << t;
  }
}

TEST(CleapAppendixA, TwoThatShareNothingBothGoAhead) {
  Example mesh = grid_example(14, 8);
  const std::int32_t red = mesh.edge_number(3 * 14 + 3, 4 * 14 + 3), blue = mesh.edge_number(3 * 14 + 10, 4 * 14 + 10);
  for (const Lock lock : {Lock::ordered, Lock::raced}) {
    Tried tried(mesh, {red, blue});
    if (lock == Lock::raced) {
      tried.each(LockRaced{mesh.arrays, tried.window});
    } else {
      tried.each(ClaimOrdered{mesh.arrays, tried.window});
      tried.each(DecideOrdered{mesh.arrays, tried.window});
    }
    EXPECT_EQ(tried.fate, (std::vector{Fate::collapsed, Fate::collapsed}));
    tried.each(Release{mesh.arrays, tried.window, false});
  }
}

TEST(CleapAppendixB, RowsLoseDeadTrianglesAndContinue) {
  Example mesh = appendix_mesh();
  EXPECT_EQ(mesh.row(6), (Numbers{0, 1, 5, 6, 7}));
  EXPECT_EQ(mesh.row(7), (Numbers{1, 2, 3, 4, 5}));
  Tried tried(mesh, {4});
  tried.each(Eliminate{mesh.arrays, tried.window});
  EXPECT_EQ(mesh.row(6), (Numbers{0, 6, 7}));
  EXPECT_EQ(mesh.row(7), (Numbers{2, 3, 4}));
  EXPECT_EQ(mesh.row(2), (Numbers{0, 2})) << "triangle 1 was at vertex 2, too";
  EXPECT_EQ(mesh.row(3), (Numbers{4, 6})) << "triangle 5 was at vertex 3, too";
  EXPECT_EQ(mesh.arrays.row(7)[1], 6);
  EXPECT_EQ(mesh.arrays.row(6)[1], -1);
  EXPECT_EQ(triangles_at(mesh.arrays, 7), 6) << "5 + 5 - 4, equation 4.1";
}

TEST(CleapAppendixC, EliminationLeavesTheMarks) {
  Example mesh = appendix_mesh();
  Tried tried(mesh, {4});
  tried.each(Eliminate{mesh.arrays, tried.window});
  EXPECT_TRUE(std::isinf(mesh.vertex[6].x));
  EXPECT_EQ(mesh.vertex[6].y, 7);
  EXPECT_EQ(mesh.vertex[6].z, 7);
  EXPECT_EQ(mesh.vertex[7].x, 1.5);
  EXPECT_EQ(mesh.vertex[7].y, 1);
  EXPECT_EQ(mesh.vertex[7].z, 6);
  for (const std::size_t t : {1u, 5u}) EXPECT_EQ(mesh.corner[t], (std::array{0, 0, 0}));
  EXPECT_EQ(mesh.edge[4].n[0], -1);
  EXPECT_EQ(mesh.edge[4].op[1], -1);
}

TEST(CleapAppendixC, RepairsGoThroughMailboxes) {
  Example mesh = appendix_mesh();
  Tried tried(mesh, {4});
  tried.each(Eliminate{mesh.arrays, tried.window});

  Example::each(mesh.corner.size(), RepairTriangle{mesh.arrays});
  for (const std::size_t t : {0u, 6u, 7u}) EXPECT_EQ(std::count(mesh.corner[t].begin(), mesh.corner[t].end(), 7), 1) << t;
  for (const auto& corner : mesh.corner) EXPECT_EQ(std::count(corner.begin(), corner.end(), 6), 0);

  Example::each(mesh.edge.size(), RepairEdge{mesh.arrays});
  for (const std::size_t e : {1u, 2u, 11u, 13u}) EXPECT_TRUE(mesh.edge[e].n[0] == 7 || mesh.edge[e].n[1] == 7) << e;
  const auto letters = [&](std::size_t t) {
    Numbers found(mesh.corner[t].begin(), mesh.corner[t].end());
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  };
  EXPECT_EQ(letters(1), (Numbers{2, 3}));
  EXPECT_EQ(letters(5), (Numbers{10, 11}));

  Example::each(mesh.corner.size(), RepairConnection{mesh.arrays});
  for (const std::size_t t : {1u, 5u}) EXPECT_EQ(mesh.corner[t], (std::array{0, 0, 0}));
  for (const std::size_t e : {2u, 4u, 10u}) EXPECT_EQ(mesh.edge[e].n[0], -1) << "the lower edge goes, " << e;
  EXPECT_EQ(mesh.triangles_of(3), (std::array{0, 2}));
  EXPECT_EQ(mesh.triangles_of(11), (std::array{4, 6}));
  mesh.expect_consistent();
}

TEST(CleapAppendixC, RepairAroundDoesTheSame) {
  Example all = appendix_mesh(), near = appendix_mesh();
  Tried tried(all, {4}), tried_near(near, {4});
  tried.each(Eliminate{all.arrays, tried.window});
  Example::each(all.corner.size(), RepairTriangle{all.arrays});
  Example::each(all.edge.size(), RepairEdge{all.arrays});
  Example::each(all.corner.size(), RepairConnection{all.arrays});
  tried_near.each(Eliminate{near.arrays, tried_near.window});
  tried_near.each(RepairAround{near.arrays, tried_near.window});
  EXPECT_EQ(all.corner, near.corner);
  for (std::size_t e = 0; e < all.edge.size(); ++e) {
    EXPECT_EQ(all.edge[e].n[0], near.edge[e].n[0]) << e;
    EXPECT_EQ(all.edge[e].a[0], near.edge[e].a[0]) << e;
    EXPECT_EQ(all.edge[e].b[1], near.edge[e].b[1]) << e;
    EXPECT_EQ(all.edge[e].op[1], near.edge[e].op[1]) << e;
  }
  near.expect_consistent();
}

// Numbers 0 of vertex, triangle and edge are numbers like others, though 0 also says "gone".
TEST(CleapAppendixC, NumberZeroIsNoExcuse) {
  Example mesh = grid_example(6, 6);
  std::swap(mesh.edge[0], mesh.edge[static_cast<std::size_t>(mesh.edge_number(14, 21))]);
  Example::each(mesh.edge.size(), NoteEdge{mesh.arrays});
  Tried tried(mesh, {mesh.edge_number(14, 15)});
  tried.each(Eliminate{mesh.arrays, tried.window});
  Example::each(mesh.corner.size(), RepairTriangle{mesh.arrays});
  Example::each(mesh.edge.size(), RepairEdge{mesh.arrays});
  Example::each(mesh.corner.size(), RepairConnection{mesh.arrays});
  mesh.expect_consistent();
  EXPECT_EQ(mesh.edge[0].n[0], -1) << "it merges with 15-21, of the higher number";
}

// Appendix D: of 14 vertices 4 and 9 are gone. 13 is named by triangles 8 and 10 and edges 7, 16 and 17, 12 by triangles 7 and 8
// and edges 17, 20 and 26.
struct Rearranged {
  std::vector<Position> vertex;
  std::vector<std::array<std::int32_t, 3>> corner{16, {1, 2, 3}};
  std::vector<Edge> edge{29, Edge{{1, 2}, {0, 0}, {0, 0}, {0, 0}}};
  Arrays arrays;
  Rearranged() {
    for (int v = 0; v < 14; ++v) vertex.push_back({static_cast<double>(v), 0, 0});
    vertex[4] = {kInfinite, 5, 5};
    vertex[9] = {kInfinite, 10, 10};
    corner[7] = {12, 8, 11};
    corner[8] = {12, 13, 8};
    corner[10] = {13, 5, 8};
    for (const std::size_t t : {3u, 6u, 12u, 15u}) corner[t] = {0, 0, 0};
    edge[7].n[1] = edge[16].n[0] = edge[17].n[0] = 13;
    edge[17].n[1] = edge[20].n[0] = edge[26].n[1] = 12;
    arrays.vertices = 14;
    arrays.triangles = 16;
    arrays.edges = 29;
    arrays.vertex = vertex.data();
    arrays.corner = corner.front().data();
    arrays.edge = edge.data();
  }
  void expect_done() const {
    EXPECT_EQ(corner[7], (std::array{9, 8, 11}));
    EXPECT_EQ(corner[8], (std::array{9, 4, 8}));
    EXPECT_EQ(corner[10], (std::array{4, 5, 8}));
    for (const std::size_t e : {7u, 26u}) EXPECT_EQ(edge[e].n[0], 1);
    EXPECT_EQ(edge[7].n[1], 4);
    EXPECT_EQ(edge[16].n[0], 4);
    EXPECT_EQ(edge[17].n[0], 4);
    EXPECT_EQ(edge[17].n[1], 9);
    EXPECT_EQ(edge[20].n[0], 9);
    EXPECT_EQ(edge[26].n[1], 9);
    for (const std::size_t t : {3u, 6u, 12u, 15u}) EXPECT_EQ(corner[t], (std::array{0, 0, 0}));
  }
};

TEST(CleapAppendixD, SwapAfterSwap) {
  Rearranged mesh;
  for (const auto& [from, to] : {std::array{13, 4}, std::array{12, 9}}) {
    Example::each(16, SwapInTriangle{mesh.arrays, from, to});
    Example::each(29, SwapInEdge{mesh.arrays, from, to});
  }
  mesh.expect_done();
}

TEST(CleapAppendixD, TheScanGivesTheSamePlaces) {
  Rearranged mesh;
  std::vector<std::uint32_t> alive(14), before(14);
  std::vector<std::int32_t> gap(14), number(14);
  std::vector<std::uint8_t> border(14);
  mesh.arrays.border = border.data();
  Example::each(14, MarkAlive{mesh.arrays, alive.data()});
  for (std::size_t v = 1; v < 14; ++v) before[v] = before[v - 1] + alive[v - 1];
  Example::each(14, FindGaps{mesh.arrays, before.data(), 12, gap.data()});
  Example::each(14, FillGaps{mesh.arrays, before.data(), 12, gap.data(), number.data()});
  Example::each(16, RenumberTriangle{mesh.arrays, number.data()});
  Example::each(29, RenumberEdge{mesh.arrays, number.data()});
  mesh.expect_done();
  EXPECT_EQ(mesh.vertex[4].x, 13);
  EXPECT_EQ(mesh.vertex[9].x, 12);
}

// Section 4.5.
TEST(CleapIntegrity, TestsSayWhy) {
  Example mesh = grid_example(8, 8);
  const auto fate_of = [&](std::int32_t v, std::int32_t w, std::int32_t c, Border border = Border::keep,
                           Inversion inversion = Inversion::sign) {
    Tried tried(mesh, {mesh.edge_number(v, w)}, border);
    tried.each(TestCandidate{mesh.arrays, tried.window, border, c, inversion});
    return tried.fate[0];
  };
  EXPECT_EQ(fate_of(27, 28, 14), Fate::collapsed);
  EXPECT_EQ(fate_of(27, 28, 8), Fate::collapsed) << "6 + 6 - 4 is c, and may be";
  EXPECT_EQ(fate_of(27, 28, 7), Fate::crowded);
  EXPECT_EQ(fate_of(9, 1, 14), Fate::border);
  EXPECT_EQ(fate_of(9, 1, 14, Border::collapse), Fate::collapsed);
  EXPECT_EQ(fate_of(2, 3, 14, Border::collapse), Fate::collapsed_border);
  EXPECT_EQ(fate_of(0, 1, 14, Border::collapse), Fate::collapsed_border) << "vertex 1 goes to the corner";
  mesh.vertex[35].z = 1e-3;
  EXPECT_EQ(fate_of(27, 28, 14), Fate::collapsed);
  EXPECT_EQ(fate_of(27, 28, 14, Border::keep, Inversion::normals), Fate::inverted) << "not quite flat";
  EXPECT_EQ(fate_of(42, 43, 14, Border::keep, Inversion::normals), Fate::inverted);
  EXPECT_EQ(fate_of(45, 46, 14, Border::keep, Inversion::normals), Fate::collapsed) << "flat";
  // A corner may not go: of a border of two points that are both corners nothing does.
  mesh.vertex[1].y = -0.5;
  mesh.vertex[2].y = -1.5;
  EXPECT_EQ(fate_of(1, 2, 14, Border::collapse), Fate::border);
  // The neighbour leans over the middle of the edge.
  mesh.vertex[36] = {3.4, 3.05, 0};
  EXPECT_EQ(fate_of(27, 28, 14), Fate::inverted);
}

}  // namespace
}  // namespace cordillera::gpu::cleap
