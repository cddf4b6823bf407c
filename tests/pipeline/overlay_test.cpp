// Triangles that meet a triangle are found, and few others, where data is small in its tile.
#include "pipeline/bound/overlay.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <random>

namespace cordillera::pipeline {
namespace {

using Corners = std::array<PlanPoint, 3>;

bool all(const proto::TileMesh&, const std::array<std::uint32_t, 3>&) { return true; }

/// Long triangles from the rim of small data, which lies aslant, to the corners of a tile, and small ones inside.
struct SmallInTile {
  static constexpr std::int32_t kTile = 1 << 20, kWest = 300'000, kSide = 400, kSteps = 100;
  proto::TileMesh around, inside;

  SmallInTile() {
    around.side = inside.side = kTile;
    const auto add = [](proto::TileMesh& mesh, const std::array<std::array<std::int32_t, 2>, 3>& corners) {
      std::array<std::uint32_t, 3> triangle{};
      for (std::size_t k = 0; k < 3; ++k) {
        triangle[k] = static_cast<std::uint32_t>(mesh.vertices());
        const auto [x, y] = corners[k];
        const bool corner = (x == 0 || x == kTile) && (y == 0 || y == kTile);
        mesh.x.push_back(x), mesh.y.push_back(corner ? y : y + (x - kWest) / 2);
        mesh.height.push_back(0), mesh.mark.push_back(0);
      }
      mesh.triangles.push_back(triangle);
    };
    constexpr std::int32_t kStep = kSide / kSteps, kEast = kWest + kSide;
    for (std::int32_t k = 0; k < kSteps; ++k) {
      const std::int32_t from = kWest + k * kStep, to = from + kStep;
      add(around, {{{to, kWest}, {from, kWest}, {0, 0}}});
      add(around, {{{kEast, to}, {kEast, from}, {kTile, 0}}});
      add(around, {{{from, kEast}, {to, kEast}, {kTile, kTile}}});
      add(around, {{{kWest, from}, {kWest, to}, {0, kTile}}});
      for (std::int32_t r = 0; r < kSteps; ++r) {
        const std::int32_t south = kWest + r * kStep;
        add(inside, {{{from, south}, {to, south}, {from, south + kStep}}});
      }
    }
  }
};

TEST(TriangleIndex, FindsWhatATriangleMeetsAndLittleElse) {
  const SmallInTile made;
  const TriangleIndex index(made.around, all, box_around(made.inside, all));
  std::vector<std::uint32_t> found;
  std::size_t candidates = 0, meetings = 0;
  for (const auto& t : made.inside.triangles) {
    const Corners asked = plan_of(made.inside, t);
    index.meeting(asked, found);
    EXPECT_TRUE(std::is_sorted(found.begin(), found.end()) && std::adjacent_find(found.begin(), found.end()) == found.end());
    candidates += found.size();
    for (std::uint32_t k = 0; k < made.around.triangles.size(); ++k) {
      if (common_part(asked, plan_of(made.around, made.around.triangles[k])).count == 0) continue;
      ++meetings;
      ASSERT_TRUE(std::binary_search(found.begin(), found.end(), k)) << asked[0].x << " " << asked[0].y;
    }
  }
  EXPECT_GT(meetings, 400u);
  EXPECT_LT(candidates, 10 * made.inside.triangles.size()) << "each of them would meet all boxes of a quadrant";
}

TEST(TriangleIndex, FindsWhateverIsAskedWhereNobodySaysWhere) {
  const SmallInTile made;
  const TriangleIndex index(made.around, all);
  std::mt19937 random(5);
  std::vector<std::uint32_t> found;
  for (int n = 0; n < 300; ++n) {
    const std::int32_t reach = n % 2 == 0 ? SmallInTile::kTile : 1000, from = n % 2 == 0 ? 0 : SmallInTile::kWest - 300;
    Corners asked;
    for (PlanPoint& p : asked) p = {static_cast<double>(from + random() % reach), static_cast<double>(from + random() % reach)};
    if (twice_area(asked[0], asked[1], asked[2]) < 0) std::swap(asked[1], asked[2]);
    index.meeting(asked, found);
    for (std::uint32_t k = 0; k < made.around.triangles.size(); ++k)
      if (common_part(asked, plan_of(made.around, made.around.triangles[k])).count > 0)
        ASSERT_TRUE(std::binary_search(found.begin(), found.end(), k)) << n;
  }
}

}  // namespace
}  // namespace cordillera::pipeline
