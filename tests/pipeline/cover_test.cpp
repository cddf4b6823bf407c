// The law of covering: what is asked for.
#include "pipeline/bound/cover.h"
#include "tests/gpu/grid_mesh.h"

#include <gtest/gtest.h>

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;

const proto::Lattice kGround{12};

/// A grid without data.
TileMesh void_grid(std::int32_t cells, std::int32_t step) {
  const auto across = static_cast<std::size_t>(cells) + 1;
  TileMesh mesh = gpu::grid_mesh(cells, step, std::vector<std::int32_t>(across * across, 0));
  for (auto& mark : mesh.mark) mark |= proto::kVoid;
  return mesh;
}

TEST(Cover, CellsThatAreWiderThanTheDataAskForNothing) {
  const proto::TileAddress all{0, 0, 0};
  const auto side = static_cast<std::int32_t>(kGround.tile_units(0));
  const proto::Samples small{side / 2, side / 2, 20, 20, std::vector<std::int32_t>(400, 5), {}};
  EXPECT_TRUE(uncovered_inside(kGround, all, void_grid(1, side), small, part_in_window(kGround, all, small)).empty());
  const proto::TileAddress fine{12, (side / 2) / 256, (side / 2) / 256};
  EXPECT_EQ(uncovered_inside(kGround, fine, void_grid(4, 64), small, part_in_window(kGround, fine, small)).size(), 18u * 18u);
}

}  // namespace
}  // namespace cordillera::pipeline
