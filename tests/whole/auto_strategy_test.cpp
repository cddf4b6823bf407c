// strategy=auto is exact, whatever the raster and the other options are.
#include <gmock/gmock.h>

#include <filesystem>

#include "pipeline/build/build.h"
#include "pipeline/plan/plan.h"
#include "pipeline/work/work_plan.h"
#include "tests/whole/built.h"
#include "tests/whole/bytes.h"

namespace cordillera::whole {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

class AutoStrategy : public testing::Test {
 protected:
  AutoStrategy() {
    request_.raster_name = "dem.tif";
    request_.raster_path = folder_.path("dem.tif");
    request_.id = "test";
    request_.options = with_error(10);
    put(points_of(kCorner, 300, 200, rough(8)));
  }
  void put(const Dem& dem) {
    write(dem, request_.raster_path);
    request_.options.set_max_level(static_cast<std::uint32_t>(*dem.level));
  }
  proto::Manifest build(const std::string& strategy) {
    request_.options.set_strategy(strategy);
    request_.store_path = folder_.path(strategy);
    const auto built = pipeline::build(request_, nullptr, never_);
    EXPECT_TRUE(built.ok()) << built.problem().line();
    return built.ok() ? *built : proto::Manifest();
  }
  Bytes bytes(const std::string& strategy) { return published(folder_.path(strategy)); }
  /// auto builds what exact does.
  void expect_exact() {
    const proto::Manifest chosen = build("auto");
    EXPECT_EQ(chosen.options().strategy(), "exact");
    EXPECT_THAT(chosen.notes(), IsEmpty());
    build("exact");
    EXPECT_GT(bytes("auto").size(), 0u);
    EXPECT_EQ(bytes("auto"), bytes("exact"));
  }
  /// For planned().
  void examine() {
    request_.options.set_strategy("auto");
    auto member = raster::examine(request_.raster_path, "dem.tif", raster::Trust::operator_file, request_.options);
    ASSERT_TRUE(member.ok()) << member.problem().line();
    request_.members.push_back(*member);
  }
  proto::Plan planned(std::int64_t block_samples) {
    auto plan = pipeline::work::plan_work(request_, never_, {nullptr, block_samples, 0});
    EXPECT_TRUE(plan.ok()) << plan.problem().line();
    return plan.ok() ? plan->plan() : proto::Plan();
  }

  Folder folder_;
  pipeline::BuildRequest request_;
  const std::atomic<bool> never_ = false;
};

TEST_F(AutoStrategy, of_a_device_that_is_not_there_leaves_stores_alone) {
  build("auto");
  const Bytes before = bytes("auto");
  request_.options.set_error(20);  // another plan: its store would take the place of that one
  request_.options.set_device("cuda:99");
  EXPECT_EQ(pipeline::build(request_, nullptr, never_).problem().type, "device-unavailable");
  EXPECT_EQ(bytes("auto"), before);
  request_.store_path = folder_.path("fresh");
  EXPECT_EQ(pipeline::build(request_, nullptr, never_).problem().type, "device-unavailable");
  for (const auto& left : std::filesystem::directory_iterator(std::filesystem::path(request_.store_path).parent_path()))
    EXPECT_EQ(left.path().filename().string().find("fresh"), std::string::npos) << left.path();
}

TEST_F(AutoStrategy, is_exact) { expect_exact(); }

TEST_F(AutoStrategy, does_not_depend_on_memory_threads_or_device) {
  const auto source = pipeline::open_source(request_);
  ASSERT_TRUE(source.ok());
  request_.options.set_strategy("auto");
  const auto plan = pipeline::make_plan(**source, request_.options);
  ASSERT_TRUE(plan.ok());
  EXPECT_TRUE(plan->exact());
  request_.options.set_memory(64);
  request_.options.set_threads(7);
  request_.options.set_device("cpu");
  const auto elsewhere = pipeline::make_plan(**source, request_.options);
  ASSERT_TRUE(elsewhere.ok());
  EXPECT_EQ(plan->SerializeAsString(), elsewhere->SerializeAsString());
}

TEST_F(AutoStrategy, is_exact_for_shares) {
  put(points_of(kCorner, 60, 50, rough(8)));
  request_.options.clear_error();
  request_.options.add_keep(0.2);
  request_.options.set_min_level(11);
  expect_exact();
}

TEST_F(AutoStrategy, is_exact_at_a_pole_too) {
  put(points_of({6, 500, 64 * kTile - 50}, 40, 40, [](int c, int r) { return 10.0 * ((c * 7 + r * 3) % 11); }));
  request_.options.set_error(100);
  EXPECT_EQ(build("auto").options().strategy(), "exact");
}

TEST_F(AutoStrategy, is_exact_on_one_level_alone) {
  request_.options.set_min_level(13);
  expect_exact();
}

TEST_F(AutoStrategy, is_exact_in_blocks_where_the_raster_is_large) {
  put(points_of(kCorner, 2100, 2010, [](int c, int r) { return (c * 7 + r * 3) % 11; }));
  examine();
  const proto::Plan large = planned(0);
  ASSERT_EQ(large.window_size(), 4) << "no plan";
  EXPECT_TRUE(large.exact());
  EXPECT_EQ(large.block_level(), large.finest_level() - 2) << "1025 samples a way";
}

TEST_F(AutoStrategy, is_exact_in_blocks_of_any_size) {
  examine();
  EXPECT_TRUE(planned(0).exact());
  EXPECT_EQ(planned(0).block_level(), 0u) << "small: one piece";
  const proto::Plan small = planned(513 * 513);
  ASSERT_EQ(small.window_size(), 4) << "no plan";
  EXPECT_TRUE(small.exact());
  EXPECT_EQ(small.block_level(), small.finest_level() - 1);
  EXPECT_EQ(planned(1).block_level(), small.block_level()) << "the smallest that there are";
}

}  // namespace
}  // namespace cordillera::whole
