#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <random>
#include <thread>

#include "pipeline/encode/decode.h"
#include "pipeline/store/mesh_files.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store.h"
#include "pipeline/tileset/manifest_json.h"
#include "tests/pipeline/store_synthetic.h"

namespace cordillera::pipeline {
namespace {

using proto::Lattice;
using proto::TileAddress;
using namespace testing;

const Lattice kLattice{6};

std::vector<FinishedTask> tasks() { return synthetic_tasks(kLattice, {6, 62, 40}, {6, 67, 43}, hills_with_voids()); }

std::unique_ptr<StoreWriter> writer(const std::string& path, const proto::Plan& plan) {
  auto opened = StoreWriter::open(path, plan);
  EXPECT_TRUE(opened.ok()) << opened.problem().line();
  return std::move(opened).value();
}

std::unique_ptr<StoreReader> reader(const std::string& path) {
  auto opened = StoreReader::open(path);
  EXPECT_TRUE(opened.ok()) << opened.problem().line();
  return std::move(opened).value();
}

proto::Manifest write_store(const std::string& path, const std::vector<FinishedTask>& work) {
  auto store = writer(path, synthetic_plan(6));
  for (const FinishedTask& task : work) EXPECT_TRUE(store->commit(task).ok());
  auto manifest = store->publish(synthetic_manifest());
  EXPECT_TRUE(manifest.ok()) << manifest.problem().line();
  EXPECT_TRUE(StoreReader::open(path).ok()) << "readable at once, while the writer still lives";
  return *manifest;
}

std::string problem_type(const std::string& path) {
  auto opened = StoreReader::open(path);
  return opened ? "" : opened.problem().type;
}

TEST(Store, GivesBackWhatWasPutIn) {
  const TemporaryFolder folder;
  const auto work = tasks();
  write_store(folder / "a.db", work);
  const auto store = reader(folder / "a.db");
  std::size_t tiles = 0;
  for (const FinishedTask& task : work) {
    for (const EncodedTile& tile : task.tiles) {
      ++tiles;
      const auto drc = store->tile(task.node, Encoding::drc), glb = store->tile(task.node, Encoding::glb);
      ASSERT_TRUE(drc && glb);
      EXPECT_EQ(drc->bytes, tile.drc);
      EXPECT_EQ(glb->bytes, tile.glb);
      EXPECT_EQ(drc->etag.size(), 32U);
      EXPECT_NE(drc->etag, glb->etag);
      const auto record = store->record(task.node);
      ASSERT_TRUE(record);
      EXPECT_EQ(record->glb_bytes(), tile.glb.size());
      EXPECT_EQ(record->max_error(), tile.record.max_error());
    }
  }
  EXPECT_EQ(tiles, store->manifest().tiles());
  EXPECT_FALSE(store->tile({6, 1, 1}, Encoding::drc));
  EXPECT_FALSE(store->record({5, 0, 0}));
}

TEST(Store, OrderOfCommitsDoesNotShow) {
  const TemporaryFolder folder;
  auto work = tasks();
  const proto::Manifest a = write_store(folder / "a.db", work);
  std::shuffle(work.begin(), work.end(), std::mt19937(7));
  const proto::Manifest b = write_store(folder / "b.db", work);
  EXPECT_EQ(a.SerializeAsString(), b.SerializeAsString());
  const auto first = reader(folder / "a.db"), second = reader(folder / "b.db");
  for (const FinishedTask& task : work) {
    const auto p = first->tile(task.node, Encoding::glb), q = second->tile(task.node, Encoding::glb);
    ASSERT_EQ(p.has_value(), q.has_value());
    EXPECT_EQ(p ? p->etag + p->bytes : "", q ? q->etag + q->bytes : "");
  }
}

TEST(Store, ContinuesAfterAStop) {
  const TemporaryFolder folder;
  const auto work = tasks();
  {
    auto store = writer(folder / "a.db", synthetic_plan(6));
    for (std::size_t k = 0; k < 10; ++k) ASSERT_TRUE(store->commit(work[k]).ok());
  }
  EXPECT_EQ(problem_type(folder / "a.db"), "store-unpublished");
  {
    auto store = writer(folder / "a.db", synthetic_plan(6));
    for (std::size_t k = 0; k < work.size(); ++k) EXPECT_EQ(store->finished(work[k].node), k < 10);
    EXPECT_EQ(store->mesh(work[3].node), work[3].mesh->second);
    EXPECT_FALSE(store->mesh(work[11].node));
    for (std::size_t k = 10; k < work.size(); ++k) ASSERT_TRUE(store->commit(work[k]).ok());
    EXPECT_FALSE(store->mesh(work[3].node)) << "its parent has consumed it";
    ASSERT_TRUE(store->publish(synthetic_manifest()).ok());
  }
  const proto::Manifest whole = write_store(folder / "b.db", work);
  EXPECT_EQ(reader(folder / "a.db")->manifest().SerializeAsString(), whole.SerializeAsString());
}

TEST(Store, AnotherPlanStartsAnewAndTheSameOneIsDone) {
  const TemporaryFolder folder;
  const auto work = tasks();
  const proto::Manifest manifest = write_store(folder / "a.db", work);
  {
    auto again = writer(folder / "a.db", synthetic_plan(6));
    EXPECT_TRUE(again->finished({6, 0, 0}));
    EXPECT_FALSE(again->commit(work[0]).ok());
    EXPECT_EQ(again->publish({})->SerializeAsString(), manifest.SerializeAsString());
  }
  EXPECT_TRUE(StoreReader::open(folder / "a.db").ok());
  proto::Plan other = synthetic_plan(6);
  other.set_program("another");
  auto anew = writer(folder / "a.db", other);
  EXPECT_FALSE(anew->finished(work[0].node));
  EXPECT_EQ(problem_type(folder / "a.db"), "store-unpublished");
}

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

TEST(Store, ExtentsHoldWhatLiesBelow) {
  const TemporaryFolder folder;
  auto work = tasks();
  // An island that coarser levels dropped: no tile of level 4 has triangles.
  for (FinishedTask& task : work) {
    if (task.node.z == 4) task.tiles.clear();
  }
  write_store(folder / "a.db", work);
  const auto store = reader(folder / "a.db");
  int without_content = 0;
  for (int z = 0; z < 6; ++z) {
    for (const TileExtent& parent : store->extents(z, 0, 0, proto::tiles_across(z) - 1, proto::tiles_up(z) - 1)) {
      without_content += !parent.content;
      EXPECT_EQ(parent.content, z != 4);
      const TileAddress sw = parent.tile.child(0), ne = parent.tile.child(3);
      const auto children = store->extents(z + 1, sw.x, sw.y, ne.x, ne.y);
      EXPECT_GT(children.size(), 0U);
      for (const TileExtent& child : children) {
        EXPECT_GE(parent.geometric_error_m, child.geometric_error_m);
        for (std::size_t k : {0U, 1U, 4U}) EXPECT_LE(parent.region[k], child.region[k]);
        for (std::size_t k : {2U, 3U, 5U}) EXPECT_GE(parent.region[k], child.region[k]);
      }
    }
  }
  EXPECT_GT(without_content, 0);
}

TEST(Store, RefusesWhatIsNoPublishedStore) {
  const TemporaryFolder folder;
  EXPECT_EQ(problem_type(folder / "nothing.db"), "store-missing");
  EXPECT_EQ(problem_type(folder / "."), "store-unknown");
  put_bytes(folder / "empty.db", "");
  EXPECT_EQ(problem_type(folder / "empty.db"), "store-unknown");
  put_bytes(folder / "text.db", std::string(5000, 'x'));
  EXPECT_EQ(problem_type(folder / "text.db"), "store-damaged");
  EXPECT_FALSE(StoreWriter::open(folder / "text.db", synthetic_plan(6)).ok());
  EXPECT_EQ(bytes_of(folder / "text.db").size(), 5000U) << "somebody else's file was touched";

  write_store(folder / "a.db", tasks());
  const std::string whole = bytes_of(folder / "a.db");
  for (int tenth = 1; tenth < 10; ++tenth) {
    put_bytes(folder / "cut.db", whole.substr(0, whole.size() * static_cast<std::size_t>(tenth) / 10));
    EXPECT_NE(problem_type(folder / "cut.db"), "") << tenth;
  }
  put_bytes(folder / "a.db-journal", "something");
  EXPECT_EQ(problem_type(folder / "a.db"), "store-unpublished");
}

TEST(Store, ADamagedManifestIsInTheWayOnlyOfWhoReplacesNothing) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.db";
  write_store(path, tasks());
  Database(path, Database::Mode::create).execute("UPDATE meta SET value = x'0aff' WHERE key = 'manifest'");
  ASSERT_EQ(problem_type(path), "store-damaged");
  const std::size_t bytes = bytes_of(path).size();
  const auto refused = StoreWriter::open(path, synthetic_plan(6), Existing::refuse);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "output-exists");
  EXPECT_NE(refused.problem().detail.find("damaged"), std::string::npos) << refused.problem().line();
  EXPECT_EQ(bytes_of(path).size(), bytes) << "a refusal throws nothing away";
  write_store(path, tasks());
  EXPECT_EQ(problem_type(path), "");
}

