// Whoever waits for an export or a check is told how far it is.
#include <gtest/gtest.h>

#include <thread>

#include "pipeline/check/check.h"
#include "pipeline/exports/archive_3tz.h"
#include "pipeline/exports/export.h"
#include "pipeline/exports/mbtiles.h"
#include "pipeline/exports/mesh/mesh_extract.h"
#include "pipeline/exports/pmtiles.h"
#include "tests/pipeline/archived_dataset.h"

namespace cordillera::pipeline::exports {
namespace {

using namespace pipeline::testing;

/// What was told, and that it came in order and by one thread.
class Told {
 public:
  ProgressCallback callback() {
    return [this](const proto::Progress& progress) {
      EXPECT_EQ(std::this_thread::get_id(), caller_);
      const bool goes_on = !all_.empty() && all_.back().stage() == progress.stage() && all_.back().total() == progress.total();
      EXPECT_TRUE(!goes_on || progress.done() >= all_.back().done()) << progress.stage();
      EXPECT_LE(progress.done(), progress.total()) << progress.stage();
      all_.push_back(progress);
    };
  }
  /// That a stage with so many steps at least began with none of them and ended with all.
  void expect_whole(const std::string& stage, double least) const {
    double first = -1, last = -1, total = 0;
    for (const proto::Progress& one : all_) {
      if (one.stage() != stage || one.total() == 0) continue;
      first = first < 0 ? one.done() : first;
      last = one.done();
      total = one.total();
    }
    EXPECT_EQ(first, 0) << stage;
    EXPECT_EQ(last, total) << stage;
    EXPECT_GE(total, least) << stage;
  }

 private:
  std::thread::id caller_ = std::this_thread::get_id();
  std::vector<proto::Progress> all_;
};

std::uint64_t tiles_of_all_levels() {
  std::uint64_t tiles = 0;
  for (const auto& level : archived_dataset().terrain().manifest().levels()) tiles += level.tiles();
  return tiles;
}

TEST(ExportProgress, OfArchivesEndsWithAllTiles) {
  const faces::Terrain& terrain = archived_dataset().terrain();
  const auto all = static_cast<double>(tiles_of_all_levels());
  for (const unsigned threads : {1u, 3u}) {
    for (const char* face : {"terrain-rgb", "contours", "hillshade"}) {
      Told pmtiles, mbtiles;
      const std::string name = archived_dataset().place("told" + std::to_string(threads) + face);
      const faces::Face& of = *faces::face_named(face);
      ASSERT_TRUE(write_pmtiles(terrain, of, name + ".pmtiles", Existing::replace, {threads, pmtiles.callback()}).ok());
      ASSERT_TRUE(write_mbtiles(terrain, of, name + ".mbtiles", Existing::replace, {threads, mbtiles.callback()}).ok());
      pmtiles.expect_whole("export", 5);
      mbtiles.expect_whole("export", 5);
    }
    Told drc, whole;
    const std::string name = archived_dataset().place("told" + std::to_string(threads));
    ASSERT_TRUE(
        write_pmtiles(terrain, *faces::face_named("drc"), name + ".pmtiles", Existing::replace, {threads, drc.callback()}).ok());
    drc.expect_whole("export", all);
    ASSERT_TRUE(
        write_3tz(terrain, *faces::face_named("3d-tiles"), name + ".3tz", Existing::replace, {threads, whole.callback()}).ok());
    whole.expect_whole("export", all + 1);
  }
}

TEST(ExportProgress, OfAFolderCountsAllFormats) {
  std::vector<const faces::Face*> chosen;
  for (const char* face : {"drc", "3d-tiles", "quantized-mesh", "drc-mercator"}) {
    if (faces::face_named(face) != nullptr) chosen.push_back(faces::face_named(face));
  }
  ASSERT_GE(chosen.size(), 3u);
  Told told;
  const std::string folder = archived_dataset().place("told_folder");
  ASSERT_TRUE(export_static(archived_dataset().terrain(), chosen, folder, Existing::replace, {2, told.callback()}).ok());
  told.expect_whole("export", 3 * static_cast<double>(tiles_of_all_levels()));
  Told store, checked;
  const auto in_store = check::check_store(archived_dataset().place("a.db"), nullptr, store.callback());
  ASSERT_TRUE(in_store.ok());
  store.expect_whole("checksums", static_cast<double>(in_store->checksums));
  store.expect_whole("tiles", static_cast<double>(tiles_of_all_levels()));
  const auto in_folder = check::check_folder(folder, nullptr, checked.callback());
  ASSERT_TRUE(in_folder.ok());
  checked.expect_whole("tiles", static_cast<double>(tiles_of_all_levels()));
}

TEST(ExportProgress, OfAMeshCountsTheTilesOfItsLevel) {
  Told told;
  ASSERT_TRUE(extract_mesh(archived_dataset().terrain(), {}, told.callback()).ok());
  told.expect_whole("export", static_cast<double>(archived_dataset().terrain().manifest().levels(0).tiles()));
}

}  // namespace
}  // namespace cordillera::pipeline::exports
