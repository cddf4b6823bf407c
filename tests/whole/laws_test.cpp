// Each law on a sound tile, and on one that breaks it: a judge who never finds anything judges nothing.
#include "tests/whole/laws.h"

#include <gmock/gmock.h>

#include <cmath>

namespace cordillera::whole {
namespace {

using testing::HasSubstr;
using testing::Optional;

/// A grid of 4 x 4 cells of 16 units, diagonals south-west to north-east.
DecodedTile grid(proto::TileAddress address) {
  DecodedTile t{address, 64, {}, {}, {}, {}};
  for (std::int32_t v = 0; v <= 4; ++v)
    for (std::int32_t u = 0; u <= 4; ++u) {
      t.u.push_back(16 * u);
      t.v.push_back(16 * v);
      const int across = 4 * proto::tiles_across(address.z);
      t.h.push_back(1024 * ((u + 4 * address.x) % across * 7 % 5 + (v + 4 * address.y) * 3 % 7));
    }
  for (std::uint32_t v = 0; v < 4; ++v)
    for (std::uint32_t u = 0; u < 4; ++u) {
      const std::uint32_t sw = v * 5 + u;
      t.triangles.push_back({sw, sw + 1, sw + 6});
      t.triangles.push_back({sw, sw + 6, sw + 5});
    }
  return t;
}

Violation any(const DecodedTile& t, Holes holes = Holes::none) {
  if (Violation v = plan_violation(t, holes)) return v;
  return manifold_violation(t, holes);
}

TEST(laws, a_grid_obeys) {
  EXPECT_EQ(any(grid({3, 5, 2})), std::nullopt);
  EXPECT_EQ(any(grid({3, 5, 2}), Holes::allowed), std::nullopt);
}

TEST(laws, orientation) {
  DecodedTile t = grid({3, 5, 2});
  std::swap(t.triangles[3][0], t.triangles[3][1]);
  EXPECT_THAT(plan_violation(t, Holes::allowed), Optional(HasSubstr("doubled area -256")));
}
TEST(laws, folds_overlap) {
  DecodedTile t = grid({3, 5, 2});
  t.triangles[0] = {0, 2, 6};  // over its eastern neighbour as well
  EXPECT_THAT(plan_violation(t, Holes::allowed), Optional(HasSubstr("overlap")));
}
TEST(laws, a_missing_triangle_leaves_area) {
  DecodedTile t = grid({3, 5, 2});
  t.triangles.erase(t.triangles.begin() + 10);
  EXPECT_THAT(plan_violation(t, Holes::none), Optional(HasSubstr("add up to")));
  EXPECT_THAT(manifold_violation(t, Holes::none), Optional(HasSubstr("no partner")));
  EXPECT_EQ(any(t, Holes::allowed), std::nullopt);
  EXPECT_EQ(plan_violation(t, Holes::allowed, 2 * 64 * 64 - 256), std::nullopt);
  EXPECT_NE(plan_violation(t, Holes::allowed, 2 * 64 * 64), std::nullopt);
}
TEST(laws, outside_and_bad_corners) {
  DecodedTile t = grid({3, 5, 2});
  t.u[4] = 65;
  EXPECT_THAT(any(t), Optional(HasSubstr("outside")));
  t = grid({3, 5, 2});
  t.triangles[0][0] = 25;
  EXPECT_THAT(any(t), Optional(HasSubstr("corner 25")));
}
TEST(laws, a_t_junction_has_no_partner) {
  DecodedTile t = grid({3, 5, 2});
  // Vertex 6 (16, 16) is split in two copies: nothing overlaps, nothing is missing, but the tile is cut open there.
  t.u.push_back(16), t.v.push_back(16), t.h.push_back(t.h[6]);
  for (auto& c : t.triangles)
    if (c[0] == 6) c[0] = 25;
  EXPECT_EQ(plan_violation(t, Holes::none), std::nullopt);
  EXPECT_THAT(manifold_violation(t, Holes::none), Optional(HasSubstr("no partner")));
}
TEST(laws, doubled_edges) {
  DecodedTile t = grid({3, 5, 2});
  t.triangles.push_back(t.triangles[7]);
  EXPECT_THAT(manifold_violation(t, Holes::allowed), Optional(HasSubstr("twice")));
  EXPECT_THAT(plan_violation(t, Holes::allowed), Optional(HasSubstr("overlap")));
}
TEST(laws, rims_that_touch_must_be_split) {
  DecodedTile t = grid({3, 5, 2});
  std::erase_if(t.triangles, [](const auto& c) { return c[0] == 6 || c[1] == 6 || c[2] == 6; });
  EXPECT_THAT(manifold_violation(t, Holes::allowed), Optional(HasSubstr("no triangle")));
  t = grid({3, 5, 2});
  std::erase_if(t.triangles, [](const auto& c) {  // round vertex 12 (32, 32), two opposite ones stay
    const bool at = c[0] == 12 || c[1] == 12 || c[2] == 12;
    return at && c != std::array<std::uint32_t, 3>{12, 13, 18} && c != std::array<std::uint32_t, 3>{6, 12, 11};
  });
  EXPECT_THAT(manifold_violation(t, Holes::allowed), Optional(HasSubstr("more than one fan")));
}
TEST(laws, valence) {
  DecodedTile t{{3, 5, 2}, 64, {32}, {32}, {0}, {}};
  for (std::uint32_t k = 0; k < 16; ++k) {  // around the rectangle in steps of 16
    const auto side = static_cast<std::int32_t>(k / 4), at = static_cast<std::int32_t>(16 * (k % 4));
    t.u.push_back(side == 0 ? at : side == 1 ? 64 : side == 2 ? 64 - at : 0);
    t.v.push_back(side == 0 ? 0 : side == 1 ? at : side == 2 ? 64 : 64 - at);
    t.h.push_back(0);
    t.triangles.push_back({0, k + 1, (k + 1) % 16 + 1});
  }
  EXPECT_EQ(plan_violation(t, Holes::none), std::nullopt);
  EXPECT_THAT(manifold_violation(t, Holes::none), Optional(HasSubstr("has 16 triangles")));
}

TEST(laws, upside_down_in_space) {
  EXPECT_EQ(space_violation(surface_of(grid({3, 5, 2}))), std::nullopt);
  DecodedSurface turned = surface_of(grid({3, 5, 2}));
  std::swap(turned.triangles[3][0], turned.triangles[3][1]);
  EXPECT_THAT(space_violation(turned), Optional(HasSubstr("1 triangles are upside down")));
  // Longitudes 0, 45 and 22.5: in plan the tip lies beyond the edge along the parallel, in space on the other side of it.
  DecodedTile polar{{2, 4, 3}, 64, {0, 64, 32}, {40, 40, 41}, {0, 0, 0}, {{0, 1, 2}}};
  EXPECT_EQ(plan_violation(polar, Holes::allowed), std::nullopt);
  EXPECT_THAT(space_violation(surface_of(polar)), Optional(HasSubstr("1 triangles are upside down")));
}
TEST(laws, no_lines_at_a_pole) {
  DecodedTile cap{{2, 4, 3}, 64, {0, 64, 32}, {64, 64, 40}, {0, 0, 0}, {{0, 2, 1}}};
  EXPECT_THAT(space_violation(surface_of(cap)), Optional(HasSubstr("two corners at a pole")));
  cap.u = {0, 64, 32}, cap.v = {40, 40, 64}, cap.triangles = {{0, 1, 2}};
  EXPECT_EQ(space_violation(surface_of(cap)), std::nullopt);
  // In plan the pole is east of what is a meridian, and then a line that runs a little east of the pole.
  cap.u = {16, 16, 48}, cap.v = {60, 40, 64};
  EXPECT_EQ(plan_violation(cap, Holes::allowed), std::nullopt);
  EXPECT_THAT(space_violation(surface_of(cap)), Optional(HasSubstr("1 triangles are upside down")));
  cap.u = {17, 16, 48};
  EXPECT_THAT(space_violation(surface_of(cap)), Optional(HasSubstr("1 triangles are upside down")));
}

TEST(laws, cover) {
  DecodedTile t = grid({3, 5, 2});
  const Shown all{0, 0, 64, 64, [](std::int64_t, std::int64_t) { return true; }};
  EXPECT_EQ(cover_violation(t, all), std::nullopt);
  t.triangles.erase(t.triangles.begin() + 10);  // (16, 16), (32, 16), (32, 32): what lies inside it, no edge
  EXPECT_THAT(cover_violation(t, all), Optional(HasSubstr("105 samples well inside the data are uncovered, one at (18, 17)")));
  const Shown west{0, 0, 17, 64, all.must};
  EXPECT_EQ(cover_violation(t, west), std::nullopt);
  EXPECT_EQ(cover_violation(t, {0, 0, 64, 64, [](std::int64_t u, std::int64_t v) { return u == 20 && v == 30; }}), std::nullopt);
  EXPECT_NE(cover_violation(t, {0, 0, 64, 64, [](std::int64_t u, std::int64_t v) { return u == 30 && v == 20; }}), std::nullopt);
  DecodedTile slit = grid({3, 5, 2});
  slit.u[6] += 1;                                // a triangle's corner steps aside
  slit.triangles.erase(slit.triangles.begin());  // (0, 0), (16, 0), (17, 16)
  EXPECT_NE(cover_violation(slit, all), std::nullopt);
}

TEST(laws, neighbours_agree) {
  for (const proto::TileAddress other : {proto::TileAddress{3, 6, 2}, {3, 5, 3}, {3, 6, 3}, {3, 4, 1}})
    EXPECT_EQ(neighbour_violation(grid({3, 5, 2}), grid(other), Holes::none), std::nullopt);
  EXPECT_EQ(neighbour_violation(grid({3, 15, 2}), grid({3, 0, 2}), Holes::none), std::nullopt);
}
TEST(laws, neighbours_that_differ) {
  for (const auto& [a, b] : {std::pair{grid({3, 5, 2}), grid({3, 6, 2})}, {grid({3, 15, 2}), grid({3, 0, 2})}}) {
    DecodedTile higher = a;
    higher.h[14] += 1;
    EXPECT_THAT(neighbour_violation(higher, b, Holes::allowed), Optional(HasSubstr("height")));
    DecodedTile moved = a;
    moved.v[14] += 1;
    EXPECT_THAT(neighbour_violation(moved, b, Holes::allowed), Optional(HasSubstr("inside an edge")));
    DecodedTile cut = a;  // without its vertex 14: the one north of it takes its place
    for (auto& c : cut.triangles)
      for (auto& k : c) k = k == 14 ? 19 : k;
    std::erase_if(cut.triangles, [](const auto& c) { return c[0] == c[1] || c[1] == c[2] || c[2] == c[0]; });
    cut.v[14] = 63, cut.u[14] = 1;  // out of the way
    EXPECT_THAT(neighbour_violation(cut, b, Holes::allowed), Optional(HasSubstr("inside an edge")));
    DecodedTile open = a;  // its last rows are a hole: no matter, unless there are no holes
    std::erase_if(open.triangles, [](const auto& c) { return c[1] >= 15 || c[2] >= 15; });
    open.u.resize(15), open.v.resize(15), open.h.resize(15);
    EXPECT_EQ(neighbour_violation(open, b, Holes::allowed), std::nullopt);
    EXPECT_THAT(neighbour_violation(open, b, Holes::none), Optional(HasSubstr("missing")));
  }
}

BothFaces faces(const DecodedTile& t, double step_m) {
  BothFaces both{t, surface_of(t).points};
  for (Point& p : both.points)
    for (double& c : p) c = std::nearbyint(c / step_m) * step_m;
  return both;
}
TEST(laws, glb_points) {
  const double step_m = 0.25;
  const StepOf step_of = [=](double) { return step_m; };
  for (const auto& [x, y] : {std::pair{5, 6}, {15, 0}}) {
    const BothFaces a = faces(grid({3, x, 2}), step_m), b = faces(grid({3, y, 2}), step_m);
    EXPECT_EQ(glb_neighbour_violation(a, b, step_of), std::nullopt);
    BothFaces off = b;
    off.points[10][0] += 1e-6;
    EXPECT_THAT(glb_neighbour_violation(a, off, step_of), Optional(HasSubstr("differ")));
    off.points[10][0] += 2;
    EXPECT_THAT(glb_neighbour_violation(a, off, step_of),
                Optional(HasSubstr("is not in the .glb of tile 3/" + std::to_string(y))));
    EXPECT_THAT(glb_neighbour_violation(off, a, step_of),
                Optional(HasSubstr("is not in the .glb of tile 3/" + std::to_string(y))));
  }
}

}  // namespace
}  // namespace cordillera::whole
