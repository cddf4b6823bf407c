// Rasters of a plan that change, before its tasks, during one or between them, and what that costs.
#include <gdal_priv.h>

#include <fstream>
#include <iomanip>
#include <memory>
#include <sstream>

#include "tests/whole/work_fixture.h"

namespace cordillera::whole {
namespace {

std::size_t count_of(const std::string& text, const std::string& what) {
  std::size_t count = 0;
  for (std::size_t at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++count;
  return count;
}

/// With pixels that a function of this test gives.
std::string vrt_of(const std::string& path) {
  const auto close = [](GDALDataset* raster) { GDALClose(raster); };
  const std::unique_ptr<GDALDataset, decltype(close)> raster(GDALDataset::Open(path.c_str()), close);
  double place[6];
  raster->GetGeoTransform(place);
  std::ostringstream text;
  text << std::setprecision(17) << "<VRTDataset rasterXSize='" << raster->GetRasterXSize() << "' rasterYSize='"
       << raster->GetRasterYSize() << "'><SRS>EPSG:4326</SRS><GeoTransform>";
  for (int k = 0; k < 6; ++k) text << (k == 0 ? "" : ", ") << place[k];
  text << "</GeoTransform><VRTRasterBand band='1' subClass='VRTDerivedRasterBand' dataType='"
       << GDALGetDataTypeName(raster->GetRasterBand(1)->GetRasterDataType())
       << "'><PixelFunctionType>tests_reading</PixelFunctionType><SimpleSource><SourceFilename>" << path
       << "</SourceFilename><SourceBand>1</SourceBand></SimpleSource></VRTRasterBand></VRTDataset>";
  return text.str();
}

TEST_F(Work, a_changed_raster_costs_what_it_touches) {
  const proto::WorkPlan before = plan();
  all_stages(before);
  const int blocks = before.stages(0).tasks_size(), tasks = done_;
  write_patch("far.tif", 9000, 6000, 140, 99);
  examine({"west.tif", "beside.tif", "far.tif"});
  const proto::WorkPlan after = plan();
  done_ = found_ = 0;
  all_stages(after);
  EXPECT_GT(found_, 0);
  EXPECT_LT(done_, tasks);
  int same = 0;
  for (int k = 0; k < blocks; ++k) same += before.stages(0).tasks(k).key() == after.stages(0).tasks(k).key() ? 1 : 0;
  EXPECT_GT(same, 0);
  EXPECT_LT(same, blocks);
  ASSERT_TRUE(publish(after, "patched.sqlite").ok());
  expect_same(in_one_piece("scratch.sqlite"), published(folder_.path("patched.sqlite")));
  // The results that are now nobody's go, and only those.
  EXPECT_EQ(work::prune(after, shards_).value(), static_cast<std::size_t>(done_));
  EXPECT_TRUE(publish(after, "again.sqlite").ok());
}

/// A few heights of all rasters are looked at for a small error; so fine that a level's steps follow from them it is not.
TEST_F(Work, a_higher_raster_elsewhere_leaves_keys_alone) {
  request_.options.clear_error();  // the default one looks at heights
  examine({"west.tif", "beside.tif", "far.tif"});
  const proto::WorkPlan before = plan();
  const auto rough_ground = rough(3);
  write(points_of({kLevel, 9008 * kTile + 9000, 6000 * kTile + 6000}, 140, 140,
                  [&](int c, int r) { return 4000 + rough_ground(c, r); }),
        folder_.path("far.tif"));
  examine({"west.tif", "beside.tif", "far.tif"});
  const proto::WorkPlan after = plan();
  ASSERT_EQ(before.plan().seen_heights_size(), 2);
  ASSERT_NE(before.plan().seen_heights(1), after.plan().seen_heights(1));
  EXPECT_EQ(before.stages(0).tasks(0).key(), after.stages(0).tasks(0).key());
}

TEST_F(Work, a_raster_that_changed_since_the_plan_is_refused) {
  const proto::WorkPlan plan = this->plan();
  write_patch("far.tif", 9000, 6000, 140, 5);
  const auto refused = stage(plan, 0);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "source-changed");
  EXPECT_FALSE(work::worth_retrying(refused.problem()));
}

/// Of a VRT whose pixels come from it: west.tif's. It counts how often it is asked, and at a time writes to the raster.
struct Reading {
  static CPLErr pixels(void** sources, int count, void* data, int columns, int rows, GDALDataType, GDALDataType type, int pixel,
                       int line) {
    if (++asked == change_at) change();
    const int bytes = GDALGetDataTypeSizeBytes(type);
    for (int row = 0; row < rows && count == 1; ++row) {
      auto* const to = static_cast<char*>(data) + std::ptrdiff_t{row} * line;
      const auto* const from = static_cast<const char*>(sources[0]) + std::ptrdiff_t{row} * columns * bytes;
      GDALCopyWords(from, type, bytes, to, type, pixel, columns);
    }
    return CE_None;
  }
  static inline std::atomic<int> asked = 0;
  static inline int change_at = 0;
  static inline std::function<void()> change;
};

TEST_F(Work, a_raster_that_is_written_to_while_it_is_read_leaves_no_shard) {
  GDALAllRegister();
  GDALAddDerivedBandPixelFunc("tests_reading", Reading::pixels);
  std::ofstream(folder_.path("west.vrt")) << vrt_of(folder_.path("west.tif"));
  examine({"west.vrt"});
  const proto::WorkPlan plan = this->plan();
  Reading::asked = Reading::change_at = 0;
  ASSERT_TRUE(work::check_unchanged(request_.members.front()).ok());
  Reading::change_at = Reading::asked + 1;  // when the first look is over
  Reading::asked = 0;
  Reading::change = [&] {
    const auto then = fs::last_write_time(folder_.path("west.tif"));
    fs::last_write_time(folder_.path("west.tif"), then + std::chrono::seconds(1));
  };
  work::WorkOrder order{shards_, {"cpu"}, 1};
  const auto written = work::do_tasks(
      plan, plan.stages(0), {0}, order, [](const auto&, auto) {}, never_);
  ASSERT_GE(Reading::asked, Reading::change_at) << "a task reads more than a look at the raster";
  ASSERT_FALSE(written.ok());
  EXPECT_EQ(written.problem().type, "source-changed");
  EXPECT_FALSE(fs::exists(work::shard_path(shards_, plan.stages(0).tasks(0).key())));
}

/// Tasks that read the raster of the name.
int reading(const proto::WorkPlan& plan, const std::string& name) {
  int count = 0;
  for (const proto::WorkTask& task : plan.stages(0).tasks()) {
    for (const std::uint32_t k : task.sources()) count += plan.sources(static_cast<int>(k)).spec().name() == name ? 1 : 0;
  }
  return count;
}

TEST_F(Work, one_bad_raster_leaves_tasks_without_it_alone) {
  const proto::WorkPlan plan = this->plan();
  const int all = plan.stages(0).tasks_size(), bad = reading(plan, "west.tif");
  ASSERT_GT(bad, 1);
  ASSERT_LT(bad, all);
  fs::rename(folder_.path("west.tif"), folder_.path("away"));
  const auto refused = stage(plan, 0);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "tasks-failed");
  EXPECT_FALSE(work::worth_retrying(refused.problem()));
  EXPECT_THAT(refused.problem().detail, testing::StartsWith(std::to_string(bad) + " tasks have failed"));
  EXPECT_EQ(count_of(refused.problem().detail, "/west.tif"), 1u) << "each reason once: " << refused.problem().detail;
  EXPECT_EQ(failed_, bad);
  EXPECT_EQ(done_, all - bad);
  fs::rename(folder_.path("away"), folder_.path("west.tif"));
  all_stages(plan);
  EXPECT_TRUE(publish(plan, "tasks.sqlite").ok());
}

/// Its time is put back: what was read meanwhile stays refused.
TEST_F(Work, a_raster_that_changes_between_tasks_and_is_as_before_again_stays_refused) {
  const proto::WorkPlan plan = this->plan();
  const std::string path = folder_.path("west.tif");
  const auto then = fs::last_write_time(path);
  ASSERT_TRUE(stage(plan, 0).ok());
  fs::remove_all(shards_ + "/shards");
  after_task_ = [&] {
    if (failed_ > 0) fs::last_write_time(path, then);
  };
  done_ = failed_ = 0;
  fs::last_write_time(path, then + std::chrono::seconds(1));
  ASSERT_FALSE(stage(plan, 0).ok());
  EXPECT_EQ(failed_, reading(plan, "west.tif"));
}

TEST_F(Work, begins_with_the_task_that_it_is_told) {
  const proto::WorkPlan plan = this->plan();
  const auto all = static_cast<std::size_t>(plan.stages(0).tasks_size());
  begin_ = 7 * all + 2;
  ASSERT_TRUE(stage(plan, 0).ok());
  ASSERT_EQ(order_.size(), all);
  for (std::size_t k = 0; k < all; ++k) EXPECT_EQ(order_[k], plan.stages(0).tasks(static_cast<int>((k + 2) % all)).key());
}

/// Blocks read it, too.
TEST_F(Work, a_water_mask_that_changed_since_the_plan_is_refused) {
  const auto write_mask = [this](int shore) {
    write(points_of({kLevel, 9008 * kTile - 20, 6000 * kTile + 20}, 400, 400, [shore](int c, int) { return c < shore ? 1 : 0; }),
          folder_.path("mask.tif"));
  };
  write_mask(100);
  request_.options.clear_water();
  request_.options.set_water_mask(folder_.path("mask.tif"));
  const proto::WorkPlan before = plan();
  write_mask(50);
  const auto refused = stage(before, 0);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(done_, 0);
  EXPECT_FALSE(work::worth_retrying(refused.problem()));
  EXPECT_THAT(refused.problem().detail, testing::HasSubstr("mask.tif is not what it was when the plan was made"));
  const proto::WorkPlan after = plan();
  EXPECT_NE(after.stages(0).tasks(0).key(), before.stages(0).tasks(0).key());
  all_stages(after);
  ASSERT_TRUE(publish(after, "tasks.sqlite").ok());
  const Bytes one_piece = in_one_piece("scratch.sqlite");
  EXPECT_GT(masks_in(one_piece), 0u);
  expect_same(one_piece, published(folder_.path("tasks.sqlite")));
}

/// A VRT's raster, a mask, a world file: what a reader may take for a part of it.
TEST_F(Work, a_file_beside_a_raster_that_changed_since_the_plan_is_refused) {
  const proto::WorkPlan before = plan();
  std::ofstream(folder_.path("far.prj")) << "another";
  const auto refused = stage(before, 0);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "source-changed");
  examine({"west.tif", "beside.tif", "far.tif"});
  EXPECT_EQ(plan().stages(0).tasks_size(), before.stages(0).tasks_size());
}

}  // namespace
}  // namespace cordillera::whole
