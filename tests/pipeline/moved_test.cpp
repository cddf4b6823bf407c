// A border vertex that stepped inside stands where it has no height of its own.
#include "pipeline/tile/moved.h"

#include <gtest/gtest.h>

#include <cstddef>

namespace cordillera::pipeline {
namespace {

constexpr std::int32_t kSide = 16;
constexpr proto::TileAddress kTile{8, 300, 200};

// 4 x 4 cells; heights rise by 4 m a unit northwards.
proto::TileMesh grid() {
  proto::TileMesh mesh;
  mesh.side = kSide;
  for (std::int32_t y = 0; y <= kSide; y += 4)
    for (std::int32_t x = 0; x <= kSide; x += 4) {
      mesh.x.push_back(x);
      mesh.y.push_back(y);
      mesh.height.push_back(4 * y * 1024);
      mesh.mark.push_back(0);
    }
  for (std::uint32_t r = 0; r < 4; ++r)
    for (std::uint32_t c = 0; c < 4; ++c) {
      const std::uint32_t v = 5 * r + c;
      mesh.triangles.push_back({v, v + 1, v + 6});
      mesh.triangles.push_back({v, v + 6, v + 5});
    }
  return mesh;
}

constexpr std::size_t kMoved = 2, kFitted = 12;  // (8, 0) and (8, 8)

class Moved : public ::testing::Test {
 protected:
  Moved() {
    prepared_.tile = kTile;
    prepared_.input = grid();
    mesh_ = grid();
    mesh_.y[kMoved] = 1;
    mesh_.height[kFitted] += 77;  // moved up and down only: a height that somebody chose
    samples_ = {
        lattice_.west(kTile), lattice_.south(kTile), kSide + 1, kSide + 1, std::vector<std::int32_t>(17 * 17, 900 * 1024), {}};
    context_.lattice = &lattice_;
  }
  void expect_others_as_they_were() {
    for (std::size_t v = 0; v < mesh_.vertices(); ++v) {
      if (v == kMoved) continue;
      EXPECT_EQ(mesh_.height[v], grid().height[v] + (v == kFitted ? 77 : 0)) << v;
    }
  }

  proto::Lattice lattice_{8};
  proto::Samples samples_;
  LevelContext context_;
  PreparedTile prepared_;
  proto::TileMesh mesh_;
};

TEST_F(Moved, GetsTheSample) {
  samples_.height[17 * 1 + 8] = 500 * 1024;
  context_.samples = &samples_;
  settle_moved(context_, prepared_, mesh_);
  EXPECT_EQ(mesh_.height[kMoved], 500 * 1024);
  expect_others_as_they_were();
}

TEST_F(Moved, GetsTheHeightOfTheSurfaceWhereSamplesAreOutOfReach) {
  settle_moved(context_, prepared_, mesh_);
  EXPECT_EQ(mesh_.height[kMoved], 4 * 1024);
  expect_others_as_they_were();
}

TEST_F(Moved, StaysWhereNothingIsKnown) {
  samples_.height[17 * 1 + 8] = proto::kNoHeight;
  context_.samples = &samples_;
  settle_moved(context_, prepared_, mesh_);
  EXPECT_EQ(mesh_.height[kMoved], 0);
  expect_others_as_they_were();
}

}  // namespace
}  // namespace cordillera::pipeline
