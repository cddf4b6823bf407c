// A dataset whose rasters change: each version is, tile by tile, what a build of its rasters from nothing gives, and costs what
// was touched.
#include <gmock/gmock.h>

#include <atomic>
#include <cmath>
#include <filesystem>

#include "pipeline/build/provisional.h"
#include "pipeline/check/check.h"
#include "pipeline/faces/terrain.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store_revise.h"
#include "pipeline/work/publish.h"
#include "pipeline/work/update.h"
#include "pipeline/work/work.h"
#include "pipeline/work/work_plan.h"
#include "tests/whole/built.h"
#include "tests/whole/bytes.h"

namespace cordillera::whole {
namespace {

namespace fs = std::filesystem;
namespace work = pipeline::work;

constexpr int kLevel = 12;
constexpr std::int64_t kBlock = 513;                                 // samples a side, two tiles
constexpr std::int64_t kWest = 4096 * kTile, kNorth = 3006 * kTile;  // of the nine blocks
/// A base of nine blocks, and patches on it.
class Update : public testing::Test {
 protected:
  Update() {
    write_patch("base.tif", 20, 20, 3 * 512 - 40, 70);
    write_patch("patch.tif", 530, 540, 60, 71);
    write_patch("beside.tif", 1600, 700, 200, 72);  // beyond the base, in blocks of its own
    request_.raster_name = request_.id = "terrain";
    request_.options = plain_options();
    request_.options.set_max_level(kLevel);
    request_.options.set_error(40);
    request_.options.set_water(kSea_m);
  }
  /// east, south: samples from the north-western corner of the nine blocks.
  void write_patch(const std::string& name, int east, int south, int side, std::uint32_t seed) {
    write(points_of({kLevel, kWest + east, kNorth - south}, side, side, rough_with_sea(seed)), folder_.path(name));
  }
  pipeline::BuildRequest request_of(const std::vector<std::string>& names) {
    pipeline::BuildRequest request = request_;
    for (const std::string& name : names) {
      auto member = raster::examine(folder_.path(name), name, raster::Trust::operator_file, request_.options);
      EXPECT_TRUE(member.ok()) << member.problem().line();
      if (member.ok()) request.members.push_back(*member);
    }
    return request;
  }
  /// The next version, as a file of that name. Blocks that were built: built_.
  proto::Result<proto::Manifest> next(const std::string& name, const std::vector<std::string>& names, const std::string& before) {
    pipeline::BuildRequest request = request_of(names);
    request.store_path = folder_.path(name);
    built_ = 0;
    const auto told = [&](const proto::Progress& progress) {
      built_ = static_cast<int>(progress.blocks());
      if (stop_at_ > 0 && built_ >= stop_at_) stop_ = true;
    };
    return work::update({request, before.empty() ? "" : folder_.path(before), {{"mark", name}}, kBlock * kBlock}, told, stop_);
  }
  void make(const std::string& name, const std::vector<std::string>& names, const std::string& before = "") {
    const auto made = next(name, names, before);
    ASSERT_TRUE(made.ok()) << made.problem().line();
  }
  /// plan, tasks, publish of the same rasters, with the same size of blocks.
  Bytes from_nothing(const std::vector<std::string>& names, proto::Manifest* manifest = nullptr) {
    const std::string folder = folder_.path("plan" + std::to_string(++scratches_)), store = folder + ".sqlite";
    const auto plan = work::plan_work(request_of(names), stop_, {nullptr, kBlock * kBlock, 0});
    EXPECT_TRUE(plan.ok()) << plan.problem().line();
    for (const proto::WorkStage& stage : plan->stages()) {
      EXPECT_TRUE(work::do_tasks(
                      *plan, stage, work::part_of(stage, 0, 1), {folder, {"cpu"}, 2}, [](auto&&...) {}, stop_)
                      .ok());
    }
    const auto published = work::publish(*plan, folder, store, stop_);
    EXPECT_TRUE(published.ok()) << published.problem().line();
    if (manifest != nullptr && published.ok()) *manifest = *published;
    return whole::published(store);
  }

