// What check says of a store's tables, notes and manifest: what is there, and what is expected.
#include <gtest/gtest.h>

#include "pipeline/check/check.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store.h"
#include "pipeline/store/store_revise.h"
#include "pipeline/store/store_schema.h"
#include "pipeline/work/work_plan.h"
#include "tests/pipeline/store_synthetic.h"
#include "work.pb.h"

namespace cordillera::pipeline {
namespace {

using namespace testing;

constexpr int kCheckedFinest = 4;

/// What check says of a store, a line a finding.
std::string findings_of(const std::string& path) {
  const auto report = check::check_store(path, nullptr);
  if (!report) return "refused: " + report.problem().type;
  std::string lines;
  for (const check::Finding& finding : report->findings.kept()) lines += finding.where + ": " + finding.what + "\n";
  return lines;
}

class CheckedStore : public ::testing::Test {
 protected:
  void SetUp() override {
    const proto::Lattice lattice{kCheckedFinest};
    auto store = StoreWriter::open(path_, synthetic_plan(kCheckedFinest));
    ASSERT_TRUE(store.ok());
    for (const FinishedTask& task : synthetic_tasks(lattice, {kCheckedFinest, 15, 9}, {kCheckedFinest, 16, 10}, hills()))
      ASSERT_TRUE((*store)->commit(task).ok());
    ASSERT_TRUE((*store)->publish(synthetic_manifest()).ok());
  }
  void change(const std::string& sql) { Database(path_, Database::Mode::create).execute(sql); }

  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "a.sqlite";
};

TEST_F(CheckedStore, HasNoTablesOfABuild) {
  const std::string sound = bytes_of(path_);
  const struct {
    const char* damage;
    const char* finding;
  } kRows[] = {
      {"CREATE TABLE tasks(level INT, y INT, x INT); INSERT INTO tasks VALUES(4, 1, 1)",
       "table tasks: it has 1 row of a build that is over; expected: no such table"},
      {"CREATE TABLE tasks(level INT, y INT, x INT)", "table tasks: it has 0 rows of a build that is over"},
      {"CREATE TABLE meshes(id INTEGER PRIMARY KEY, level INT, y INT, x INT, bytes BLOB); INSERT INTO meshes VALUES(1, 4, 1, 1, "
       "x'00'), (2, 4, 1, 2, x'00')",
       "table meshes: it has 2 rows of a build that is over; expected: no such table in a store that is not built on"},
      {"CREATE TABLE songs(title TEXT)", "table songs: no store has it; expected: the tables meta, tiles, blobs and nodes"},
      {"CREATE TRIGGER late AFTER UPDATE ON tiles BEGIN SELECT 1; END", "refused: store-damaged"},
      {"CREATE INDEX quick ON blobs(bytes)", "index quick: no store has it"},
  };
  const std::string before = findings_of(path_);
  EXPECT_EQ(before.find("table"), std::string::npos) << before;
  for (const auto& row : kRows) {
    put_bytes(path_, sound);
    change(row.damage);
    EXPECT_NE(findings_of(path_).find(row.finding), std::string::npos) << row.damage << "\n" << findings_of(path_);
  }
}

TEST_F(CheckedStore, SaysTheFormatThatItHas) {
  change("UPDATE tiles SET glb = x'', sum = row_sum(level, y, x, record, drc, x'') WHERE level = 4 AND y = 10 AND x = 16");
  EXPECT_EQ(findings_of(path_).find("format"), std::string::npos) << "format 2 may have both: it was continued";
  change("PRAGMA user_version = 1");
  EXPECT_NE(findings_of(path_).find("format: it is 1, and it has 1 tile without a stored .glb; expected: 2"), std::string::npos)
      << findings_of(path_);
  change("PRAGMA user_version = 3");
  EXPECT_EQ(findings_of(path_), "refused: store-version");
}

TEST_F(CheckedStore, SaysInItsManifestWhatSuchAStoreHas) {
  const auto sound = StoreReader::manifest_of(path_);
  ASSERT_TRUE(sound.ok());
  const auto with = [&](const auto& change_it) {
    proto::Manifest manifest = *sound;
    change_it(manifest);
    Database database(path_, Database::Mode::create);
    Statement(database, "UPDATE meta SET value = ?1, sum = row_sum(key, ?1) WHERE key = 'manifest'")
        .bind(manifest.SerializeAsString())
        .run();
    return findings_of(path_);
  };
  EXPECT_EQ(with([](proto::Manifest&) {}).find("manifest"), std::string::npos);
  const std::string tiles = std::to_string(sound->tiles());
  const std::string found[] = {with([](proto::Manifest& m) { m.set_program("another 7"); }),
                               "manifest: program is 'another 7'; expected: ''",
                               with([](proto::Manifest& m) { m.set_height_datum("the sea"); }),
                               "manifest: height_datum is 'the sea'; expected: 'WGS 84 ellipsoid'",
                               with([](proto::Manifest& m) { m.set_drc_formula("x + y"); }),
                               "manifest: drc_formula is 'x + y'; expected: '",
                               with([](proto::Manifest& m) { m.set_max_level(9); }),
                               "manifest: max_level is '9'; expected: '4'",
                               with([](proto::Manifest& m) { m.set_tiles(1); }),
                               "manifest: tiles is '1'; expected: '" + tiles + "'",
                               with([](proto::Manifest& m) { m.set_bytes(1); }),
                               "manifest: its levels, sums or bounds are not those of the tiles"};
  for (std::size_t k = 0; k < std::size(found); k += 2)
    EXPECT_NE(found[k].find(found[k + 1]), std::string::npos) << found[k + 1] << "\n" << found[k];
}

/// A store that is built on keeps what its tasks left, and nothing else.
class KeptStore : public ::testing::Test {
 protected:
  void SetUp() override {
    const proto::Lattice lattice{kCheckedFinest};
    const auto tasks = synthetic_tasks(lattice, {kCheckedFinest, 15, 9}, {kCheckedFinest, 16, 10}, hills());
    proto::WorkPlan work;
    work.set_format(pipeline::kPlanFormat);
    *work.mutable_plan() = synthetic_plan(kCheckedFinest);
    proto::WorkStage& stage = *work.add_stages();
    for (const FinishedTask& task : tasks) {
      proto::WorkTask& one = *stage.add_tasks();
      one.set_level(static_cast<std::uint32_t>(task.node.z));
      one.set_x(static_cast<std::uint32_t>(task.node.x));
      one.set_y(static_cast<std::uint32_t>(task.node.y));
    }
    ASSERT_TRUE(begin_store(path_, synthetic_plan(kCheckedFinest),
                            {{kTasksNote, work.SerializeAsString()}, {"version", "of somebody else"}})
                    .ok());
    auto store = StoreWriter::open(path_, synthetic_plan(kCheckedFinest));
    ASSERT_TRUE(store.ok());
    for (FinishedTask task : tasks) {
      task.consumed.clear();
      ASSERT_TRUE((*store)->commit(task).ok());
    }
    ASSERT_TRUE((*store)->publish(synthetic_manifest()).ok());
    sound_ = bytes_of(path_);
  }
  std::string after(const std::string& damage) {
    put_bytes(path_, sound_);
    Database(path_, Database::Mode::create).execute(damage);
    return findings_of(path_);
  }

