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

/// A tile of hills of which some vertices lie kilometres below or above.
struct Spiked {
  static constexpr std::int32_t kCells = 32;
  const Lattice lattice{17};
  const TileAddress address;
  const gpu::EcefSteps steps{std::ldexp(1, -12), std::ldexp(1, -8), 900, 512, 480};
  TileMesh mesh = synthetic_mesh(lattice, address, kCells, hills());

  explicit Spiked(std::int32_t y = 100000) : address{17, 139000, y} {
    const auto height = [&](std::int32_t x, std::int32_t y) -> std::int32_t& {
      return mesh.height[static_cast<std::size_t>(y * (kCells + 1) + x)];
    };
    std::int32_t place = 1;
    for (const int km : {-16, -9, -4, -2, 2, 3, 6, 16}) {
      height(place, place) = km * 1'024'000 + 1;
      height(kCells - place, place) = km * 1'023'000 + 3;
      place += 3;
    }
  }
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

// 32 km are more steps than Draco has bits for.
TEST(EncodeGlb, PointsFarBelowAndAboveTheOthersAreMultiplesOfGreaterSteps) {
  const Spiked spiked;
  const auto glb = decode_glb(encode_glb(spiked.input()));
  ASSERT_TRUE(glb.ok()) << glb.problem().detail;
  std::vector<Key> expected, decoded;
  std::set<double> steps;
  for (std::size_t v = 0; v < spiked.mesh.vertices(); ++v) {
    const double apart = std::abs(spiked.height_m(v) - 900);
    const double step = std::ldexp(1, apart <= 512 ? -12 : apart <= 1024 ? -11 : apart <= 2048 ? -10 : apart <= 4096 ? -9 : -8);
    steps.insert(step);
    Key rounded = key(spiked.point(v));
    for (double& c : rounded) c = std::nearbyint(c / step) * step;
    expected.push_back(rounded);
  }
  for (const Vec3& p : glb->points) decoded.push_back(key(p));
  EXPECT_EQ(soup(expected, spiked.mesh.triangles), soup(decoded, glb->triangles));
  EXPECT_EQ(steps.size(), 5U);
}

/// A tile from a pole to 45 degrees, and the steps of its level: points halve them with the distance from the pole.
struct AtPole {
  static constexpr std::int32_t kCells = 32;
  const Lattice lattice{9};
  const TileAddress address{2, 5, 3};
  const gpu::EcefSteps steps{8, 8, 500, INFINITY, 0x1p22};
  TileMesh mesh = synthetic_mesh(lattice, address, kCells, hills());

  Vec3 point(std::size_t v) const {
    return proto::ecef(proto::row_frame(lattice, lattice.south(address) + mesh.y[v]),
                       proto::column_frame(lattice, lattice.west(address) + mesh.x[v]), height_m(v));
  }
  double height_m(std::size_t v) const { return mesh.height[v] * proto::kHeightStep_m; }
  double step_m(std::size_t v) const {
    const Vec3 p = point(v);
    const double apart_m = std::hypot(p.x, p.y, p.z - proto::kSemiMinor_m - 500);
    double step = 8;
    for (double reach = 0x1p22; apart_m < reach && step > 0.125; reach /= 2) step /= 2;
    return step;
  }
};

// Columns are closer than any step there; and tiles that share a point round it in one way, so that its place alone decides.
TEST(EncodeGlb, PointsBesideAPoleAreMultiplesOfSmallerSteps) {
  AtPole at_pole;
  EncodeInput input = encode_input(at_pole.lattice, at_pole.address, at_pole.mesh);
  input.ecef_steps = at_pole.steps;
  const auto glb = decode_glb(encode_glb(input));
  ASSERT_TRUE(glb.ok()) << glb.problem().detail;
  std::set<Key> expected, decoded;
  std::set<double> steps;
  for (std::size_t v = 0; v < at_pole.mesh.vertices(); ++v) {
    const double step = at_pole.step_m(v);
    steps.insert(step);
    Key rounded = key(at_pole.point(v));
    for (double& c : rounded) c = std::nearbyint(c / step) * step;
    if (at_pole.mesh.y[v] < at_pole.mesh.side) expected.insert(rounded);
  }
  for (const Vec3& p : glb->points) {
    if (std::hypot(p.x, p.y) > 1) decoded.insert(key(p));  // a pole is one point of many vertices
  }
  EXPECT_EQ(expected, decoded);
  EXPECT_EQ(steps.size(), 7U) << "from 8 m to an eighth";
}

// The smallest steps would be too many from a spike's foot to its top.
TEST(EncodeGlb, PointsFarBelowAndAboveAPoleAreMultiplesOfGreaterSteps) {
  const Spiked spiked(131071);
  const auto glb = decode_glb(encode_glb(spiked.input()));
  ASSERT_TRUE(glb.ok()) << glb.problem().detail;
  std::set<Key> expected, decoded;
  double least_m = 1, most_m = 0;
  for (std::size_t v = 0; v < spiked.mesh.vertices(); ++v) {
    if (spiked.mesh.y[v] == spiked.mesh.side) continue;
    const double step_m = spiked.steps.at(spiked.point(v), spiked.height_m(v));
    least_m = std::min(least_m, step_m), most_m = std::max(most_m, step_m);
    expected.insert(key(spiked.steps.rounded(spiked.point(v), spiked.height_m(v))));
  }
  for (const Vec3& p : glb->points) {
    if (std::hypot(p.x, p.y) > 1) decoded.insert(key(p));
  }
  EXPECT_EQ(expected, decoded);
  EXPECT_EQ(most_m, 0x1p-8);
  EXPECT_EQ(least_m, 0x1p-14);
}

TEST(EncodeGlb, WithTheFinestStepAloneTheyDoNotFit) {
  Spiked spiked;
  EncodeInput input = spiked.input();
  input.ecef_steps = spiked.steps.finest_m;
  EXPECT_THROW(encode_glb(input), std::invalid_argument);
}

}  // namespace
}  // namespace cordillera::pipeline
