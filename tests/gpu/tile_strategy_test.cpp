// The published algorithm on tiles: laws, holes, borders, batches, bits.
#include <gtest/gtest.h>

#include <cmath>

#include "gpu/cleap/tile_simplifier.h"
#include "gpu/simplify.h"
#include "tests/bench/mesh_hash.h"
#include "tests/bench/terrain.h"
#include "tests/gpu/grid_mesh.h"
#include "tests/pipeline/mesh_laws.h"

namespace cordillera::gpu {
namespace {

constexpr int kCells = 64;

struct Tile {
  proto::TileMesh mesh;
  std::vector<float> elevation;

  SimplifyJob job(float tolerance_m) const {
    SimplifyJob job;
    job.input = &mesh;
    job.elevation = elevation;
    job.unit_m = 30;
    job.tolerance_m = tolerance_m;
    job.rim_units = 0.5F;
    return job;
  }
};

/// hole: a disc without data.
Tile tile(bench::Terrain kind, int hole = 0) {
  std::vector<std::int32_t> heights;
  for (int y = 0; y <= kCells; ++y) {
    for (int x = 0; x <= kCells; ++x) {
      heights.push_back(std::hypot(x - 30, y - 34) < hole ? proto::kNoHeight : bench::terrain_height(kind, x + 300, y + 300));
    }
  }
  Tile tile{grid_mesh(kCells, 1, heights), {}};
  for (std::uint32_t v = 0; v < tile.mesh.vertices(); ++v) {
    tile.elevation.push_back(static_cast<float>(tile.mesh.height[v]) / 1024);
    const int x = tile.mesh.x[v], y = tile.mesh.y[v];
    const bool side = x % kCells == 0 || y % kCells == 0;
    if (side) tile.mesh.mark[v] |= proto::kKeep;
  }
  return tile;
}

proto::Result<std::unique_ptr<Simplifier>> made(const std::string& device, const std::string& strategy) {
  cleap::offer_strategies();
  return make_simplifier(device, one_after_the_other, strategy);
}

std::unique_ptr<Simplifier> simplifier(const std::string& strategy) { return std::move(made("cpu", strategy)).value(); }

class TileStrategy : public testing::TestWithParam<const char*> {};

TEST_P(TileStrategy, KeepsTheLawsTheBorderAndTheInputsPlaces) {
  for (const bench::Terrain kind : {bench::Terrain::alpine, bench::Terrain::islands, bench::Terrain::plane}) {
    for (const int hole : {0, 12}) {
      const Tile in = tile(kind, hole);
      const SimplifyJob job = in.job(5);
      const proto::TileMesh out = simplifier(GetParam())->simplify({&job, 1}).front();
      SCOPED_TRACE(std::string(bench::kTerrainNames[static_cast<int>(kind)]) + " hole " + std::to_string(hole));
      EXPECT_EQ(test::broken_law(out), "");
      EXPECT_LT(out.vertices(), in.mesh.vertices() / 2);
      std::size_t kept = 0;
      for (std::uint32_t v = 0; v < out.vertices(); ++v) {
        if (v > 0) {
          EXPECT_LT(std::pair(out.y[v - 1], out.x[v - 1]), std::pair(out.y[v], out.x[v])) << "not in the input's order";
        }
        kept += (out.mark[v] & proto::kKeep) != 0;
        const std::size_t at = static_cast<std::size_t>(out.y[v]) * (kCells + 1) + static_cast<std::size_t>(out.x[v]);
        EXPECT_EQ(out.height[v], in.mesh.height[at]);
      }
      EXPECT_EQ(kept, 4u * kCells);
    }
  }
}

TEST_P(TileStrategy, RimsStayWithinWhatTheyMayMove) {
  const Tile in = tile(bench::Terrain::alpine, 12);
  for (const float rim_units : {0.5F, 4.0F}) {
    SimplifyJob job = in.job(20);
    job.rim_units = rim_units;
    const proto::TileMesh out = simplifier(GetParam())->simplify({&job, 1}).front();
    double farthest = 0;  // of a rim vertex from the circle
    for (const auto& t : out.triangles) {
      int voids = 0;
      for (const std::uint32_t v : t) voids += is_void(out, v);
      if (voids == 0 || voids == 3) continue;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3];
        if (is_void(out, a) || is_void(out, b)) continue;
        const double middle = std::hypot((out.x[a] + out.x[b]) / 2.0 - 30, (out.y[a] + out.y[b]) / 2.0 - 34);
        farthest = std::max(farthest, std::abs(middle - 12.5));
      }
    }
    EXPECT_LE(farthest, 1.2 + static_cast<double>(rim_units));
  }
}

