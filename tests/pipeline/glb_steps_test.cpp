// Points of one .glb that are rounded to several steps.
#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <stdexcept>

#include "pipeline/encode/decode.h"
#include "pipeline/encode/encode.h"
#include "tests/pipeline/encode_synthetic.h"
#include "tests/pipeline/triangle_soup.h"

namespace cordillera::pipeline {
namespace {

using proto::Lattice;
using proto::TileAddress;
using proto::TileMesh;
using proto::Vec3;
using testing::encode_input;
using testing::hills;
using testing::Key;
using testing::key;
using testing::soup;
using testing::synthetic_mesh;

/// A tile of hills.
struct Hills {
  static constexpr std::int32_t kCells = 32;
  const Lattice lattice;
  const TileAddress address;
  const gpu::EcefSteps steps;
  TileMesh mesh = synthetic_mesh(lattice, address, kCells, hills());

  EncodeInput input() const {
    EncodeInput input = encode_input(lattice, address, mesh);
    input.ecef_steps = steps;
    return input;
  }
  Vec3 point(std::size_t v) const {
    return proto::ecef(proto::row_frame(lattice, lattice.south(address) + mesh.y[v]),
                       proto::column_frame(lattice, lattice.west(address) + mesh.x[v]), height_m(v));
  }
  double height_m(std::size_t v) const { return mesh.height[v] * proto::kHeightStep_m; }
};

Key rounded_to(double step_m, const Vec3& point) {
  Key rounded = key(point);
  for (double& c : rounded) c = std::nearbyint(c / step_m) * step_m;
  return rounded;
}

/// Of which some vertices lie kilometres below or above.
Hills spiked(std::int32_t tile_y = 100000) {
  Hills made{Lattice{17}, {17, 139000, tile_y}, {std::ldexp(1, -12), std::ldexp(1, -8), 900, 512, 480}};
  const auto height = [&](std::int32_t x, std::int32_t y) -> std::int32_t& {
    return made.mesh.height[static_cast<std::size_t>(y * (Hills::kCells + 1) + x)];
  };
  std::int32_t place = 1;
  for (const int km : {-16, -9, -4, -2, 2, 3, 6, 16}) {
    height(place, place) = km * 1'024'000 + 1;
    height(Hills::kCells - place, place) = km * 1'023'000 + 3;
    place += 3;
  }
  return made;
}

// 32 km are more steps than Draco has bits for.
TEST(EncodeGlb, PointsFarBelowAndAboveTheOthersAreMultiplesOfGreaterSteps) {
  const Hills tile = spiked();
  const auto glb = decode_glb(encode_glb(tile.input()));
  ASSERT_TRUE(glb.ok()) << glb.problem().detail;
  std::vector<Key> expected, decoded;
  std::set<double> steps;
  for (std::size_t v = 0; v < tile.mesh.vertices(); ++v) {
    const double apart = std::abs(tile.height_m(v) - 900);
    const double step = std::ldexp(1, apart <= 512 ? -12 : apart <= 1024 ? -11 : apart <= 2048 ? -10 : apart <= 4096 ? -9 : -8);
    steps.insert(step);
    expected.push_back(rounded_to(step, tile.point(v)));
  }
  for (const Vec3& p : glb->points) decoded.push_back(key(p));
  EXPECT_EQ(soup(expected, tile.mesh.triangles), soup(decoded, glb->triangles));
  EXPECT_EQ(steps.size(), 5U);
}

/// All of a .glb beside a pole is where step_m says, but for the pole itself: it is one point of many vertices.
template <class StepOf>
void expect_beside_pole(const Hills& tile, const StepOf& step_m, std::set<double>& steps) {
  const auto glb = decode_glb(encode_glb(tile.input()));
  ASSERT_TRUE(glb.ok()) << glb.problem().detail;
  std::set<Key> expected, decoded;
  for (std::size_t v = 0; v < tile.mesh.vertices(); ++v) {
    const double step = step_m(tile.point(v), tile.height_m(v));
    steps.insert(step);
    if (tile.mesh.y[v] < tile.mesh.side) expected.insert(rounded_to(step, tile.point(v)));
  }
  for (const Vec3& p : glb->points) {
    if (std::hypot(p.x, p.y) > 1) decoded.insert(key(p));
  }
  EXPECT_EQ(expected, decoded);
}

// Columns are closer than any step there; and tiles that share a point round it in one way, so that its place alone decides.
TEST(EncodeGlb, PointsBesideAPoleAreMultiplesOfSmallerSteps) {
  const Hills tile{Lattice{9}, {2, 5, 3}, {8, 8, 500, INFINITY, 0x1p22}};  // from the pole to 45 degrees
  const auto step_m = [](const Vec3& p, double) {
    const double apart_m = std::hypot(p.x, p.y, p.z - proto::kSemiMinor_m - 500);
    double step = 8;
    for (double reach = 0x1p22; apart_m < reach && step > 0.125; reach /= 2) step /= 2;
    return step;
  };
  std::set<double> steps;
  expect_beside_pole(tile, step_m, steps);
  EXPECT_EQ(steps.size(), 7U) << "from 8 m to an eighth";
}

// The smallest steps would be too many from a spike's foot to its top.
TEST(EncodeGlb, PointsFarBelowAndAboveAPoleAreMultiplesOfGreaterSteps) {
  const Hills tile = spiked(131071);
  std::set<double> steps;
  expect_beside_pole(
      tile, [&](const Vec3& p, double height_m) { return tile.steps.at(p, height_m); }, steps);
  EXPECT_EQ(*steps.rbegin(), 0x1p-8);
  EXPECT_EQ(*steps.begin(), 0x1p-14);
}

TEST(EncodeGlb, WithTheFinestStepAloneTheyDoNotFit) {
  const Hills tile = spiked();
  EncodeInput input = tile.input();
  input.ecef_steps = tile.steps.finest_m;
  EXPECT_THROW(encode_glb(input), std::invalid_argument);
}

}  // namespace
}  // namespace cordillera::pipeline
