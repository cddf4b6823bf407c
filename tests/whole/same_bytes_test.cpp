// Same bytes whatever the threads, and whether the build was stopped half-way.
#include <gmock/gmock.h>

#include <atomic>

#include "pipeline/build/build.h"
#include "pipeline/plan/plan.h"
#include "tests/whole/built.h"
#include "tests/whole/bytes.h"

namespace cordillera::whole {
namespace {

class SameBytes : public testing::Test {
 protected:
  SameBytes() {
    // Two patches so far from each other that a block does not hold both, with holes in them; each in a corner of its block,
    // which keeps the blocks small. Nothing is stored between.
    constexpr int kAcross = 4096 + 400;
    const HeightOf ground = rough(70), gaps = rough(71);
    const auto height = [&](int c, int r) {
      const bool west = c < 190 && r < 150, east = c >= kAcross - 190 && r >= kAcross - 170;
      return (west || east) && gaps(c, r) < 1100 ? ground(c, r) : kNoData;
    };
    const Corner corner{13, 9008 * kTile - 200, 6000 * kTile + 200};
    write(points_of(corner, kAcross, kAcross, height), folder_.path("dem.tif"));
    request_.raster_path = folder_.path("dem.tif");
    request_.raster_name = "dem.tif";
    request_.id = "test";
    request_.options = plain_options();
    request_.options.set_max_level(13);
  }
  Bytes build(const std::string& name, unsigned threads) {
    request_.options.set_threads(threads);
    request_.store_path = folder_.path(name);
    const auto built = pipeline::build(request_, nullptr, never_);
    EXPECT_TRUE(built.ok()) << built.problem().line();
    return published(request_.store_path);
  }
  /// Sets the stop flag at the n-th word of progress; whether that came in time.
  bool stopped(const std::string& name, int after) {
    request_.store_path = folder_.path(name);
    std::atomic<bool> stop = false;
    int calls = 0;
    const auto built = pipeline::build(
        request_, [&](const proto::Progress&) { stop = stop || ++calls >= after; }, stop);
    if (built.ok()) return false;
    EXPECT_EQ(built.problem().type, "cancelled");
    return true;
  }

  Folder folder_;
  pipeline::BuildRequest request_;
  const std::atomic<bool> never_ = false;
};

TEST_F(SameBytes, on_one_thread_and_on_four) { expect_same(build("one", 1), build("four", 4)); }

TEST_F(SameBytes, with_keep_on_one_thread_and_on_four) {
  for (const double share : {0.2, 0.05}) request_.options.add_keep(share);
  expect_same(build("one", 1), build("four", 4));
}

TEST_F(SameBytes, after_a_stop_and_another_start) {
  const auto source = raster::open_source(request_.raster_path, request_.raster_name, request_.trust, request_.options);
  ASSERT_TRUE(source.ok());
  EXPECT_GT(pipeline::make_plan(**source, request_.options)->block_level(), 0u) << "all is one block: nothing to stop between";
  const Bytes whole = build("whole", 2);
  int stops = 0;
  for (int after = 2; after < 20 && stopped("parts", after); ++after) ++stops;
  EXPECT_GT(stops, 1);
  expect_same(whole, build("parts", 2));
}

TEST_F(SameBytes, when_built_again) {
  const Bytes first = build("a", 2), second = build("b", 2), published_again = build("a", 2);
  expect_same(first, second);
  expect_same(first, published_again);
}

}  // namespace
}  // namespace cordillera::whole
