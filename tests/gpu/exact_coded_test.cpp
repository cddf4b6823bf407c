// Samples above blocks, a byte each: how far they are from what their byte says.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdint>
#include <random>
#include <set>
#include <vector>

#include "gpu/exact/steps/coded.h"

namespace cordillera::gpu::exact {
namespace {

/// A square of 8 samples around a plane, as far as it leaves open.
struct MadeSquare {
  explicit MadeSquare(float off) {
    std::mt19937 random(static_cast<unsigned>(off) + 5);
    std::uniform_real_distribution<float> any(-off, off);
    plane = {1000, 3, -7, off};
    for (int k = 0; k < 64; ++k) height.push_back(plane.at(k & 7, k >> 3) + any(random));
    height.front() = plane.at(0, 0) + off, height.back() = plane.at(7, 7) - off;
    field.columns = field.rows = field.stride = 8;
    field.tier_stride[0] = 1;
    field.plane[0] = &plane;
    field.height = height.data();
    CodeSamples{field, code.data()}(0);
  }
  Field coded(float unit) {
    for (std::uint8_t& c : code) c = coarser_code(c, code_steps(plane.off, unit));
    Field above = field;
    above.height = nullptr, above.code = code.data(), above.code_unit = unit;
    return above;
  }

  BoundingPlane plane;
  std::vector<float> height;
  std::vector<std::uint8_t> code = std::vector<std::uint8_t>(64);
  Field field;
};

TEST(CodedSamples, AreAsNearAsTheirErrorSays) {
  for (const float off : {0.0f, 0.5f, 3.0f, 40.0f, 700.0f, 12345.0f, 3e6f}) {
    for (const float unit : {0.0f, 0.01f, 1.0f, 5.0f, 77.0f, 400.0f, 1e5f}) {
      MadeSquare square(off);
      const float error = code_error(square.plane, unit);
      EXPECT_LE(error, 1.0001f * (std::max(unit, 0.5f * off / kCodeSteps) + off / kCodeSteps) + 1) << off << " by " << unit;
      const Field above = square.coded(unit);
      for (int y = 0; y < 8; ++y) {
        for (int x = 0; x < 8; ++x) {
          EXPECT_FALSE(above.is_void_there(x, y));
          ASSERT_LE(magnitude(above.height_at(x, y) - square.height[8 * y + x]), error) << off << " by " << unit;
        }
      }
    }
  }
}

TEST(CodedSamples, AreFewKindsWhereLittleIsAsked) {
  const auto kinds = [](float off, float unit) {
    MadeSquare square(off);
    square.coded(unit);
    return std::set(square.code.begin(), square.code.end()).size();
  };
  EXPECT_EQ(kinds(70, 77), 1u);
  EXPECT_LE(kinds(140, 77), 3u);
  EXPECT_GT(kinds(140, 77), 1u);
  EXPECT_LE(kinds(700, 77), 15u);
  EXPECT_GT(kinds(700, 0), 30u);
}

TEST(CodedSamples, StayVoid) {
  for (const int steps : {0, 1, 3, 7, 15, 31, 63, 127}) {
    EXPECT_EQ(coarser_code(kCodedVoid, steps), kCodedVoid);
    for (int code = 1; code < 256; ++code) {
      EXPECT_NE(coarser_code(static_cast<std::uint8_t>(code), steps), kCodedVoid) << code << " in " << steps;
      // The plane lies in the middle, and what is above it stays above.
      const int other = coarser_code(static_cast<std::uint8_t>(256 - code), steps);
      EXPECT_EQ(coarser_code(static_cast<std::uint8_t>(code), steps) + other, 256) << code << " in " << steps;
    }
  }
}

}  // namespace
}  // namespace cordillera::gpu::exact
