// Samples and heights as the floors hand them to each other.
#include "proto/mesh.h"

#include <gtest/gtest.h>

namespace cordillera::proto {
namespace {

TEST(Samples, AreFoundByLatticeVertexFromTheSouthWest) {
  Samples samples;
  samples.west = 1'000'000'007;
  samples.south = 500'000'009;
  samples.columns = 3;
  samples.rows = 2;
  samples.height = {10, 11, 12, 20, kNoHeight, 22};
  EXPECT_EQ(samples.at(samples.west, samples.south), 10);
  EXPECT_EQ(samples.at(samples.west + 2, samples.south), 12);
  EXPECT_EQ(samples.at(samples.west, samples.south + 1), 20);
  EXPECT_EQ(samples.at(samples.west + 1, samples.south + 1), kNoHeight);
  EXPECT_EQ(samples.at(samples.west + 2, samples.south + 1), 22);
}

TEST(Heights, OfAllTerrainAreExactInFloat32) {
  const auto most = static_cast<std::int32_t>(kMaxHeight_m / kHeightStep_m);
  EXPECT_EQ(most, 1 << 24);
  for (const std::int32_t h : {most, most - 1, -most, 1 - most}) EXPECT_EQ(static_cast<std::int32_t>(static_cast<float>(h)), h);
  EXPECT_LT(kNoHeight, -most);
}

TEST(VertexMarks, AreBitsOfTheirOwn) {
  for (const int mark : {kVoid, kKeep}) EXPECT_TRUE(mark > 0 && (mark & (mark - 1)) == 0) << mark;
  EXPECT_EQ(kVoid & kKeep, 0);
}

}  // namespace
}  // namespace cordillera::proto