TEST_P(TileStrategy, ToleranceSaysHowManyStay) {
  const Tile in = tile(bench::Terrain::rolling);
  std::size_t before = SIZE_MAX;
  for (const float tolerance_m : {0.05F, 0.2F, 0.8F, 3.2F}) {
    const SimplifyJob job = in.job(tolerance_m);
    const std::size_t left = simplifier(GetParam())->simplify({&job, 1}).front().vertices();
    EXPECT_LT(left, before);
    before = left;
  }
}

TEST_P(TileStrategy, ResultsDoNotDependOnTheBatch) {
  const Tile one = tile(bench::Terrain::alpine), two = tile(bench::Terrain::islands, 9);
  const std::vector<SimplifyJob> jobs{one.job(5), two.job(3)};
  const auto together = simplifier(GetParam())->simplify(jobs);
  for (std::size_t k = 0; k < 2; ++k) {
    const auto alone = simplifier(GetParam())->simplify({&jobs[k], 1});
    EXPECT_EQ(alone.front().triangles, together[k].triangles);
    EXPECT_EQ(alone.front().x, together[k].x);
  }
}

INSTANTIATE_TEST_SUITE_P(Names, TileStrategy, testing::Values("cleap", "sequential"));

std::uint64_t hash_on(Simplifier& simplifier, bench::Terrain kind, int hole = 0) {
  const Tile in = tile(kind, hole);
  const SimplifyJob job = in.job(1);
  const proto::TileMesh mesh = simplifier.simplify({&job, 1}).front();
  return bench::hash_of(
      {{mesh.x.begin(), mesh.x.end()}, {mesh.y.begin(), mesh.y.end()}, {mesh.height.begin(), mesh.height.end()}, mesh.triangles});
}

TEST(TileStrategyBits, AreThoseThatWereRecorded) {
  EXPECT_EQ(hash_on(*simplifier("cleap"), bench::Terrain::alpine), 0xc554e33f04988714u);
  EXPECT_EQ(hash_on(*simplifier("cleap"), bench::Terrain::islands, 12), 0xddbf7c4b95d3aeb5u);
}

TEST(TileStrategyBits, AreTheSameOnCuda) {
  const auto cuda = made("cuda", "cleap");
  if (!cuda.ok()) GTEST_SKIP() << "no CUDA device: " << cuda.problem().detail;
  for (int kind = 0; kind < 6; ++kind) {
    const auto terrain = static_cast<bench::Terrain>(kind);
    for (const int hole : {0, 12})
      EXPECT_EQ(hash_on(**cuda, terrain, hole), hash_on(*simplifier("cleap"), terrain, hole)) << bench::kTerrainNames[kind];
  }
}

TEST(TileStrategyBits, UnknownStrategiesAndWrongDevicesAreNamed) {
  const auto magic = made("cpu", "magic");
  ASSERT_FALSE(magic.ok());
  EXPECT_EQ(magic.problem().type, "option-invalid");
  EXPECT_EQ(magic.problem().accepted, "exact, cleap, sequential");
  const auto alone = made("cuda:0", "sequential");
  ASSERT_FALSE(alone.ok());
  EXPECT_EQ(alone.problem().type, "options-conflict");
  EXPECT_EQ((*made("auto", "sequential"))->device(), "cpu");
}

// The library of tiles does without them: a program that links nothing else can be asked for them all the same.
TEST(TileStrategyBits, AProgramWithoutThemSaysSo) {
  offer_published(nullptr);
  for (const char* strategy : {"cleap", "sequential"}) {
    const auto none = make_simplifier("cpu", one_after_the_other, strategy);
    ASSERT_FALSE(none.ok());
    EXPECT_EQ(none.problem().type, "option-invalid");
    EXPECT_EQ(none.problem().detail, std::string("strategy ") + strategy + " is not in this program");
  }
}

}  // namespace
}  // namespace cordillera::gpu
