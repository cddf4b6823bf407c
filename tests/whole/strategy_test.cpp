// The published algorithm in the place of exact: the laws hold and errors are stated as truly, in holes and above the blocks,
// too.
#include <gmock/gmock.h>

#include <cmath>

#include "gpu/cleap/tile_simplifier.h"
#include "pipeline/build/build.h"
#include "tests/whole/bytes.h"
#include "tests/whole/judge.h"

namespace cordillera::whole {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;

/// Three by two tiles, with ragged holes in a part of them and one over the corner of four.
Dem with_holes() {
  const HeightOf ground = rough(8), gaps = rough(9);
  const auto height = [=](int c, int r) {
    const bool hole = std::hypot(c - 226, r - 150) < 25 || (c > 260 && gaps(3 * c, 3 * r) > 900);
    return hole ? kNoData : ground(c, r);
  };
  return points_of(kCorner, 400, 300, height);
}

proto::BuildOptions with_strategy(const std::string& strategy, double error_m) {
  proto::BuildOptions options = with_error(error_m);
  options.set_strategy(strategy);
  return options;
}

/// For the tests of all files of this program.
const bool kOffered = (gpu::cleap::offer_strategies(), true);

class Strategy : public testing::TestWithParam<const char*> {
 protected:
  Strategy() { EXPECT_TRUE(kOffered); }
};

TEST_P(Strategy, obeys_every_law_and_keeps_its_promise) {
  const Built built = build_dem(with_holes(), with_strategy(GetParam(), 10));
  EXPECT_THAT(judge(built, {20000, 1.25}), IsEmpty());
  EXPECT_EQ(built.manifest.options().strategy(), GetParam());
  for (const auto& [z, level] : built.levels)
    EXPECT_FALSE(covered(built, z, 9001 * kTile, 6000 * kTile)) << "the hole of level " << z;
  EXPECT_LT(built.triangles(13), 400u * 300 * 2 / 4);
}

TEST_P(Strategy, gives_the_share_that_was_asked_for) {
  proto::BuildOptions options = plain_options();
  options.set_strategy(GetParam());
  options.add_keep(0.2);
  options.set_min_level(13);  // a pilot looks for the share on every level
  const Built built = build_dem(points_of(kCorner, 180, 120, rough(3)), options);
  EXPECT_THAT(judge(built, {20000, 0}), IsEmpty());
  EXPECT_NEAR(static_cast<double>(built.triangles(13)), 0.2 * 2 * 179 * 119, 0.02 * 2 * 179 * 119);
}

INSTANTIATE_TEST_SUITE_P(Names, Strategy, testing::Values("cleap", "sequential"));

class StrategyBytes : public testing::Test {
 protected:
  StrategyBytes() {
    write(with_holes(), folder_.path("dem.tif"));
    request_.raster_path = folder_.path("dem.tif");
    request_.raster_name = "dem.tif";
    request_.id = "test";
    request_.options = with_error(20);
    request_.options.set_max_level(13);
    request_.options.set_min_level(12);
  }
  proto::Result<proto::Manifest> build(const std::string& strategy, unsigned threads) {
    request_.options.set_strategy(strategy);
    request_.options.set_threads(threads);
    request_.store_path = folder_.path(strategy + std::to_string(threads));
    return pipeline::build(request_, nullptr, never_);
  }
  Bytes bytes(const std::string& strategy, unsigned threads) {
    const auto built = build(strategy, threads);
    EXPECT_TRUE(built.ok()) << built.problem().line();
    return published(request_.store_path);
  }

  Folder folder_;
  pipeline::BuildRequest request_;
  const std::atomic<bool> never_ = false;
};

TEST_F(StrategyBytes, are_the_same_on_any_threads_and_other_than_those_of_exact) {
  const Bytes one = bytes("cleap", 1);
  EXPECT_GT(one.size(), 10u);
  EXPECT_EQ(one, bytes("cleap", 3));
  EXPECT_NE(one, bytes("exact", 2));
  EXPECT_NE(one, bytes("sequential", 2));
}

TEST_F(StrategyBytes, what_is_not_there_or_cannot_be_is_said) {
  const auto unknown = build("magic", 1);
  ASSERT_FALSE(unknown.ok());
  EXPECT_EQ(unknown.problem().type, "option-invalid");
  EXPECT_THAT(unknown.problem().accepted, HasSubstr("exact, cleap, sequential"));
  request_.options.set_device("cuda");
  const auto alone = build("sequential", 1);
  ASSERT_FALSE(alone.ok());
  EXPECT_EQ(alone.problem().type, "options-conflict");
  EXPECT_EQ(alone.problem().parameter, "device");
}

}  // namespace
}  // namespace cordillera::whole