TEST(Store, NothingToPublishIsAProblemAndKeepsTheWork) {
  const TemporaryFolder folder;
  auto store = writer(folder / "a.db", synthetic_plan(6));
  FinishedTask task;
  task.node = {6, 1, 1};
  ASSERT_TRUE(store->commit(task).ok());
  EXPECT_FALSE(store->publish(synthetic_manifest()).ok());
  EXPECT_TRUE(store->finished({6, 1, 1}));
}

TEST(Store, WhatCannotBeReadWhilePublishingIsAProblem) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.db";
  const auto work = tasks();
  auto store = writer(path, synthetic_plan(6));
  for (const FinishedTask& task : work) ASSERT_TRUE(store->commit(task).ok());
  for (const char* suffix : {"", "-wal"}) std::filesystem::resize_file(path + suffix, 0);
  const auto published = store->publish(synthetic_manifest());
  ASSERT_FALSE(published.ok());
  EXPECT_EQ(published.problem().type, "store-write");
  EXPECT_FALSE(store->finished(work.front().node));
  EXPECT_FALSE(store->mesh(work.front().node));
  EXPECT_FALSE(store->commit(work.front()).ok());
  EXPECT_FALSE(store->publish(synthetic_manifest()).ok());
}

TEST(Store, OneWriterAtATime) {
  const TemporaryFolder folder;
  auto store = writer(folder / "a.db", synthetic_plan(6));
  EXPECT_FALSE(StoreWriter::open(folder / "a.db", synthetic_plan(6)).ok());
}

