// What an exact block leaves for the levels above it, in bytes and back.
#include "pipeline/build/exact/kept_block.h"

#include <gtest/gtest.h>

#include <random>

#include "gpu/exact/steps/coded.h"

namespace cordillera::pipeline {
namespace {

constexpr std::int32_t kUnitsOfSide = 64;
constexpr std::size_t kSquares = (kUnitsOfSide / 8 + 1) * (kUnitsOfSide / 8 + 1);
constexpr float kUnit = 20;

KeptBlock made_block() {
  std::mt19937 random(3);
  KeptBlock block;
  block.mesh.side = kUnitsOfSide;
  block.mesh.x = {0, kUnitsOfSide, kUnitsOfSide, 0}, block.mesh.y = {0, 0, kUnitsOfSide, kUnitsOfSide};
  block.mesh.height = {1, 2, 3, 4}, block.mesh.mark = {0, 0, 0, 0};
  block.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  for (std::size_t s = 0; s < kSquares; ++s) {
    const float off = static_cast<float>(random() % 4000) / 40;
    block.squares.plane.push_back({static_cast<float>(s), 1, 2, off});
    block.squares.depth.push_back(static_cast<std::uint8_t>(s % 15));
    for (int k = 0; k < 64; ++k) block.squares.code.push_back(static_cast<std::uint8_t>(random()));
  }
  return block;
}

TEST(KeptBlock, ComesBackAsNearAsItsUnitSays) {
  const KeptBlock block = made_block();
  const auto read = kept_block_from(to_bytes(block, kUnit), kUnitsOfSide, kUnit);
  ASSERT_TRUE(read.ok()) << read.problem().line();
  EXPECT_EQ(read->mesh.triangles, block.mesh.triangles);
  EXPECT_EQ(read->mesh.height, block.mesh.height);
  EXPECT_EQ(read->squares.depth, block.squares.depth);
  ASSERT_EQ(read->squares.plane.size(), kSquares);
  std::size_t changed = 0;
  for (std::size_t k = 0; k < block.squares.code.size(); ++k) {
    const float off = read->squares.plane[k / 64].off;
    EXPECT_EQ(off, block.squares.plane[k / 64].off);
    const int steps = gpu::exact::code_steps(off, kUnit);
    EXPECT_EQ(read->squares.code[k], gpu::exact::coarser_code(block.squares.code[k], steps));
    changed += read->squares.code[k] != block.squares.code[k] ? 1 : 0;
  }
  EXPECT_GT(changed, block.squares.code.size() / 2);
}

TEST(KeptBlock, IsReadInParts) {
  const std::string bytes = to_bytes(made_block(), kUnit);
  const auto mesh = kept_block_from(bytes, kUnitsOfSide, kUnit, KeptParts::mesh);
  const auto squares = kept_block_from(bytes, kUnitsOfSide, kUnit, KeptParts::squares);
  ASSERT_TRUE(mesh.ok() && squares.ok());
  EXPECT_EQ(mesh->mesh.triangles.size(), 2u);
  EXPECT_TRUE(mesh->squares.plane.empty());
  EXPECT_TRUE(squares->mesh.triangles.empty());
  EXPECT_EQ(squares->squares.plane.size(), kSquares);
}

TEST(KeptBlock, IsRefusedWhereItIsAnother) {
  const std::string bytes = to_bytes(made_block(), kUnit);
  EXPECT_FALSE(kept_block_from(bytes, 2 * kUnitsOfSide, kUnit).ok());
  EXPECT_FALSE(kept_block_from(bytes, kUnitsOfSide, 2 * kUnit).ok());
  EXPECT_FALSE(kept_block_from(bytes.substr(0, bytes.size() - 20), kUnitsOfSide, kUnit).ok());
  KeptBlock fewer = made_block();
  fewer.squares.code.resize(64);
  fewer.squares.plane.resize(1);
  const auto refused = kept_block_from(to_bytes(fewer, kUnit), kUnitsOfSide, kUnit);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "store-damaged");
}

}  // namespace
}  // namespace cordillera::pipeline
