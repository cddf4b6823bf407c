// Copies of a data folder: what is in them, where they may go, and what cut-short ones leave.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <fstream>

#include "fixture.h"
#include "pipeline/store/sqlite.h"
#include "server/cli/commands.h"
#include "server/datasets/data_folder.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

class Backup : public testing::Test {
 protected:
  void SetUp() override {
    const Response posted = test_.post("GOOD", {{"name", "one.tif"}}, {{"prefer", "wait=60"}});
    ASSERT_EQ(posted.status, 201) << posted.body;
    std::ofstream(layout().live()) << "{}";
  }
  Layout layout() { return Layout{test_.data()}; }
  fs::path at(const std::string& name) { return test_.folder() / name; }
  void restored(const fs::path& data) {
    const auto done = restore(at("backup"), Layout{data});
    ASSERT_TRUE(done) << done.problem().line();
    EXPECT_EQ(done->ready, 1u);
    EXPECT_EQ(file_text(data / "live.json"), "{}");
    EXPECT_TRUE(fs::exists(data / "registry.sqlite"));
    for (const auto& entry : fs::directory_iterator(data)) EXPECT_THAT(entry.path().string(), testing::Not(HasSubstr("partial")));
  }

  TestService test_;
};

TEST_F(Backup, HoldsWhatTheLiveFolderHasMade) {
  ASSERT_TRUE(backup(layout(), at("backup")));
  restored(at("new"));
}

TEST_F(Backup, AFreshDiskIsRestoredInto) {
  ASSERT_TRUE(backup(layout(), at("backup")));
  fs::create_directories(at("empty"));
  restored(at("empty"));
  fs::create_directories(at("disk/lost+found"));
  restored(at("disk"));
  EXPECT_TRUE(fs::exists(at("disk/lost+found")));
  fs::create_directories(at("full/photos"));
  const auto refused = restore(at("backup"), Layout{at("full")});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.problem().detail, HasSubstr("it exists, with photos"));
}

TEST_F(Backup, WhatAKilledOneLeftIsRemoved) {
  const pid_t gone = fork();
  if (gone == 0) _exit(0);
  waitpid(gone, nullptr, 0);
  const std::string end = ".partial-" + std::to_string(gone);
  fs::create_directories(at("backup" + end + "/datasets"));
  ASSERT_TRUE(backup(layout(), at("backup")));
  EXPECT_FALSE(fs::exists(at("backup" + end)));
  fs::create_directories(at("data2") / end / "datasets");
  restored(at("data2"));
}

TEST_F(Backup, ADamagedOneIsToldToBeAtFault) {
  ASSERT_TRUE(backup(layout(), at("backup")));
  std::ofstream(at("backup") / "live.json") << "other";
  const auto refused = restore(at("backup"), Layout{at("new")});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.problem().detail, HasSubstr("live.json is missing from the backup, or is not what was backed up"));
  EXPECT_THAT(refused.problem().accepted, HasSubstr("a backup"));
  EXPECT_FALSE(fs::exists(at("new")));
}

TEST_F(Backup, AListThatIsNotAsItIsWrittenIsToldToBeAtFault) {
  ASSERT_TRUE(backup(layout(), at("backup")));
  const Json whole = Json::parse(file_text(at("backup/backup.json")));
  for (const Json& change : {Json{{"data_version", "1"}}, Json{{"data_version", 1.5}}, Json{{"files", {{"live.json", 7}}}}}) {
    Json list = whole;
    list.update(change);
    std::ofstream(at("backup/backup.json")) << list;
    const auto refused = restore(at("backup"), Layout{at("new")});
    ASSERT_FALSE(refused) << change;
    EXPECT_EQ(refused.problem().type, "data-unusable") << change;
    EXPECT_THAT(refused.problem().detail, HasSubstr("is not as cordillera backup writes it"));
  }
}

TEST_F(Backup, SaysWhichTilesAreDamaged) {
  const std::string id = test_.service().registry().list().front()->id;
  test_.stop();
  EXPECT_EQ(backup_command(layout().root, at("backup")), kDone);
  pipeline::Database(layout().store(id), pipeline::Database::Mode::create)
      .execute("UPDATE blobs SET bytes = CAST('else' AS BLOB)");
  testing::internal::CaptureStderr();
  EXPECT_EQ(backup_command(layout().root, at("damaged")), kFailed);
  const std::string said = testing::internal::GetCapturedStderr();
  EXPECT_THAT(said, HasSubstr(id));
  EXPECT_THAT(said, HasSubstr("damaged"));
  EXPECT_TRUE(fs::exists(at("damaged/backup.json"))) << "the others are worth a backup";
}

