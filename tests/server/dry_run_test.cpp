// What a dry run promises, against what is then built.
#include <gmock/gmock.h>

#include <cmath>
#include <ctime>
#include <filesystem>

#include "../raster/fixture.h"
#include "pipeline/build/build.h"
#include "pipeline/estimate/estimate.h"
#include "tests/sanitized.h"

namespace cordillera::server {
namespace {

using raster_test::Spec;

constexpr int kSide = 1100, kLevel = 13;

/// Mountains in the west, a plain with low dunes in the east.
double landscape(int c, int r) {
  const double x = c / 97.0, y = r / 83.0;
  const double hills = 900 * std::sin(x) * std::cos(y) + 120 * std::sin(9 * x + 2 * y) + 30 * std::sin(31 * x) * std::sin(29 * y);
  const double dunes = 4 * std::sin(17 * x) + 3 * std::cos(23 * y);
  return 1500 + (c < kSide / 2 ? hills : 0) + dunes;
}

class DryRun : public raster_test::RasterTest {
 protected:
  void write_landscape() {
    Spec spec;
    spec.columns = spec.rows = kSide;
    spec.geotransform = raster_test::cells_of(kLevel, 9008 * 256 + 40, 6000 * 256 + 90);
    spec.value = landscape;
    request_.raster_path = write(spec);
    request_.raster_name = "dem.tif";
    request_.id = "test";
    request_.options = raster_test::plain_options();
    request_.options.set_max_level(kLevel);
    request_.options.set_threads(2);
    request_.options.set_device("cpu");
  }
  proto::Manifest guess() {
    const auto estimate = pipeline::estimate(request_);
    EXPECT_TRUE(estimate.ok()) << estimate.problem().line();
    EXPECT_GT(estimate->seconds, 0);
    return estimate->manifest;
  }
  /// A guess within a factor of 2 of what is built.
  proto::Manifest expect_near() {
    request_.store_path = path("store.sqlite");
    const std::atomic<bool> never = false;
    const proto::Manifest told = guess();
    const auto built = pipeline::build(request_, nullptr, never);
    EXPECT_TRUE(built.ok()) << built.problem().line();
    const auto near = [](double guessed, double truth, const std::string& what) {
      EXPECT_GT(guessed, truth / 2) << what;
      EXPECT_LT(guessed, truth * 2) << what;
    };
    near(told.tiles(), built->tiles(), "tiles");
    near(told.triangles(), built->triangles(), "triangles");
    near(told.bytes(), built->bytes(), "bytes");
    for (int k = 0; k < 2; ++k) {
      near(told.levels(k).triangles(), built->levels(k).triangles(),
           "triangles of level " + std::to_string(told.levels(k).level()));
      EXPECT_EQ(told.levels(k).target(), built->levels(k).target());
    }
    return told;
  }

