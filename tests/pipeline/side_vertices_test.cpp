// Samples that become vertices on the side of two tiles: the same in both, and the side no farther from its samples than before.
#include "pipeline/finest/side_vertices.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <map>

namespace cordillera::pipeline {
namespace {

constexpr int kLevel = 12;
constexpr std::int32_t kTileSide = 256;
constexpr std::int32_t kBeyond = 3;  // columns of samples west of the first tile
constexpr proto::TileAddress kWest{kLevel, 4000, 1500}, kEast{kLevel, 4001, 1500}, kNorth{kLevel, 4000, 1501};

/// Along the side between west and east: a hill with teeth.
std::int32_t height_at(std::int64_t along) {
  return static_cast<std::int32_t>(
      std::lround(20000 * std::sin(static_cast<double>(along) / 90) + 300 * static_cast<double>(along % 7)));
}

/// Two triangles over a tile, whose corners are samples.
BuiltTile bare(const proto::TileAddress& at, const proto::Samples& samples) {
  const proto::Lattice lattice{kLevel};
  BuiltTile built;
  built.tile = at;
  built.mesh.side = kTileSide;
  for (const auto& [x, y] : {std::pair{0, 0}, {kTileSide, 0}, {kTileSide, kTileSide}, {0, kTileSide}}) {
    built.mesh.x.push_back(x), built.mesh.y.push_back(y);
    built.mesh.height.push_back(samples.at(lattice.west(at) + x, lattice.south(at) + y));
    built.mesh.mark.push_back(0);
  }
  built.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  return built;
}

class SideVertices : public testing::Test {
 protected:
  SideVertices() {
    samples_ = {lattice_.west(kWest) - kBeyond, lattice_.south(kWest), 2 * kTileSide + 1 + kBeyond, 2 * kTileSide + 1, {}, {}};
    for (std::int64_t j = 0; j <= 2 * kTileSide; ++j)
      for (std::int64_t i = -kBeyond; i <= 2 * kTileSide; ++i)
        samples_.height.push_back(height_at(j) + static_cast<std::int32_t>(std::abs(i - kTileSide)));
    level_.set_level(kLevel);
    level_.set_target(10);
    for (const proto::TileAddress& at : {kWest, kEast, kNorth}) tiles_.push_back(bare(at, samples_));
    context_ = {&lattice_, &level_, &samples_};
  }

  std::vector<std::size_t> changed_by(const std::vector<std::vector<gpu::MeshPoint>>& on_sides) {
    std::vector<std::size_t> changed;
    for (const auto& [k, tile] : put_on_sides(context_, tiles_, on_sides)) changed.push_back(k);
    return changed;
  }
  static std::map<std::int32_t, std::int32_t> line(const proto::TileMesh& mesh, std::int32_t x) {
    std::map<std::int32_t, std::int32_t> vertices;
    for (std::uint32_t v = 0; v < mesh.vertices(); ++v) {
      if (mesh.x[v] == x) vertices[mesh.y[v]] = mesh.height[v];
    }
    return vertices;
  }
  double farthest(const std::map<std::int32_t, std::int32_t>& vertices) const {
    double most = 0;
    for (auto a = vertices.begin(), b = std::next(a); b != vertices.end(); ++a, ++b) {
      for (std::int32_t y = a->first; y <= b->first; ++y) {
        const double at = a->second + static_cast<double>(b->second - a->second) * (y - a->first) / (b->first - a->first);
        most = std::max(most, std::abs(at - samples_.at(lattice_.west(kEast), lattice_.south(kEast) + y)));
      }
    }
    return most;
  }