  const TemporaryFolder folder_;
  const std::string path_ = folder_ / "a.sqlite";
  std::string sound_;
};

TEST_F(KeptStore, HasTheMeshesOfItsTasksAndNoOthers) {
  const std::string before = findings_of(path_);
  EXPECT_EQ(before.find("meshes"), std::string::npos) << before;
  EXPECT_EQ(before.find("note"), std::string::npos) << before;
  const auto finds = [&](const std::string& damage, const std::string& finding) {
    const std::string found = after(damage);
    EXPECT_NE(found.find(finding), std::string::npos) << damage << "\n" << found;
  };
  finds("DROP TABLE meshes", "table meshes: it is missing; expected: what the tasks of the note 'tasks' left for those above");
  finds("UPDATE meshes SET bytes = zeroblob(16) WHERE id = 1",
        "table meshes: it has 1 row with the name of a build's file; expected: meshes, whole");
  finds("INSERT INTO meshes(level, y, x, bytes) VALUES(4, 0, 0, zeroblob(99))",
        "table meshes: it has 1 row of tasks that the note 'tasks' does not have");
  finds("DELETE FROM meta WHERE key = 'tasks'",
        "rows of a build that is over; expected: no such table in a store that is not built on");
  finds("UPDATE meta SET value = x'ff', sum = row_sum(key, x'ff') WHERE key = 'tasks'",
        "note tasks: it cannot be read; expected: the plan of the build, with its tasks");
  const auto with_format = [](unsigned format) {
    const std::string record = "x'080" + std::to_string(format) + "'";
    return "UPDATE meta SET value = " + record + ", sum = row_sum(key, " + record + ") WHERE key = 'tasks'";
  };
  finds(with_format(kPlanFormat + 1),
        "note tasks: its format is " + std::to_string(kPlanFormat + 1) + "; expected: up to " + std::to_string(kPlanFormat));
  finds(with_format(kPlanFormat), "note tasks: it is of another plan; expected: the plan in meta");
}

TEST_F(KeptStore, SaysOfWhichRastersItWasMadeWhereTheListOfChangesIs) {
  EXPECT_EQ(findings_of(path_).find("note version"), std::string::npos) << "whose note it is cannot be told";
  put_bytes(folder_ / kChangesFile, "{}");
  const auto with = [&](const std::string& value) {
    Database database(path_, Database::Mode::create);
    Statement(database, kPutMeta).bind(std::string(kVersionNote), value).run();
    return findings_of(path_);
  };
  proto::DatasetVersion version;
  version.set_number(1);
  EXPECT_NE(with(version.SerializeAsString()).find("note version: it cannot be read"), std::string::npos) << "of no raster";
  version.add_sources()->set_id("one");
  const std::string sound = with(version.SerializeAsString());
  EXPECT_EQ(sound.find("note version"), std::string::npos) << sound;
  EXPECT_NE(with("\xff").find("note version: it cannot be read; expected: the rasters that the store was made of"),
            std::string::npos);
  sound_ = bytes_of(path_);
  const std::string found = after("DELETE FROM meta WHERE key = 'version'");
  EXPECT_NE(found.find("note version: it is missing, and beside the store lies changes.json"), std::string::npos) << found;
}

}  // namespace
}  // namespace cordillera::pipeline
