// What a disk may do to a store: whoever reads it gets what was written, or is told.
#include <gtest/gtest.h>

#include <algorithm>
#include <map>
#include <random>

#include "pipeline/check/check.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store.h"
#include "pipeline/store/store_revise.h"
#include "tests/pipeline/store_synthetic.h"

namespace cordillera::pipeline {
namespace {

using namespace testing;
using proto::TileAddress;

constexpr int kFinest = 4;
constexpr TileAddress kTile{4, 16, 10}, kNeighbour{4, 17, 10};
constexpr const char* kHere = "level = 4 AND y = 10 AND x = 16";
constexpr const char* kThere = "level = 4 AND y = 10 AND x = 17";

class DamagedStore : public ::testing::Test {
 protected:
  void SetUp() override {
    const proto::Lattice lattice{kFinest};
    proto::Plan plan = synthetic_plan(kFinest);
    plan.mutable_options()->set_water(0);
    auto store = StoreWriter::open(path_, plan);
    ASSERT_TRUE(store.ok());
    std::vector<TileWater> water;
    for (const FinishedTask& task : synthetic_tasks(lattice, {kFinest, 15, 9}, {kFinest, 18, 11}, hills())) {
      ASSERT_TRUE((*store)->commit(task).ok());
      water.push_back({task.node, "water of " + std::to_string(task.node.x)});
    }
    ASSERT_TRUE((*store)->put_water(water).ok());
    ASSERT_TRUE((*store)->publish(synthetic_manifest()).ok());
    whole_ = everything(path_);
    ASSERT_GT(whole_.size(), 50U);
  }

  /// All that can be read of a store, by name. What is refused is not in it; not a byte of it if it cannot be opened.
  static std::map<std::string, std::string> everything(const std::string& path) {
    std::map<std::string, std::string> all;
    const auto opened = StoreReader::open(path);
    if (!opened) return all;
    const StoreReader& store = **opened;
    all["manifest"] = store.manifest().SerializeAsString();
    const auto keep = [&](const std::string& name, const auto& read) {
      try {
        if (const std::optional<std::string> found = read()) all[name] = *found;
      } catch (const StoreError&) { all["refused " + name] = ""; }
    };
    for (int z = 0; z <= kFinest; ++z) {
      for (std::int32_t y = 0; y < proto::tiles_up(z); ++y) {
        for (std::int32_t x = 0; x < proto::tiles_across(z); ++x) {
          const std::string place = std::to_string(z) + "/" + std::to_string(x) + "/" + std::to_string(y);
          for (const Encoding encoding : {Encoding::drc, Encoding::glb}) {
            keep((encoding == Encoding::drc ? "drc " : "glb ") + place, [&]() -> std::optional<std::string> {
              const auto blob = store.tile({z, x, y}, encoding);
              return blob ? std::optional(blob->etag + blob->bytes) : std::nullopt;
            });
          }
          keep("record " + place, [&]() -> std::optional<std::string> {
            const auto record = store.record({z, x, y});
            return record ? std::optional(record->SerializeAsString()) : std::nullopt;
          });
          keep("water " + place, [&]() -> std::optional<std::string> {
            std::string mask = store.water({z, x, y});
            return mask.empty() ? std::nullopt : std::optional(std::move(mask));
          });
          keep("node " + place, [&]() -> std::optional<std::string> {
            const auto found = store.extents(z, x, y, x, y);
            if (found.empty()) return std::nullopt;
            std::string text = std::to_string(found[0].geometric_error_m);
            for (const double number : found[0].region) text += " " + std::to_string(number);
            return text;
          });
        }
      }
    }
    return all;
  }

  /// How much is missing or refused; whatever is there must be what was written.
  std::size_t lost(const std::string& path, const std::string& what) {
    const auto found = everything(path);
    std::size_t there = 0;
    for (const auto& [name, bytes] : found) {
      if (name.starts_with("refused ")) continue;
      ++there;
      const auto written = whole_.find(name);
      EXPECT_TRUE(written != whole_.end() && written->second == bytes) << name << " is not what was written: " << what;
    }
    return whole_.size() - std::min(there, whole_.size());
  }