  pipeline::BuildRequest request_;
};

TEST_F(DryRun, IsNearWhatIsBuiltForSmallAndLargeErrors) {
  write_landscape();
  std::vector<double> triangles;
  for (const double error : {5.0, 50.0}) {
    SCOPED_TRACE(error);
    request_.options.set_error(error);
    triangles.push_back(expect_near().triangles());
  }
  EXPECT_GT(triangles[0], 2 * triangles[1]) << "a finer error costs triangles";
}

TEST_F(DryRun, SaysWhatAutoChoosesAndIsNearIt) {
  write_landscape();
  request_.options.set_strategy("auto");
  for (const double error : {5.0, 50.0}) {
    SCOPED_TRACE(error);
    request_.options.set_error(error);
    const proto::Manifest told = expect_near();
    EXPECT_EQ(told.options().strategy(), "exact");
    EXPECT_EQ(told.notes_size(), 0);
    std::filesystem::remove(request_.store_path);
  }
}

TEST_F(DryRun, IsNearWhatIsBuiltForShares) {
  write_landscape();
  for (const double share : {0.1, 0.03}) request_.options.add_keep(share);
  request_.options.set_min_level(kLevel - 1);  // the search for the targets of all levels would take long
  request_.store_path = path("store.sqlite");
  const std::atomic<bool> never = false;
  const proto::Manifest told = guess();
  const auto built = pipeline::build(request_, nullptr, never);
  ASSERT_TRUE(built.ok()) << built.problem().line();
  for (int k = 0; k < 2; ++k) {
    EXPECT_GT(told.levels(k).triangles(), built->levels(k).triangles() / 2) << k;
    EXPECT_LT(told.levels(k).triangles(), built->levels(k).triangles() * 2) << k;
  }
  EXPECT_GT(told.bytes(), built->bytes() / 2);
  EXPECT_LT(told.bytes(), built->bytes() * 2);
}

TEST_F(DryRun, SaysWhichDatumIsUsedForTheOneThatIsDeclared) {
  Spec spec;
  spec.columns = spec.rows = 20;
  spec.crs = "EPSG:4326+5783";  // PROJ knows no way from DHHN92
  request_.raster_path = write(spec);
  request_.raster_name = "dem.tif";
  const auto notes = [](const proto::Manifest& manifest) {
    return std::vector<std::string>(manifest.notes().begin(), manifest.notes().end());
  };
  const std::vector<std::string> told = notes(guess());
  EXPECT_THAT(told, ::testing::ElementsAre("DHHN92 height declared, EGM96 used"));
  request_.store_path = path("store.sqlite");
  const std::atomic<bool> never = false;
  const auto built = pipeline::build(request_, nullptr, never);
  ASSERT_TRUE(built.ok()) << built.problem().line();
  EXPECT_EQ(notes(*built), told);
}

TEST_F(DryRun, NotesWhatTheBuildNotesOfValues) {
  Spec spec;
  spec.columns = spec.rows = 20;
  spec.value = [](int c, int r) { return c < 4 ? -9999.0 : 100.0 + c * r; };
  request_.raster_path = write(spec);
  request_.raster_name = "dem.tif";
  request_.options = raster_test::plain_options();
  const auto estimate = pipeline::estimate(request_);
  ASSERT_TRUE(estimate.ok()) << estimate.problem().line();
  ASSERT_TRUE(estimate->values);
  EXPECT_EQ(estimate->values->highest_m, 100 + 19 * 19);
  const auto& told = estimate->manifest.notes();
  ASSERT_EQ(told.size(), 1);
  EXPECT_THAT(told[0], ::testing::HasSubstr("nodata=-9999 leaves them out"));
  request_.store_path = path("store.sqlite");
  const std::atomic<bool> never = false;
  const auto built = pipeline::build(request_, nullptr, never);
  ASSERT_TRUE(built.ok()) << built.problem().line();
  ASSERT_EQ(built->notes_size(), 1);
  EXPECT_EQ(built->notes(0), told[0]);
}

TEST_F(DryRun, NotesABoxThatCutsAVoid) {
  Spec spec;
  spec.columns = spec.rows = 40;
  spec.nodata = -9999;
  spec.value = [](int column, int row) { return std::hypot(column - 20, row - 20) < 8 ? -9999.0 : 100.0; };
  request_.raster_path = write(spec);
  request_.options = raster_test::plain_options();
  EXPECT_EQ(guess().notes_size(), 0);
  for (const double side : {10.0, 44.5, 10.2, 45.0}) request_.options.add_bbox(side);
  const proto::Manifest told = guess();
  ASSERT_EQ(told.notes_size(), 1);
  EXPECT_THAT(told.notes(0), ::testing::HasSubstr("a side of the bbox cuts stay open"));
  request_.options.set_voids("hole");
  EXPECT_EQ(guess().notes_size(), 0);
}

/// A raster of 20 x 20 pixels whose finest level is to be 0, of cells wider than all of it.
class DryRunOfWideCells : public DryRun {
 protected:
  proto::Problem refused(Spec spec = {}) {
    spec.columns = spec.rows = 20;
    request_.raster_path = write(spec);
    request_.raster_name = "dem.tif";
    request_.options = raster_test::plain_options();
    request_.options.set_max_level(0);
    const auto estimate = pipeline::estimate(request_);
    EXPECT_FALSE(estimate.ok());
    return estimate.ok() ? proto::Problem() : estimate.problem();
  }
};

TEST_F(DryRunOfWideCells, NamesTheLevel) {
  const proto::Problem problem = refused();
  EXPECT_EQ(problem.type, "option-invalid");
  EXPECT_EQ(problem.parameter, "max_level");
  EXPECT_THAT(problem.line(), ::testing::AllOf(::testing::HasSubstr("cells of level 0 are so wide"),
                                               ::testing::HasSubstr("as fine as the raster is 7")));
}

// The box of such a raster has its west above its east: heights were looked for on the other side of the earth.
TEST_F(DryRunOfWideCells, NamesTheLevelOverTheAntimeridian) {
  Spec spec;
  spec.geotransform = {179.95, 0.005, 0, 44, 0, -0.005};
  EXPECT_THAT(refused(spec).line(), ::testing::HasSubstr("cells of level 0 are so wide"));
}

TEST_F(DryRunOfWideCells, NamesTheLevelWhereTheBoxIsNarrower) {
  refused();
  request_.options.clear_max_level();
  for (const double side : {10.05, 44.95, 10.0501, 44.9501}) request_.options.add_bbox(side);
  const auto estimate = pipeline::estimate(request_);
  ASSERT_FALSE(estimate.ok());
  EXPECT_EQ(estimate.problem().type, "raster-all-nodata");
  EXPECT_EQ(estimate.problem().parameter, "bbox");
  EXPECT_THAT(estimate.problem().line(),
              ::testing::ContainsRegex("cells of level 7 are so wide .*lie on the data of dem.tif inside "
                                       "the bbox; accepted: a finer max_level, or a wider bbox"));
}

TEST_F(DryRunOfWideCells, NamesTheLevelWhereTheDataIsNarrower) {
  Spec spec;
  spec.geotransform = {7, 0.001, 0, 47, 0, -0.001};
  spec.nodata = -9999;
  spec.value = [](int column, int row) { return column == 10 && row == 10 ? 100.0 : -9999.0; };
  refused(spec);
  request_.options.clear_max_level();
  const auto estimate = pipeline::estimate(request_);
  ASSERT_FALSE(estimate.ok());
  EXPECT_EQ(estimate.problem().parameter, "max_level");
  EXPECT_THAT(estimate.problem().line(),
              ::testing::ContainsRegex("cells of level 10 are so wide .*; accepted: a finer max_level, or wider data"));
}

TEST_F(DryRun, OfRastersFarApartFindsThem) {
  const auto member = [&](double west, const std::string& name) {
    Spec spec;
    spec.columns = spec.rows = 160;
    spec.geotransform = {west, 0.0001, 0, 45, 0, -0.0001};
    spec.value = landscape;
    const auto found = raster::examine(write(spec, name), name, raster::Trust::operator_file, raster_test::plain_options());
    EXPECT_TRUE(found.ok()) << found.problem().line();
    return *found;
  };
  request_.members = {member(-120, "west.tif"), member(10, "east.tif")};
  request_.raster_name = "two";
  request_.options = raster_test::plain_options();
  request_.options.set_device("cpu");
  const proto::Manifest told = guess();
  EXPECT_GE(told.levels(0).tiles(), 4u) << "two of each at least";
  EXPECT_LE(told.levels(0).tiles(), 60u);
  EXPECT_GT(told.levels(0).triangles(), 300u);
  EXPECT_GT(told.levels(0).target(), 0.5) << "the default error comes from what the data are like";
}

TEST_F(DryRun, SaysTheSameEveryTime) {
  write_landscape();
  request_.options.set_error(5);
  const proto::Manifest first = guess();
  request_.options.set_threads(1);
  proto::Manifest second = guess();
  EXPECT_EQ(second.options().threads(), 1u);
  second.mutable_options()->set_threads(2);
  EXPECT_EQ(first.SerializeAsString(), second.SerializeAsString());
}

TEST_F(DryRun, OfAHugeSparseRasterCostsWhatIsStored) {
  request_.raster_path = write(raster_test::huge_sparse(50176));
  request_.raster_name = "sparse.tif";
  request_.options = raster_test::plain_options();
  const std::clock_t start = std::clock();
  const proto::Manifest told = guess();
  EXPECT_LT(std::clock() - start, (kSanitized ? 100 : 10) * CLOCKS_PER_SEC) << "a second or two of work";
  EXPECT_GE(told.levels(0).tiles(), 4u);
  EXPECT_LE(told.levels(0).tiles(), 30u) << "one stored block of 512 x 512";
}

TEST_F(DryRun, OfNoDataIsTheProblemThatABuildWouldHave) {
  Spec spec = raster_test::huge_sparse(50176);
  spec.columns = spec.rows = 2000;
  spec.only = Spec::Part{0, 0, 16};
  spec.nodata = -9999;
  spec.value = [](int, int) { return -9999.0; };
  request_.raster_path = write(spec);
  request_.raster_name = "void.tif";
  request_.options = raster_test::plain_options();
  const auto estimate = pipeline::estimate(request_);
  ASSERT_FALSE(estimate.ok());
  EXPECT_EQ(estimate.problem().type, "raster-all-nodata");
}

/// Zeros that were left out, or what was never written: nobody but the user knows.
TEST_F(DryRun, NotesBlocksThatWereNeverStored) {
  Spec spec;
  spec.columns = spec.rows = 256;
  spec.create = {"SPARSE_OK=TRUE", "TILED=YES", "BLOCKXSIZE=128", "BLOCKYSIZE=128"};
  spec.value = [](int c, int) { return c < 128 ? 0.0 : 100.0; };
  request_.raster_path = write(spec);
  request_.options = raster_test::plain_options();
  const proto::Manifest told = guess();
  ASSERT_EQ(told.notes_size(), 1);
  EXPECT_THAT(told.notes(0), ::testing::HasSubstr("voids=0 makes them ground"));
  request_.options.set_voids("0");
  EXPECT_EQ(guess().notes_size(), 0);
  request_.options.clear_voids();
  spec.nodata = 0;
  request_.raster_path = write(spec, "declared.tif");
  EXPECT_EQ(guess().notes_size(), 0);
}

TEST_F(DryRun, LooksAtTheWaterMaskAsABuildDoes) {
  Spec spec;
  spec.columns = spec.rows = 20;
  request_.raster_path = write(spec);
  request_.options = raster_test::plain_options();
  request_.options.set_water_mask("no such mask.tif");
  const auto estimate = pipeline::estimate(request_);
  ASSERT_FALSE(estimate.ok());
  EXPECT_EQ(estimate.problem().parameter, "water_mask") << estimate.problem().line();
}

}  // namespace
}  // namespace cordillera::server
