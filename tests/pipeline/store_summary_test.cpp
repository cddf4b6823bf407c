// What a manifest says of all tiles together: sums of levels, the source's range, notes, bounds.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <utility>

#include "pipeline/store/store_publish.h"
#include "tests/pipeline/store_written.h"

namespace cordillera::pipeline {
namespace {

using namespace testing;

TEST(Store, SumsAndErrorsOfLevels) {
  const TemporaryFolder folder;
  auto work = tasks();
  // A level whose own error is below its children's, and two tiles with equal bytes.
  for (FinishedTask& task : work) {
    if (task.node.z == 3) {
      for (EncodedTile& tile : task.tiles) tile.record.set_max_error(0.25);
    }
  }
  ASSERT_FALSE(work[0].tiles.empty() || work[1].tiles.empty());
  work[1].tiles[0].drc = work[0].tiles[0].drc;
  const proto::Manifest manifest = write_store(folder / "a.db", work);
  double before = 0, bytes = 0;
  ASSERT_EQ(manifest.levels_size(), 7);
  for (int k = 0; k < 7; ++k) {
    const proto::LevelSummary& level = manifest.levels(k);
    EXPECT_EQ(level.level(), 6U - static_cast<unsigned>(k));
    EXPECT_EQ(level.target(), std::ldexp(1, k));
    EXPECT_EQ(level.rmse(), 0.5);
    EXPECT_GE(level.geometric_error(), before);
    EXPECT_GE(level.geometric_error(), level.stated_max_error());
    EXPECT_EQ(level.triangles(), 128 * level.tiles());
    before = level.geometric_error();
    bytes += level.drc_bytes() + level.glb_bytes();
  }
  EXPECT_EQ(manifest.levels(3).stated_max_error(), 0.25);
  EXPECT_EQ(manifest.levels(3).geometric_error(), manifest.levels(2).geometric_error());
  EXPECT_EQ(manifest.bytes(), bytes);
  double finest = 0;
  for (const FinishedTask& task : work) {
    if (task.node.z == 6 && task.node != work[1].node && !task.tiles.empty())
      finest += static_cast<double>(task.tiles[0].drc.size());
  }
  EXPECT_EQ(manifest.levels(0).drc_bytes(), finest) << "equal bytes are counted once";
  EXPECT_NEAR(manifest.bounds(0), -180 + 62 * 180 / 64.0, 0.01);
  EXPECT_NEAR(manifest.bounds(1), -90 + 40 * 180 / 64.0, 0.01);
  EXPECT_NEAR(manifest.bounds(2), -180 + 68 * 180 / 64.0, 0.01);
  EXPECT_NEAR(manifest.bounds(3), -90 + 44 * 180 / 64.0, 0.1);
}

TEST(Store, TheSourcesRangeIsThatOfItsSamplesAndNotOfMeshes) {
  const TemporaryFolder folder;
  auto work = tasks();
  work[0].tiles.at(0).record.set_lowest_sample(-12.5);
  work[0].tiles.at(0).record.set_highest_sample(40);
  work[1].tiles.at(0).record.set_lowest_sample(3);
  work[1].tiles.at(0).record.set_highest_sample(4321.5);
  const proto::Manifest manifest = write_store(folder / "a.db", work);
  EXPECT_EQ(manifest.source().min_height(), -12.5);
  EXPECT_EQ(manifest.source().max_height(), 4321.5);
  EXPECT_EQ(manifest.levels(0).max_height(), 1600) << "of its mesh";
}

TEST(Store, HowMuchOfTheDataWasFilledIsNoted) {
  const TemporaryFolder folder;
  const auto notes = [&](std::uint32_t filled) {
    auto work = tasks();
    for (FinishedTask& task : work) {
      for (EncodedTile& tile : task.tiles) {
        tile.record.set_valid_samples(100000);
        tile.record.set_filled_samples(filled);
      }
    }
    const proto::Manifest manifest = write_store(folder / (std::to_string(filled) + ".db"), work);
    EXPECT_NEAR(manifest.source().filled_share(), filled / 100000.0, 1e-9);
    return std::vector<std::string>(manifest.notes().begin(), manifest.notes().end());
  };
  using Notes = std::vector<std::string>;
  EXPECT_EQ(notes(0), Notes{});
  EXPECT_EQ(notes(3500), Notes{"3.5 % of the data were voids and are filled; voids=hole keeps them"});
  EXPECT_EQ(notes(42000), Notes{"42 % of the data were voids and are filled; voids=hole keeps them"});
  EXPECT_EQ(notes(1), Notes{"Less than 0.01 % of the data were voids and are filled; voids=hole keeps them"});
}

TEST(Store, DataThatTheFinestLevelDoesNotShowIsNoted) {
  const TemporaryFolder folder;
  std::uint32_t tiles = 0;
  const auto notes = [&](std::uint32_t uncovered) {
    auto work = tasks();
    tiles = 0;
    for (FinishedTask& task : work) {
      if (task.node.z != 6) continue;
      for (EncodedTile& tile : task.tiles) {
        tile.record.mutable_pixels()->set_pixels(100 - uncovered);
        tile.record.mutable_pixels()->set_uncovered(uncovered);
        ++tiles;
      }
    }
    const proto::Manifest manifest = write_store(folder / (std::to_string(uncovered) + ".db"), work);
    return std::vector<std::string>(manifest.notes().begin(), manifest.notes().end());
  };
  using Notes = std::vector<std::string>;
  EXPECT_EQ(notes(0), Notes{});
  EXPECT_EQ(notes(50), Notes{});
  const Notes most = notes(75);
  EXPECT_EQ(most, Notes{std::to_string(75 * tiles) + " of " + std::to_string(100 * tiles) +
                        " pixels with data are under no triangle of the finest level, where rims may move by one of its cells; "
                        "max_level=7 keeps more of them"});
}

TEST(Store, AnotherDatumThanTheRasterDeclaresIsNotedOnce) {
  const TemporaryFolder folder;
  const auto published = [&](const proto::Manifest& blank) {
    auto store = writer(folder / (std::to_string(blank.ByteSizeLong()) + ".db"), synthetic_plan(6));
    for (const FinishedTask& task : tasks()) EXPECT_TRUE(store->commit(task).ok());
    auto manifest = store->publish(blank);
    EXPECT_TRUE(manifest.ok()) << manifest.problem().line();
    return std::vector<std::string>(manifest->notes().begin(), manifest->notes().end());
  };
  const auto fill = [](const char* declared, const char* used, proto::Source* source) {
    source->set_vertical_datum_declared(declared);
    source->set_vertical_datum(used);
  };
  using Notes = std::vector<std::string>;
  proto::Manifest other = synthetic_manifest(), same = synthetic_manifest(), silent = synthetic_manifest(),
                  several = synthetic_manifest();
  fill("NAVD88 height", "EGM96", other.mutable_source());
  fill("EGM96", "EGM96", same.mutable_source());
  fill("", "EGM96", silent.mutable_source());
  fill("mixed", "EGM96", several.mutable_source());
  for (const char* declared : {"NAVD88 height", "EGM2008", "EGM96", "NAVD88 height"})
    fill(declared, "EGM96", several.add_sources());
  EXPECT_EQ(published(other), Notes{"NAVD88 height declared, EGM96 used"});
  EXPECT_EQ(published(same), Notes{});
  EXPECT_EQ(published(silent), Notes{});
  EXPECT_EQ(published(several), (Notes{"NAVD88 height declared, EGM96 used", "EGM2008 declared, EGM96 used"}));
}

TEST(Store, HorizontalDatumsAreNotedWhereTheyMatter) {
  const TemporaryFolder folder;
  const auto notes = [&](const std::vector<std::pair<const char*, bool>>& sources) {
    proto::Manifest blank = synthetic_manifest();
    for (const auto& [datum, ignored] : sources) {
      proto::Source* const source = sources.size() == 1 ? blank.mutable_source() : blank.add_sources();
      source->set_crs("unknown");
      source->set_horizontal_datum(datum);
      source->set_datum_ignored(ignored);
    }
    note_datums(blank);
    return std::vector<std::string>(blank.notes().begin(), blank.notes().end());
  };
  using Notes = std::vector<std::string>;
  EXPECT_EQ(notes({{"WGS 1984", false}}), Notes{});
  EXPECT_EQ(notes({{"WGS 1984", false}, {"WGS 1984", false}}), Notes{});
  EXPECT_EQ(notes({{"Bessel", true}}),
            Notes{"PROJ knows no way from the datum of unknown (Bessel) to WGS 84, and takes it for that: places "
                  "may be some hundred metres off"});
  EXPECT_EQ(notes({{"GDA94", false}, {"GDA2020", false}, {"GDA94", false}}),
            Notes{"The rasters have 2 horizontal datums (GDA2020, GDA94): where they meet they may be some metres apart"});
}

TEST(Store, WhatWasNotedOfSourcesIsInTheNotesOnceAndNotByHundreds) {
  proto::Manifest manifest = synthetic_manifest();
  manifest.clear_notes();
  manifest.mutable_source()->add_notes("one alone");
  note_datums(manifest);
  EXPECT_EQ(manifest.notes_size(), 1);
  EXPECT_EQ(manifest.notes(0), "one alone");
  manifest.clear_notes();
  for (int k = 0; k < 30; ++k) {
    proto::Source& source = *manifest.add_sources();
    source.add_notes("of all");
    source.add_notes("of number " + std::to_string(k));
  }
  note_datums(manifest);
  EXPECT_EQ(manifest.notes_size(), 11);
  EXPECT_EQ(manifest.notes(0), "of all");
  EXPECT_EQ(manifest.notes(10), "21 more notes stand with the rasters that they are of, in sources");
}

TEST(Store, BoundsCrossTheAntimeridian) {
  const TemporaryFolder folder;
  auto store = writer(folder / "a.db", synthetic_plan(6));
  for (const std::int32_t x : {126, 127, 0, 1, 2}) {
    FinishedTask task;
    task.node = {6, x, 30};
    task.tiles.push_back(*synthetic_tile(kLattice, task.node, hills()));
    ASSERT_TRUE(store->commit(task).ok());
  }
  const auto manifest = store->publish(synthetic_manifest());
  ASSERT_TRUE(manifest.ok());
  EXPECT_NEAR(manifest->bounds(0), 180 - 2 * 180 / 64.0, 0.01);
  EXPECT_NEAR(manifest->bounds(2), -180 + 3 * 180 / 64.0, 0.01);
}

/// A coarse level may have tiles in every column, and data beside the antimeridian alone.
TEST(Store, BoundsAreThoseOfTheDataInItsTiles) {
  const TemporaryFolder folder;
  const auto bounds = [&](double west_deg, double east_deg) {
    const proto::Lattice lattice{0};
    const auto place = folder / (std::to_string(west_deg) + std::to_string(east_deg) + ".db");
    auto store = writer(place, synthetic_plan(0));
    for (const std::int32_t x : {0, 1}) {
      FinishedTask task;
      task.node = {0, x, 0};
      task.tiles.push_back(*synthetic_tile(lattice, task.node, hills()));
      task.tiles[0].record.set_region(0, (x == 0 ? -180 : west_deg) * std::numbers::pi / 180);
      task.tiles[0].record.set_region(2, (x == 0 ? east_deg : 180) * std::numbers::pi / 180);
      if (west_deg < east_deg) {  // on both sides of Greenwich
        task.tiles[0].record.set_region(0, (x == 0 ? west_deg : 0) * std::numbers::pi / 180);
        task.tiles[0].record.set_region(2, (x == 0 ? 0 : east_deg) * std::numbers::pi / 180);
      }
      EXPECT_TRUE(store->commit(task).ok());
    }
    const auto manifest = store->publish(synthetic_manifest());
    EXPECT_TRUE(manifest.ok());
    return std::pair(std::round(manifest->bounds(0) * 1e6) / 1e6, std::round(manifest->bounds(2) * 1e6) / 1e6);
  };
  EXPECT_EQ(bounds(159.6, -159.5), std::pair(159.6, -159.5));
  EXPECT_EQ(bounds(-20, 40), std::pair(-20.0, 40.0));
  EXPECT_EQ(bounds(-180, 180), std::pair(-180.0, 180.0));
  EXPECT_EQ(bounds(-180, 179.75), std::pair(-180.0, 179.75));
}

}  // namespace
}  // namespace cordillera::pipeline