  /// Why it is not opened; empty: it is.
  std::string refusal() const {
    const auto store = StoreReader::open(path_);
    return store.ok() ? "" : store.problem().type;
  }
  void change(const std::string& sql) { Database(path_, Database::Mode::create).execute(sql); }
  bool refuses(const TileAddress& tile, Encoding encoding) {
    const auto store = StoreReader::open(path_);
    try {
      (void)(*store)->tile(tile, encoding);
      return false;
    } catch (const StoreError&) { return true; }
  }
  /// As an earlier version wrote it.
  void take_sums_away() {
    for (const char* table : {"meta", "tiles", "water", "nodes"})
      change("ALTER TABLE " + std::string(table) + " DROP COLUMN sum");
  }
  bool check_finds_something() {
    const auto report = check::check_store(path_, nullptr);
    return !report.ok() || !report->sound();
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "a.sqlite";
  std::map<std::string, std::string> whole_;
};

TEST_F(DamagedStore, GivesNoOtherBytesAfterFlips) {
  const std::string sound = bytes_of(path_), damaged = folder_ / "flipped.sqlite";
  std::mt19937 random(20);
  std::size_t noticed = 0;
  for (int round = 0; round < 400; ++round) {
    std::string bytes = sound;
    const std::size_t at = random() % bytes.size();
    bytes[at] = static_cast<char>(bytes[at] ^ 1 << random() % 8);
    put_bytes(damaged, bytes);
    noticed += lost(damaged, "bit flipped in byte " + std::to_string(at)) > 0;
  }
  EXPECT_GT(noticed, 200U) << "most bytes of a store are bytes of tiles";
}

TEST_F(DamagedStore, GivesNoOtherBytesAfterCutsAndEmptiedPages) {
  const std::string sound = bytes_of(path_), damaged = folder_ / "cut.sqlite";
  constexpr std::size_t kPage = 4096;
  for (std::size_t page = 0; page < sound.size() / kPage; ++page) {
    std::string bytes = sound;
    bytes.replace(page * kPage, kPage, kPage, '\0');
    put_bytes(damaged, bytes);
    lost(damaged, "page " + std::to_string(page) + " of zeros");
    put_bytes(damaged, sound.substr(0, page * kPage));
    lost(damaged, "cut before page " + std::to_string(page));
  }
}

TEST_F(DamagedStore, NeverServesTheNeighboursMesh) {
  for (const std::string column : {"drc", "glb"}) {
    change("UPDATE tiles SET " + column + " = (SELECT " + column + " FROM tiles WHERE " + kThere + ") WHERE " + kHere);
    EXPECT_TRUE(refuses(kTile, column == "drc" ? Encoding::drc : Encoding::glb)) << column;
  }
  EXPECT_FALSE(refuses(kNeighbour, Encoding::drc));
  EXPECT_TRUE(check_finds_something());
}

TEST_F(DamagedStore, NeverServesARowInAnothersPlace) {
  change(std::string("UPDATE tiles SET x = 99 WHERE ") + kHere + "; UPDATE tiles SET x = 16 WHERE " + kThere +
         "; UPDATE tiles SET x = 17 WHERE x = 99");
  for (const TileAddress& tile : {kTile, kNeighbour}) {
    for (const Encoding encoding : {Encoding::drc, Encoding::glb}) EXPECT_TRUE(refuses(tile, encoding));
  }
  lost(path_, "two rows swapped");
}

/// Who asks for such a tile would be told that there is none, and be shown the level above.
TEST_F(DamagedStore, SaysSoWhereARowIsGoneOrHasAnotherKey) {
  const std::string sound = bytes_of(path_);
  ASSERT_EQ(refusal(), "");
  for (const std::string table : {"tiles", "nodes"}) {
    for (const std::string& damage :
         {"DELETE FROM " + table + " WHERE " + kHere, "UPDATE " + table + " SET x = 90 WHERE " + kHere,
          "UPDATE " + table + " SET level = 3 WHERE " + kHere}) {
      put_bytes(path_, sound);
      change(damage);
      EXPECT_EQ(refusal(), "store-damaged") << damage;
      EXPECT_TRUE(check_finds_something()) << damage;
    }
  }
}

TEST_F(DamagedStore, SaysSoWhereBytesAreGone) {
  change(std::string("DELETE FROM blobs WHERE hash = (SELECT drc FROM tiles WHERE ") + kHere + ")");
  EXPECT_TRUE(refuses(kTile, Encoding::drc)) << "a tile that is listed is no missing one";
}

TEST_F(DamagedStore, OfAnEarlierVersionIsReadAndWatchedAsFarAsItTells) {
  take_sums_away();
  EXPECT_EQ(lost(path_, "nothing was done"), 0U);
  change(std::string("UPDATE tiles SET drc = (SELECT drc FROM tiles WHERE ") + kThere +
         "), record = (SELECT record FROM tiles WHERE " + kThere + ") WHERE " + kHere);
  EXPECT_TRUE(refuses(kTile, Encoding::drc));
  change("UPDATE blobs SET bytes = CAST('x' || bytes AS BLOB) WHERE hash = (SELECT glb FROM tiles WHERE " + std::string(kThere) +
         ")");
  EXPECT_TRUE(refuses(kNeighbour, Encoding::glb));
}

TEST_F(DamagedStore, GivesNoNoteInPlaceOfAnother) {
  ASSERT_TRUE(note_in(path_, "plan"));
  change("UPDATE meta SET value = (SELECT value FROM meta WHERE key = 'manifest') WHERE key = 'plan'");
  EXPECT_FALSE(note_in(path_, "plan"));
  EXPECT_THROW((void)sound_note_in(path_, "plan"), StoreError) << "it is none of none";
  EXPECT_FALSE(sound_note_in(path_, "nothing"));
  EXPECT_TRUE(note_in(path_, "manifest"));
  take_sums_away();
  EXPECT_TRUE(note_in(path_, "plan")) << "who has no sums cannot tell";
}

/// Whoever made the file may have put anything into its schema.
TEST_F(DamagedStore, IsRefusedWhereItsSchemaHasCode) {
  const std::string sound = bytes_of(path_);
  proto::Plan plan;
  ASSERT_TRUE(plan.ParseFromString(note_in(path_, "plan").value()));
  const bool has_rtree =
      Database("", Database::Mode::scratch).knows("SELECT * FROM pragma_module_list WHERE name = 'rtree'") &&
      Database("", Database::Mode::scratch).integer("SELECT count(*) FROM pragma_module_list WHERE name = 'rtree'") > 0;
  const struct {
    std::string sql, code;
  } kRows[] = {
      {"ALTER TABLE blobs RENAME TO b0; CREATE VIEW blobs AS WITH RECURSIVE r(n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM "
       "r) SELECT b0.* FROM b0, r WHERE r.n < 0",
       "view blobs"},
      {"CREATE TRIGGER late AFTER UPDATE ON tiles BEGIN SELECT 1; END", "trigger late"},
      {"ALTER TABLE blobs ADD COLUMN more AS (zeroblob(900000000))", "computed column more of blobs"},
      {has_rtree ? "CREATE VIRTUAL TABLE box USING rtree(id, west, east)" : "", "virtual table box"}};
  for (const auto& row : kRows) {
    if (row.sql.empty()) continue;
    put_bytes(path_, sound);
    change(row.sql);
    const auto store = StoreReader::open(path_);
    ASSERT_FALSE(store.ok()) << row.code;
    EXPECT_EQ(store.problem().type, "store-damaged");
    EXPECT_NE(store.problem().detail.find(row.code), std::string::npos) << store.problem().detail;
    EXPECT_EQ(StoreReader::manifest_of(path_).problem().type, "store-damaged") << row.code;
    EXPECT_FALSE(note_in(path_, "plan")) << row.code;
    EXPECT_FALSE(check::check_store(path_, nullptr).ok()) << row.code;
    const auto writer = StoreWriter::open(path_, plan, Existing::refuse);
    ASSERT_FALSE(writer.ok()) << row.code;
    EXPECT_NE(writer.problem().detail.find("holds a damaged build"), std::string::npos) << writer.problem().detail;
  }
}

/// One more wall behind that one.
TEST(SqliteFile, RunsNothingOfItsSchema) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.sqlite";
  Database(path, Database::Mode::create)
      .execute(
          "CREATE TABLE t(a); CREATE TABLE seen(a); INSERT INTO t VALUES(1); CREATE VIEW v AS SELECT a FROM t; CREATE VIEW large "
          "AS "
          "SELECT length(zeroblob(65 << 20)) AS a; CREATE VIEW endless AS WITH RECURSIVE r(n) AS (SELECT 0 UNION ALL SELECT n + "
          "1 "
          "FROM r) SELECT n FROM r WHERE n < 0; CREATE VIEW ours AS SELECT row_sum(1) AS a; CREATE TRIGGER late AFTER INSERT ON "
          "t "
          "BEGIN INSERT INTO seen VALUES(1); END");
  for (const auto mode : {Database::Mode::published, Database::Mode::shared, Database::Mode::kept, Database::Mode::create}) {
    Database database(path, mode);
    EXPECT_THROW(database.integer("SELECT a FROM v"), StoreError);
    EXPECT_EQ(database.integer("SELECT a FROM t"), 1);
  }
  Database(path, Database::Mode::create).execute("INSERT INTO t VALUES(2)");
  Database read(path, Database::Mode::published);
  EXPECT_EQ(read.integer("SELECT count(*) FROM seen"), 0) << "the trigger ran";
  EXPECT_THROW(read.integer("SELECT length(zeroblob(300 << 20))"), StoreError);