  const proto::Lattice lattice_{kLevel};
  proto::Samples samples_;
  proto::LevelPlan level_;
  LevelContext context_;
  std::vector<BuiltTile> tiles_;
};

TEST_F(SideVertices, are_the_same_in_both_tiles_and_the_side_is_no_farther_from_its_samples) {
  const double before = farthest(line(tiles_[0].mesh, kTileSide));
  EXPECT_EQ(changed_by({{{kTileSide, 100, height_at(100)}}, {}, {}}), (std::vector<std::size_t>{0, 1}));
  const auto west = line(tiles_[0].mesh, kTileSide), east = line(tiles_[1].mesh, 0);
  EXPECT_EQ(west, east);
  EXPECT_TRUE(west.contains(100));
  EXPECT_LE(farthest(west), before);
  EXPECT_LT(west.size(), 12u) << "no more than that takes";
  EXPECT_EQ(line(tiles_[2].mesh, kTileSide).size(), 2u) << "another side";
  EXPECT_TRUE(put_on_sides(context_, tiles_, {{{kTileSide, 100, height_at(100)}}, {}, {}}).empty()) << "it is a vertex already";
  EXPECT_EQ(changed_by({{}, {}, {{50, 0, 0}}}), (std::vector<std::size_t>{0, 2})) << "a side that runs east";
}

// What pixels want comes after what samples are promised.
TEST_F(SideVertices, go_out_again_where_a_tile_is_above_its_target_then) {
  const std::vector<BuiltTile> before = tiles_;
  Workers workers(2);
  for (const double error_m : {10.0, 11.0}) {
    tiles_ = before;
    std::array<std::atomic<int>, 3> finished{};
    finish_with_sides(context_, tiles_, workers, [&](std::size_t k, unsigned) {
      ++finished[k];
      const bool is_cut = tiles_[k].mesh.vertices() > before[k].mesh.vertices();
      tiles_[k].max_error_m = k == 1 && is_cut ? error_m : 9;
      return k == 0 && !is_cut ? std::vector<gpu::MeshPoint>{{kTileSide, 100, height_at(100)}} : std::vector<gpu::MeshPoint>();
    });
    const bool stays = error_m <= level_.target();
    for (const std::size_t k : {0, 1}) {
      EXPECT_EQ(tiles_[k].mesh.vertices() > before[k].mesh.vertices(), stays) << error_m;
      EXPECT_EQ(finished[k], stays ? 2 : 3) << "what is encoded is of the mesh that stays";
      EXPECT_LE(tiles_[k].max_error_m, level_.target());
    }
    EXPECT_EQ(finished[2], 1);
  }
}

// A raster whose rim runs along a side: nothing is beyond it.
TEST_F(SideVertices, go_in_alone_where_the_mesh_ends) {
  const auto at = [&](std::int64_t i, std::int64_t j) -> std::int32_t& {
    return samples_.height[static_cast<std::size_t>(j * samples_.columns + kBeyond + i)];
  };
  for (std::int64_t j = 0; j <= 2 * kTileSide; ++j) {
    for (std::int64_t i = -kBeyond; i < 0; ++i) at(i, j) = proto::kNoHeight;
  }
  EXPECT_EQ(changed_by({{{0, 100, at(0, 100)}}, {}, {}}), (std::vector<std::size_t>{0}));
  EXPECT_TRUE(line(tiles_[0].mesh, 0).contains(100));
  EXPECT_EQ(line(tiles_[0].mesh, kTileSide).size(), 2u);
  at(-1, 170) = 0;
  EXPECT_TRUE(put_on_sides(context_, tiles_, {{{0, 160, at(0, 160)}}, {}, {}}).empty()) << "there may be a triangle";
}

TEST_F(SideVertices, go_in_on_both_sides_or_not_at_all) {
  const auto stays = [&](const std::vector<std::vector<gpu::MeshPoint>>& on_sides) {
    const std::size_t before = tiles_[0].mesh.vertices() + tiles_[1].mesh.vertices();
    return put_on_sides(context_, tiles_, on_sides).empty() && tiles_[0].mesh.vertices() + tiles_[1].mesh.vertices() == before;
  };
  EXPECT_TRUE(stays({{{0, 100, 0}}, {}, {}})) << "the tile beyond is not there";
  tiles_[1].mesh.height[0] += 5;
  EXPECT_TRUE(stays({{{kTileSide, 100, 0}}, {}, {}})) << "the tile beyond has another side";
  tiles_[1].mesh.height[0] -= 5;
  const auto at = static_cast<std::size_t>(200 * samples_.columns + kBeyond + kTileSide);
  const std::int32_t kept = samples_.height[at];
  samples_.height[at] = proto::kNoHeight;
  EXPECT_TRUE(stays({{{kTileSide, 100, 0}}, {}, {}})) << "the edge passes a void";
  samples_.height[at] = kept;
  EXPECT_FALSE(stays({{{kTileSide, 100, 0}}, {}, {}}));
}

}  // namespace
}  // namespace cordillera::pipeline