/// Whether another user comes into a folder.
bool may_be_entered(const fs::path& folder) {
  std::error_code error;
  const bool here = (fs::status(folder, error).permissions() & fs::perms::others_exec) != fs::perms::none;
  return here && (!folder.has_relative_path() || may_be_entered(folder.parent_path()));
}

/// A snapshot, a disk that is mounted to be read alone.
TEST_F(Backup, IsMadeOfAFolderThatNobodyMayWrite) {
  if (geteuid() == 0 && !may_be_entered(test_.folder().parent_path()))
    GTEST_SKIP() << "root may write anywhere, and another user does not come into the folder of temporary files";
  test_.stop();
  ASSERT_FALSE(fs::exists(layout().registry().string() + "-wal"));
  constexpr auto kRead = fs::perms::owner_read | fs::perms::group_read | fs::perms::others_read;
  constexpr auto kEnter = fs::perms::owner_exec | fs::perms::group_exec | fs::perms::others_exec;
  fs::create_directory(at("out"));
  fs::permissions(at("out"), fs::perms::all);
  fs::permissions(test_.folder(), kRead | kEnter);
  for (const auto& entry : fs::recursive_directory_iterator(test_.data()))
    fs::permissions(entry.path(), entry.is_directory() ? kRead | kEnter : kRead);
  fs::permissions(test_.data(), kRead | kEnter);
  constexpr uid_t kNobody = 65534;
  const pid_t other = fork();  // root may write anywhere
  if (other == 0) {
    bool done = geteuid() != 0 || setuid(kNobody) == 0;
    try {
      done = done && backup_command(layout().root, at("out/backup")) == kDone;
      done = done && Registry::read_only(layout().registry())->list().size() == 1;  // as check reads it
    } catch (const std::exception&) { done = false; }
    _exit(done ? 0 : 1);
  }
  int status = 0;
  waitpid(other, &status, 0);
  for (const fs::path& folder : {test_.folder(), test_.data()}) fs::permissions(folder, fs::perms::all);
  for (const auto& entry : fs::recursive_directory_iterator(test_.data())) fs::permissions(entry.path(), fs::perms::all);
  EXPECT_EQ(status, 0);
  EXPECT_TRUE(fs::exists(at("out/backup/registry.sqlite")));
}

TEST_F(Backup, ItMayNotLieInWhatItCopies) {
  EXPECT_THAT(backup(layout(), layout().root / "inside").problem().detail, HasSubstr("it lies in"));
  EXPECT_FALSE(fs::exists(layout().root / "inside"));
}

TEST_F(Backup, ADataFolderMayBeAFreshDiskAndNobodyElses) {
  test_.stop();
  Settings settings = test_.settings();
  settings.serve.data = at("disk");
  fs::create_directories(at("disk/lost+found"));
  EXPECT_TRUE(Service::open(settings, play_job));
  settings.serve.data = at("theirs");
  fs::create_directories(at("theirs/photos"));
  const auto refused = Service::open(settings, play_job);
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.problem().detail, HasSubstr("it holds other things: photos"));
}

/// Of a data folder whose stores have free pages.
TEST(Vacuum, RewritesTheOthersWhereOneIsDamaged) {
  TestService test;
  std::vector<fs::path> stores;
  for (int k = 0; k < 3; ++k) {
    const std::string id = body_of(test.post("GOOD", {}, {{"prefer", "wait=60"}}))["id"];
    stores.push_back(Layout{test.data()}.store(id));
  }
  test.stop();
  for (const fs::path& store : stores)
    pipeline::Database(store.string(), pipeline::Database::Mode::create)
        .execute("CREATE TABLE waste (bytes BLOB); INSERT INTO waste VALUES (randomblob(100000)); DROP TABLE waste");
  const auto entries = fs::directory_iterator(Layout{test.data()}.datasets());
  const fs::path bad = entries->path() / kStoreFile;  // the first that is come to
  std::fstream(bad, std::ios::in | std::ios::out | std::ios::binary).write("no store any more", 17);
  testing::internal::CaptureStdout();
  testing::internal::CaptureStderr();
  EXPECT_EQ(vacuum_command(test.data().string(), Orphans::keep), 1);
  const std::string said = testing::internal::GetCapturedStdout(), told = testing::internal::GetCapturedStderr();
  EXPECT_THAT(said, HasSubstr(" 2 stores rewritten"));
  EXPECT_THAT(told, HasSubstr(bad.string()));
  for (const fs::path& store : stores) {
    if (store == bad) continue;
    EXPECT_THAT(told, testing::Not(HasSubstr(store.string())));
    EXPECT_EQ(pipeline::Database(store.string(), pipeline::Database::Mode::published).integer("PRAGMA freelist_count"), 0);
  }
}

}  // namespace
}  // namespace cordillera::server