  std::atomic<bool> stop{false};
  Database foreign(path, Database::Mode::foreign, &stop);
  EXPECT_EQ(foreign.integer("SELECT a FROM v"), 1);
  EXPECT_THROW(foreign.integer("SELECT a FROM large"), StoreError);
  EXPECT_THROW(foreign.integer("SELECT a FROM ours"), StoreError) << "a view calls the program's own function";
  stop = true;
  EXPECT_THROW(foreign.integer("SELECT n FROM endless"), StoreError);
  stop = false;
  foreign.bound_steps(2);
  EXPECT_THROW(foreign.integer("SELECT n FROM endless"), StoreError);
  const std::string many = "WITH RECURSIVE r(n) AS (SELECT 0 UNION ALL SELECT n + 1 FROM r WHERE n < 500000) SELECT n FROM r";
  Statement rows(foreign, many);  // more than two millions together
  std::int64_t seen = 0;
  while (rows.step()) ++seen;
  EXPECT_EQ(seen, 500001);
}

TEST_F(DamagedStore, IsFoundByCheckInThePlanToo) {
  // What a program of another version planned is a sound plan: nothing but the row's own sum can tell.
  proto::Plan plan = synthetic_plan(kFinest);
  plan.set_program("another");
  {
    Database database(path_, Database::Mode::create);
    Statement(database, "UPDATE meta SET value = ? WHERE key = 'plan'").bind(plan.SerializeAsString()).run();
  }
  const auto report = check::check_store(path_, nullptr);
  ASSERT_TRUE(report.ok());
  const auto& found = report->findings.kept();
  EXPECT_TRUE(
      std::any_of(found.begin(), found.end(), [](const check::Finding& finding) { return finding.where == "meta plan"; }));
}

/// 20,001 tiles are more than are looked for when a store is opened: those of its finest level are not.
TEST(LargeStore, IsCountedDownToTheLevelThatIsTooLarge) {
  constexpr int kDeep = 8;
  const TemporaryFolder folder;
  const std::string path = folder / "a.sqlite";
  const proto::Lattice lattice{kDeep};
  {
    auto store = StoreWriter::open(path, synthetic_plan(kDeep));
    ASSERT_TRUE(store.ok());
    for (const FinishedTask& task : synthetic_tasks(lattice, {kDeep, 255, 150}, {kDeep, 255, 150}, hills()))
      ASSERT_TRUE((*store)->commit(task).ok());
  }
  Database(path, Database::Mode::create)
      .execute(
          "WITH RECURSIVE n(k) AS (SELECT 0 UNION ALL SELECT k + 1 FROM n WHERE k < 19999) "
          "INSERT INTO tiles SELECT level, k / 200, k % 200, record, drc, glb, error, west, south, east, north, low, high, "
          "row_sum(level, k / 200, k % 200, record, drc, glb) FROM n, tiles WHERE level = 8");
  ASSERT_TRUE((*StoreWriter::open(path, synthetic_plan(kDeep)))->publish(synthetic_manifest()).ok());
  const std::string sound = bytes_of(path);
  ASSERT_EQ(StoreReader::manifest_of(path)->levels(0).tiles(), 20'001U);
  const auto after = [&](const std::string& damage) {
    put_bytes(path, sound);
    Database(path, Database::Mode::create).execute(damage);
    const auto store = StoreReader::open(path);
    return store ? "opened" : store.problem().type;
  };
  EXPECT_EQ(after("SELECT 1"), "opened");
  EXPECT_EQ(after("DELETE FROM tiles WHERE level = 7"), "store-damaged");
  EXPECT_EQ(after("DELETE FROM nodes WHERE level = 0"), "store-damaged");
  EXPECT_EQ(after("DELETE FROM tiles WHERE level = 8 AND y = 9 AND x = 9"), "opened") << "check counts those too";
}

TEST(UnfinishedStore, OfAnEarlierVersionGetsItsSums) {
  const TemporaryFolder folder;
  const std::string path = folder / "a.sqlite";
  const proto::Lattice lattice{2};
  const auto work = synthetic_tasks(lattice, {2, 3, 1}, {2, 4, 2}, hills());
  {
    auto store = StoreWriter::open(path, synthetic_plan(2));
    ASSERT_TRUE(store.ok() && (*store)->commit(work[0]).ok());
  }
  Database(path, Database::Mode::create).execute("ALTER TABLE meta DROP COLUMN sum; ALTER TABLE tiles DROP COLUMN sum");
  auto store = StoreWriter::open(path, synthetic_plan(2));
  ASSERT_TRUE(store.ok());
  EXPECT_TRUE((*store)->finished(work[0].node)) << "it was begun anew";
  for (std::size_t k = 1; k < work.size(); ++k) ASSERT_TRUE((*store)->commit(work[k]).ok());
  ASSERT_TRUE((*store)->publish(synthetic_manifest()).ok());
  const auto reader = StoreReader::open(path);
  ASSERT_TRUE(reader.ok());
  EXPECT_EQ((*reader)->tile(work[0].node, Encoding::drc)->bytes, work[0].tiles[0].drc);
}

}  // namespace
}  // namespace cordillera::pipeline
