#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <future>
#include <random>
#include <thread>

#include "pipeline/encode/json.h"
#include "pipeline/store/mesh_files.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store.h"
#include "pipeline/tileset/manifest_json.h"
#include "tests/pipeline/store_written.h"

namespace cordillera::pipeline {
namespace {

using proto::Lattice;
using proto::TileAddress;
using namespace testing;

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

TEST(Store, AnyThreadMayKeepWhatATaskLeavesBeforeItsTurn) {
  const TemporaryFolder folder;
  auto work = tasks();
  const auto left = work[1].mesh->second;
  auto store = writer(folder / "a.db", synthetic_plan(6));
  std::vector<std::future<void>> threads;
  for (FinishedTask& task : work) threads.push_back(std::async(std::launch::async, [&] { store->keep(task); }));
  threads.clear();
  EXPECT_TRUE(work[1].mesh_is_kept);
  EXPECT_LT(work[1].mesh->second.size(), left.size()) << "its hash";
  EXPECT_FALSE(store->finished(work[1].node)) << "that is for its commit";
  for (const FinishedTask& task : work) {
    ASSERT_TRUE(store->commit(task).ok());
    if (task.node == work[1].node) EXPECT_EQ(store->mesh(task.node), left);
  }
  ASSERT_TRUE(store->publish(synthetic_manifest()).ok());
  EXPECT_EQ(reader(folder / "a.db")->manifest().SerializeAsString(), write_store(folder / "b.db", tasks()).SerializeAsString());
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

/// A build of one raster has no sources, and the same published from tasks has.
TEST(ManifestJson, WritesANumberInOneWay) {
  proto::Manifest one;
  one.set_cell_m(76.298408042096654);
  proto::Manifest several = one;
  several.add_sources();
  const auto line = [](const std::string& json) { return json.substr(json.find("\"cell_m\""), 30); };
  EXPECT_EQ(line(manifest_json(one)), line(manifest_json(several)));
}

TEST(ManifestJson, OfSeveralRastersSaysWhatIsKnownOfEach) {
  proto::Manifest manifest;
  manifest.mutable_source()->set_columns(300);
  manifest.mutable_source()->set_rows(500);
  manifest.mutable_source()->set_lattice_samples(1e6);
  for (const auto& [columns, rows] : {std::pair{100u, 500u}, {300u, 50u}}) {
    manifest.add_sources()->set_columns(columns);
    manifest.mutable_sources()->rbegin()->set_rows(rows);
  }
  const Json mixed = Json::parse(manifest_json(manifest));
  EXPECT_EQ(mixed["sources"][1]["columns"], 300);
  EXPECT_FALSE(mixed["sources"][1].contains("min_height")) << "0 m would be a measurement";
  EXPECT_EQ(mixed["source"]["min_height"], 0) << "of the whole it is one";
  EXPECT_FALSE(mixed["source"].contains("rows"));
  manifest.clear_sources();
  for (int k = 0; k < 2; ++k) *manifest.add_sources() = manifest.source();
  EXPECT_EQ(Json::parse(manifest_json(manifest))["source"]["rows"], 500);
}

TEST(Sqlite, WantOfRoomIsToldApart) {
  Database database("", Database::Mode::scratch);
  database.execute("PRAGMA max_page_count = 1");
  EXPECT_THROW(database.execute("CREATE TABLE a (b)"), DiskFull);
  try {
    database.execute("no SQL");
    ADD_FAILURE();
  } catch (const DiskFull&) { ADD_FAILURE(); } catch (const StoreError&) {
  }
}

}  // namespace
}  // namespace cordillera::pipeline