TEST(Store, MeshesLeaveNoHolesInThePublishedFile) {
  const TemporaryFolder folder;
  auto work = tasks();
  write_store(folder / "small.db", work);
  for (FinishedTask& task : work) task.mesh->second.assign(200000, 'm');
  write_store(folder / "big.db", work);
  EXPECT_LT(std::filesystem::file_size(folder / "big.db"), std::filesystem::file_size(folder / "small.db") + 100000);
}

TEST(Store, WhatTasksLeaveLiesBesideItUntilItIsPublished) {
  const TemporaryFolder folder;
  const auto work = tasks();
  const std::string path = folder / "a.db", kept = MeshFiles::folder_of(path);
  const auto file_of = [&](const TileAddress& node) {
    return kept + "/" + std::to_string(node.z) + "-" + std::to_string(node.x) + "-" + std::to_string(node.y);
  };
  {
    auto store = writer(path, synthetic_plan(6));
    for (std::size_t k = 0; k < 3; ++k) ASSERT_TRUE(store->commit(work[k]).ok());
    EXPECT_EQ(bytes_of(file_of(work[1].node)), work[1].mesh->second);
  }
  std::filesystem::remove(file_of(work[1].node));
  std::string damaged = work[2].mesh->second;
  damaged[100] ^= 1;
  put_bytes(file_of(work[2].node), damaged);
  {
    auto store = writer(path, synthetic_plan(6));
    EXPECT_TRUE(store->finished(work[0].node));
    EXPECT_FALSE(store->finished(work[1].node)) << "its file is gone: it is made again";
    EXPECT_THROW(store->mesh(work[2].node), StoreError) << "another file";
    for (std::size_t k = 1; k < work.size(); ++k) ASSERT_TRUE(store->commit(work[k]).ok());
    ASSERT_TRUE(store->publish(synthetic_manifest()).ok());
  }
  EXPECT_FALSE(std::filesystem::exists(kept));
  EXPECT_EQ(reader(path)->manifest().SerializeAsString(), write_store(folder / "b.db", work).SerializeAsString());
}

TEST(Store, ARemovedOneLeavesNothingBesideIt) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.db";
  ASSERT_TRUE(writer(path, synthetic_plan(6))->commit(tasks().front()).ok());
  remove_store(path);
  EXPECT_TRUE(std::filesystem::is_empty(std::filesystem::path(path).parent_path()));
}

TEST(Store, ManyThreadsRead) {
  const TemporaryFolder folder;
  const auto work = tasks();
  write_store(folder / "odd %?#name.db", work);
  const auto store = reader(folder / "odd %?#name.db");
  std::atomic<int> wrong{0};
  std::vector<std::thread> threads;
  for (int t = 0; t < 8; ++t) {
    threads.emplace_back([&] {
      for (int round = 0; round < 20; ++round) {
        for (const FinishedTask& task : work) {
          const auto blob = store->tile(task.node, Encoding::drc);
          wrong += blob.has_value() == task.tiles.empty() || (blob && blob->bytes != task.tiles[0].drc);
        }
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(wrong, 0);
}

TEST(ManifestJson, PrintsDefaultsUnderTheirOwnNamesAndReadsBack) {
  const TemporaryFolder folder;
  const proto::Manifest manifest = write_store(folder / "a.db", tasks());
  const std::string json = manifest_json(manifest);
  EXPECT_NE(json.find("\"stated_max_error\""), json.npos);
  EXPECT_NE(json.find("\"uncovered_samples\": 0"), json.npos);
  EXPECT_EQ(parse_manifest_json(json)->SerializeAsString(), manifest.SerializeAsString());
  EXPECT_FALSE(parse_manifest_json("{").ok());
}

}  // namespace
}  // namespace cordillera::pipeline