  /// What `check` finds, a line each.
  std::string found(const std::string& name) {
    const auto report = pipeline::check::check_store(folder_.path(name), nullptr);
    std::string lines = report ? "" : report.problem().line();
    if (report) {
      for (const auto& finding : report->findings.kept()) lines += finding.where + ": " + finding.what + "\n";
    }
    return lines;
  }

  void fill_voids() {
    request_.options.clear_voids();
    request_.options.set_strategy("exact");
  }

  std::int64_t rows_of(const std::string& name, const std::string& table) {
    return pipeline::Database(folder_.path(name), pipeline::Database::Mode::published).integer("SELECT count(*) FROM " + table);
  }

  Folder folder_;
  pipeline::BuildRequest request_;
  std::atomic<bool> stop_ = false;
  int built_ = 0, stop_at_ = 0, scratches_ = 0;
};

/// What a version keeps for the next one is no finding.
TEST_F(Update, each_version_is_sound) {
  make("first.sqlite", {"base.tif"});
  EXPECT_EQ(found("first.sqlite"), "");
  make("second.sqlite", {"patch.tif", "base.tif"}, "first.sqlite");
  EXPECT_EQ(found("second.sqlite"), "");
}

// Whether samples are moved to meet pixels is a number of the plan: blocks that see the finer raster, and those that do not,
// share sides.
TEST_F(Update, a_finer_raster_goes_in_at_the_numbers_that_there_are) {
  Dem aside = points_of({kLevel, kWest + 20, kNorth - 20}, 3 * 512 - 40, 3 * 512 - 40, rough(70));
  aside.geotransform[0] += 0.4 * aside.geotransform[1], aside.geotransform[3] += 0.3 * aside.geotransform[5];
  write(aside, folder_.path("aside.tif"));
  write(points_of({kLevel + 2, 4 * (kWest + 530), 4 * (kNorth - 540)}, 240, 240, rough(71)), folder_.path("fine.tif"));
  make("1.sqlite", {"aside.tif"});
  const auto finer = next("2.sqlite", {"fine.tif", "aside.tif"}, "1.sqlite");
  ASSERT_TRUE(finer.ok()) << finer.problem().line();
  EXPECT_EQ(finer->options().pixels(), "exact");
  EXPECT_LT(built_, 9);
  EXPECT_EQ(found("2.sqlite"), "");
}

TEST_F(Update, a_patch_gives_the_bytes_of_a_build_from_nothing) {
  make("1.sqlite", {"base.tif"});
  EXPECT_GE(built_, 9);
  expect_same(from_nothing({"base.tif"}), published(folder_.path("1.sqlite")));
  const auto patched = next("2.sqlite", {"patch.tif", "base.tif"}, "1.sqlite");
  ASSERT_TRUE(patched.ok()) << patched.problem().line();
  EXPECT_GE(built_, 1);
  EXPECT_LE(built_, 6) << "a patch of 60 samples, and what is filled or moved around it, lies in six blocks at most";
  proto::Manifest manifest;
  const Bytes expected = from_nothing({"patch.tif", "base.tif"}, &manifest);
  EXPECT_GT(masks_in(expected), 10u);
  expect_same(expected, published(folder_.path("2.sqlite")));
  EXPECT_EQ(patched->SerializeAsString(), manifest.SerializeAsString());
  EXPECT_NE(published(folder_.path("1.sqlite")), expected) << "the patch changed nothing: nothing was tested";
  EXPECT_EQ(pipeline::note_in(folder_.path("2.sqlite"), "mark"), "2.sqlite");
}

/// Nor where voids are filled: what has none, and none near it, does not change with rasters that only a void could bring there.
TEST_F(Update, a_block_without_voids_depends_on_no_raster_far_from_it) {
  fill_voids();
  write_patch("inside.tif", 700, 700, 60, 71);
  make("1.sqlite", {"base.tif"});
  make("2.sqlite", {"inside.tif", "base.tif"}, "1.sqlite");
  EXPECT_EQ(built_, 1);
  expect_same(from_nothing({"inside.tif", "base.tif"}), published(folder_.path("2.sqlite")));
}

/// A bay of no data from the southern rim through three blocks. A patch closes it in the middle one: what lies beyond is filled,
/// in a block that the patch does not come near.
TEST_F(Update, a_patch_that_closes_a_bay_fills_it_in_other_blocks) {
  fill_voids();
  const auto ground = rough_with_sea(75);
  write(points_of({kLevel, kWest + 20, kNorth - 20}, 3 * 512 - 40, 3 * 512 - 40,
                  [&](int c, int r) { return c >= 680 && c < 710 && r > 400 ? kNoData : ground(c, r); }),
        folder_.path("bay.tif"));
  write_patch("mole.tif", 680, 600, 80, 76);
  make("1.sqlite", {"bay.tif"});
  const auto patched = next("2.sqlite", {"mole.tif", "bay.tif"}, "1.sqlite");
  ASSERT_TRUE(patched.ok()) << patched.problem().line();
  EXPECT_GT(patched->source().filled_share(), 0);
  EXPECT_GE(built_, 2);
  expect_same(from_nothing({"mole.tif", "bay.tif"}), published(folder_.path("2.sqlite")));
  make("3.sqlite", {"bay.tif"}, "2.sqlite");
  expect_same(published(folder_.path("1.sqlite")), published(folder_.path("3.sqlite")));
}

/// voids= a height: data of any raster comes before it, and blocks that the patch does not touch are as they were.
TEST_F(Update, a_height_in_place_of_voids_gives_the_bytes_of_a_build_from_nothing) {
  request_.options.set_voids("50");
  const auto holed = [&](const std::string& name, int at, int side, std::uint32_t seed) {
    const auto ground = rough_with_sea(seed);
    write(points_of({kLevel, kWest + at, kNorth - at}, side, side,
                    [&](int c, int r) { return (c / 90 + r / 70) % 4 == 0 ? kNoData : ground(c, r); }),
          folder_.path(name));
  };
  holed("holed.tif", 20, 3 * 512 - 40, 78);
  holed("over it.tif", 530, 120, 79);
  make("1.sqlite", {"holed.tif"});
  make("2.sqlite", {"over it.tif", "holed.tif"}, "1.sqlite");
  EXPECT_LE(built_, 6);
  expect_same(from_nothing({"over it.tif", "holed.tif"}), published(folder_.path("2.sqlite")));
  make("3.sqlite", {"holed.tif"}, "2.sqlite");
  expect_same(published(folder_.path("1.sqlite")), published(folder_.path("3.sqlite")));
}

TEST_F(Update, what_was_taken_away_leaves_no_trace) {
  make("1.sqlite", {"base.tif"});
  make("2.sqlite", {"patch.tif", "base.tif", "beside.tif"}, "1.sqlite");
  expect_same(from_nothing({"patch.tif", "base.tif", "beside.tif"}), published(folder_.path("2.sqlite")));
  make("3.sqlite", {"base.tif"}, "2.sqlite");
  expect_same(published(folder_.path("1.sqlite")), published(folder_.path("3.sqlite")));
  EXPECT_LT(built_, 9);
  // Nor bytes that no tile names, nor meshes of tasks that are no more.
  for (const char* table : {"blobs", "meshes", "tiles", "nodes", "water"}) {
    EXPECT_EQ(rows_of("1.sqlite", table), rows_of("3.sqlite", table)) << table;
  }
}

TEST_F(Update, the_order_decides) {
  make("1.sqlite", {"base.tif", "patch.tif"});
  make("2.sqlite", {"patch.tif", "base.tif"}, "1.sqlite");
  EXPECT_LE(built_, 4);
  expect_same(from_nothing({"patch.tif", "base.tif"}), published(folder_.path("2.sqlite")));
}

TEST_F(Update, stopped_in_the_middle_it_goes_on) {
  stop_at_ = 3;
  const auto stopped = next("1.sqlite", {"base.tif"}, "");
  ASSERT_FALSE(stopped.ok());
  EXPECT_EQ(stopped.problem().type, "cancelled");
  stop_ = false;
  stop_at_ = 0;
  make("1.sqlite", {"base.tif"});
  const int blocks = work::plan_in(folder_.path("1.sqlite"))->stages(0).tasks_size();
  EXPECT_LE(built_, blocks - 3) << "what was committed was built again";
  make("2.sqlite", {"patch.tif", "base.tif"}, "1.sqlite");
  make("2.sqlite", {"patch.tif", "base.tif"}, "1.sqlite");  // asked twice
  EXPECT_EQ(built_, 0);
  expect_same(from_nothing({"patch.tif", "base.tif"}), published(folder_.path("2.sqlite")));
}

TEST_F(Update, seams_and_shares_as_well) {
  write_patch("small.tif", 300, 300, 420, 73);  // a corner where blocks meet: the search for a share takes its time
  write_patch("on it.tif", 560, 560, 60, 74);
  request_.options.set_feather(2000);
  request_.options.clear_error();
  request_.options.add_keep(0.2);
  make("1.sqlite", {"small.tif"});
  make("2.sqlite", {"on it.tif", "small.tif"}, "1.sqlite");
  EXPECT_LE(built_, 9) << "feathering reaches into the blocks around, no farther";
  EXPECT_GE(built_, 1);
}

TEST_F(Update, a_version_that_is_none_to_build_on_is_left_alone) {
  pipeline::BuildRequest request = request_of({"base.tif"});
  request.store_path = folder_.path("plain.sqlite");
  ASSERT_TRUE(pipeline::build(request, nullptr, stop_).ok());
  EXPECT_FALSE(work::plan_in(folder_.path("plain.sqlite")));
  make("2.sqlite", {"base.tif"}, "plain.sqlite");
  EXPECT_GE(built_, 9) << "it has no meshes: everything is built";
}

/// Coarse levels of all of them, before there is a first version.
TEST_F(Update, several_rasters_have_provisional_tiles) {
  write_patch("over.tif", 530, 400, 200, 75);
  const pipeline::BuildRequest request = request_of({"over.tif", "base.tif", "beside.tif"});
  const auto source = pipeline::open_source(request);
  ASSERT_TRUE(source.ok()) << source.problem().line();
  auto small = pipeline::provisional_request(request, **source, 300'000);
  ASSERT_TRUE(small.ok()) << small.problem().line();
  ASSERT_TRUE(*small);
  (*small)->store_path = folder_.path("provisional");
  const auto built = pipeline::build(**small, nullptr, stop_);
  ASSERT_TRUE(built.ok()) << built.problem().line();
  make("1.sqlite", {"over.tif", "base.tif", "beside.tif"});
  const auto terrain = [&](const std::string& name) {
    return pipeline::faces::Terrain(std::move(pipeline::StoreReader::open(folder_.path(name))).value());
  };
  const pipeline::faces::Terrain now = terrain("provisional"), final = terrain("1.sqlite");
  EXPECT_TRUE(now.manifest().provisional());
  EXPECT_FALSE(final.manifest().provisional());
  // The same heights but for what few samples do not show. The two rasters of one place are some hundred metres apart.
  const proto::Lattice lattice{kLevel};
  const auto off_m = [&](std::int64_t east, std::int64_t south, int side) {
    double sum_m = 0;
    int places = 0;
    for (int k = side / 4; k < side * 3 / 4; k += side / 16, ++places) {
      const double longitude = static_cast<double>(kWest + east + k) * lattice.cell_deg() - 180 + 1e-7;
      const double latitude = static_cast<double>(kNorth - south - k) * lattice.cell_deg() - 90 + 1e-7;
      const auto a = now.height_m(static_cast<int>(built->max_level()), longitude, latitude);
      const auto b = final.height_m(kLevel, longitude, latitude);
      EXPECT_TRUE(a && b) << longitude << " " << latitude;
      if (a && b) sum_m += std::abs(*a - *b);
    }
    return sum_m / places;
  };
  EXPECT_LT(off_m(530, 400, 200), 100) << "of the first, which wins";
  EXPECT_LT(off_m(20, 20, 500), 100) << "of the base";
  EXPECT_LT(off_m(1600, 700, 200), 100) << "of what lies beside it";
}

}  // namespace
}  // namespace cordillera::whole
