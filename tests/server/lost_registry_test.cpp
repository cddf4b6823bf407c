// Registries that lost rows: an empty file, one without its log, an older one. No dataset is lost with them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fixture.h"
#include "pipeline/store/sqlite.h"
#include "server/access/tokens.h"
#include "server/datasets/adoption.h"
#include "server/datasets/data_folder.h"
#include "server/datasets/dataset_folder.h"
#include "server/datasets/ledger.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

const access::NewToken kOwner = access::make_token("owner", access::Role::write);

class LostRegistry : public testing::Test {
 protected:
  static Settings with_tokens() {
    Settings settings;
    settings.serve.token_lines = kOwner.line;
    return settings;
  }
  std::map<std::string, std::string> headers(const std::map<std::string, std::string>& more = {}) {
    std::map<std::string, std::string> all = {{"authorization", "Bearer " + kOwner.token}, {"prefer", "wait=60"}};
    all.insert(more.begin(), more.end());
    return all;
  }
  std::string post(const Given& query = {}, const std::map<std::string, std::string>& more = {}) {
    const Response posted = test_.post("GOOD", query, headers(more));
    EXPECT_EQ(posted.status, 201) << posted.body;
    return body_of(posted)["id"];
  }
  Layout layout() { return Layout{test_.data()}; }
  fs::path registry() { return layout().registry(); }
  /// As it is without its log, whoever uses it.
  void keep_file_alone(const fs::path& to) { fs::copy_file(registry(), to, fs::copy_options::overwrite_existing); }
  void put_back(const fs::path& from) {
    for (const char* suffix : {"-wal", "-shm"}) fs::remove(registry().string() + suffix);
    fs::copy_file(from, registry(), fs::copy_options::overwrite_existing);
  }
  Json listed() { return body_of(test_.get("/v1/datasets", headers()))["datasets"]; }
  bool serves(const std::string& id) { return test_.get("/v1/datasets/" + id + "/tiles/1/1/1.drc", headers()).status == 200; }
  proto::Problem refused() {
    auto opened = Service::open(test_.settings(), play_job);
    EXPECT_FALSE(opened) << "a server starts on it";
    return opened ? proto::Problem{} : opened.problem();
  }
  fs::path aside() { return test_.folder() / "aside.sqlite"; }

  TestService test_{with_tokens()};
};

TEST_F(LostRegistry, AnEmptyOneIsRefusedAndCanBeMadeAnew) {
  const std::string one = post({{"name", "one.tif"}}), two = post({{"name", "two.tif"}, {"private", "1"}});
  test_.stop();
  for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(registry().string() + suffix);
  std::ofstream(registry()).close();
  const proto::Problem problem = refused();
  EXPECT_EQ(problem.type, "data-unusable");
  EXPECT_THAT(problem.detail, HasSubstr("registry.sqlite is empty, and beside it are 2 folders"));
  EXPECT_THAT(problem.accepted, HasSubstr("cordillera adopt"));
  EXPECT_EQ(vacuum(layout(), Orphans::remove).problem().type, "data-unusable");
  const auto copied = backup(layout(), test_.folder() / "backup");
  ASSERT_FALSE(copied) << "a backup of nothing";
  EXPECT_THAT(copied.problem().detail, HasSubstr("registry.sqlite is empty, and beside it are 2 folders"));
  EXPECT_FALSE(fs::exists(test_.folder() / "backup"));
  for (const std::string& id : {one, two}) EXPECT_TRUE(fs::exists(layout().store(id)));

  const auto made = make_registry(layout());
  ASSERT_TRUE(made) << made.problem().line();
  EXPECT_EQ(made->adopted, 2u);
  EXPECT_EQ(fs::file_size(registry().string() + ".lost"), 0u);
  EXPECT_FALSE(make_registry(layout())) << "a registry that is there is replaced";
  test_.start();
  EXPECT_EQ(listed().size(), 2u);
  EXPECT_TRUE(serves(one) && serves(two));
  EXPECT_EQ(test_.get("/v1/datasets/" + two).status, 404) << "a private dataset came back as a public one";
}

TEST_F(LostRegistry, AnotherProgramsOrNoneIsRefused) {
  const std::string one = post();
  test_.stop();
  for (const char* suffix : {"", "-wal", "-shm"}) fs::remove(registry().string() + suffix);
  EXPECT_THAT(refused().detail, HasSubstr("is missing"));
  pipeline::Database(registry().string(), pipeline::Database::Mode::create).execute("CREATE TABLE songs (title TEXT)");
  EXPECT_THAT(refused().detail, HasSubstr("no table of datasets"));
  fs::remove(registry());
  pipeline::Database(registry().string(), pipeline::Database::Mode::create).execute("CREATE TABLE datasets (title TEXT)");
  EXPECT_THAT(refused().detail, HasSubstr("no table of datasets as a server makes it"));
  std::ofstream(registry()) << std::string(5000, 'x');
  EXPECT_THAT(refused().detail, HasSubstr("not a database"));
  EXPECT_TRUE(fs::exists(layout().store(one)));
  // Without folders beside it there is nothing to lose, but nothing of ours to write into either.
  fs::remove_all(layout().datasets());
  fs::remove(registry());
  pipeline::Database(registry().string(), pipeline::Database::Mode::create).execute("CREATE TABLE songs (title TEXT)");
  EXPECT_THAT(refused().detail, HasSubstr("another program's"));
}

TEST_F(LostRegistry, OneThatIsDamagedBehindItsFirstPageIsRefusedAndCanBeMadeAnew) {
  const std::string one = post();
  test_.stop();
  for (const char* suffix : {"-wal", "-shm"}) fs::remove(registry().string() + suffix);
  const std::string sound = file_text(registry());
  constexpr std::size_t kPage = 4096;
  ASSERT_GT(sound.size(), kPage);
  std::string flipped = sound;
  for (std::size_t at = kPage; at < flipped.size(); at += 50) flipped[at] = static_cast<char>(flipped[at] ^ 0x55);
  for (const std::string& damaged : {flipped, sound.substr(0, kPage)}) {
    std::ofstream(registry(), std::ios::binary) << damaged;
    const proto::Problem problem = refused();
    EXPECT_EQ(problem.type, "data-unusable");
    EXPECT_THAT(problem.detail, HasSubstr("is not the registry of a server"));
    EXPECT_THAT(problem.accepted, HasSubstr("cordillera adopt"));
  }
  const auto made = make_registry(layout());
  ASSERT_TRUE(made) << made.problem().line();
  EXPECT_EQ(made->adopted, 1u);
  test_.start();
  EXPECT_TRUE(serves(one));
}

TEST_F(LostRegistry, WithoutItsLogItHasAllThatWasAccepted) {
  std::vector<std::string> ids;
  for (int k = 0; k < 3; ++k) ids.push_back(post());
  keep_file_alone(aside());  // while the server runs: what a kill and a lost log leave
  test_.stop();
  EXPECT_EQ(Registry::read_only(aside().string())->list().size(), 3u) << "rows are in the log alone";
  put_back(aside());
  test_.start();
  EXPECT_EQ(listed().size(), 3u);
  for (const std::string& id : ids) EXPECT_TRUE(serves(id)) << id;
  EXPECT_FALSE(fs::exists(layout().orphans()));
}

TEST_F(LostRegistry, WithoutItsLogWhatBecamePrivateStaysSo) {
  const std::string id = post();
  test_.stop();  // what is written now is in the file itself
  test_.start();
  keep_file_alone(aside());
  Request request;
  request.method = "PATCH";
  request.path = "/v1/datasets/" + id;
  request.query = {{"private", "1"}};
  request.headers = headers();
  ASSERT_EQ(test_.api().handle(request).status, 200);
  test_.stop();
  EXPECT_FALSE(Registry::read_only(aside().string())->list().front()->is_private) << "the change is in the log alone";
  put_back(aside());
  test_.start();
  EXPECT_EQ(test_.get("/v1/datasets/" + id).status, 404) << "who has no token may read it";
  EXPECT_TRUE(serves(id));
}

TEST_F(LostRegistry, WhatAnOlderOneDoesNotKnowIsAdopted) {
  const std::string first = post();
  test_.stop();
  keep_file_alone(aside());
  test_.start();
  const std::string second = post({{"name", "Höhe ü.tif"}, {"title", "A title"}, {"error", "3"}}, {{"idempotency-key", "k"}});
  const std::string third = post({{"private", "1"}});
  const std::string before = test_.get("/v1/datasets", headers()).body;
  const Row row = test_.service().registry().find(second);
  test_.stop();
  put_back(aside());
  test_.start();
  EXPECT_EQ(test_.get("/v1/datasets", headers()).body, before) << "names, order, privacy or state are others";
  const Row adopted = test_.service().registry().find(second);
  ASSERT_TRUE(adopted);
  EXPECT_EQ(to_json_line(adopted->options), to_json_line(row->options));
  EXPECT_EQ(adopted->owner, "owner");
  EXPECT_EQ(adopted->request_id, row->request_id);
  EXPECT_EQ(test_.get("/v1/datasets/" + third).status, 404) << "a private dataset came back as a public one";
  EXPECT_EQ(post({{"name", "Höhe ü.tif"}, {"title", "A title"}, {"error", "3"}}, {{"idempotency-key", "k"}}), second);
  EXPECT_TRUE(serves(first) && serves(second) && serves(third));
}

TEST_F(LostRegistry, OfAnEarlierVersionAFolderComesBackAsAPrivateDataset) {
  keep_file_alone(aside());
  const std::string id = post();
  test_.stop();
  put_back(aside());
  fs::remove(layout().dataset(id) / kRecordFile);  // earlier versions wrote none
  test_.start();
  EXPECT_TRUE(serves(id));
  EXPECT_EQ(test_.get("/v1/datasets/" + id).status, 404) << "nothing says that it was public";
}

TEST_F(LostRegistry, WhatWaitedToBeBuiltIsBuilt) {
  keep_file_alone(aside());
  const std::string id = body_of(test_.post("SLOW", {}, {{"authorization", "Bearer " + kOwner.token}}))["id"];
  test_.stop();
  const Dataset posted = *read_record(layout().dataset(id));
  std::ofstream(layout().dataset(id) / posted.raster) << "GOOD";
  put_back(aside());
  test_.start();
  EXPECT_TRUE(eventually([&] { return serves(id); }));
}

TEST_F(LostRegistry, AStateThatWasLostIsFoundAgain) {
  const std::string id = post();
  test_.stop();
  {
    auto opened = Registry::open(registry().string());
    ASSERT_TRUE(opened);
    (*opened)->set_state(id, State::running, std::nullopt);  // what an older registry says
  }
  test_.start();
  EXPECT_TRUE(serves(id));
  EXPECT_EQ(test_.service().registry().find(id)->state, State::ready);
}

TEST_F(LostRegistry, WhatIsNoDatasetIsSetAside) {
  post();
  test_.stop();
  fs::create_directories(layout().dataset("nobody"));
  std::ofstream(layout().dataset("nobody") / "letter.txt") << "dear all";
  fs::create_directories(layout().dataset("nothing"));
  test_.start();
  EXPECT_EQ(listed().size(), 1u);
  EXPECT_EQ(file_text(layout().orphans() / "nobody" / "letter.txt"), "dear all");
  EXPECT_FALSE(fs::exists(layout().dataset("nothing")));
  test_.stop();
  const auto kept = vacuum(layout(), Orphans::keep);
  ASSERT_TRUE(kept) << kept.problem().line();
  EXPECT_EQ(kept->orphans, 1u);
  const auto emptied = vacuum(layout(), Orphans::remove);
  ASSERT_TRUE(emptied) << emptied.problem().line();
  EXPECT_EQ(emptied->orphans, 0u);
  EXPECT_FALSE(fs::exists(layout().orphans() / "nobody"));
  test_.start();
  EXPECT_EQ(listed().size(), 1u);
}

/// What a row names is joined to the folder of datasets, and a restored backup may be anybody's.
TEST_F(LostRegistry, ARowThatNamesAPlaceOutsideItsFolderIsLeftOutAndNothingThereIsTouched) {
  const std::string kept = post(), within = post({{"name", "within.tif"}});
  test_.stop();
  const fs::path victim = test_.folder() / "VICTIM";
  fs::create_directories(victim);
  std::ofstream(victim / "letter.txt") << "dear all";
  std::ofstream(layout().dataset(within) / "letter.txt") << "dear all";
  {
    pipeline::Database database(registry().string(), pipeline::Database::Mode::create);
    database.execute("UPDATE datasets SET raster = '../../../VICTIM/letter.txt', state = 'running' WHERE id = '" + within + "'");
    int number = 100;
    for (const std::string state : {"queued", "running", "ready", "failed"}) {
      for (const std::string& id : {std::string("../../VICTIM"), victim.string(), std::string(".."), std::string("Upper")}) {
        database.execute(
            "INSERT INTO datasets (number, id, name, state, options, created, raster, options_hash, body_hash) "
            "VALUES (" +
            std::to_string(++number) + ", '" + id + "', 'x', '" + state +
            "', '{}', '2026-01-01T00:00:00Z', 'letter.txt', '', '')");
      }
      test_.start();
      EXPECT_EQ(listed().size(), 1u) << state;
      EXPECT_TRUE(serves(kept));
      EXPECT_EQ(test_.get("/v1/datasets/" + within, headers()).status, 404);
      test_.stop();
      ASSERT_TRUE(vacuum(layout(), Orphans::remove));
      const auto files = [](const fs::path& folder) {
        return std::distance(fs::directory_iterator(folder), fs::directory_iterator());
      };
      EXPECT_EQ(file_text(victim / "letter.txt"), "dear all") << state;
      EXPECT_EQ(files(victim), 1) << state;
      EXPECT_EQ(file_text(layout().dataset(within) / "letter.txt"), "dear all") << "a row that is left out keeps its folder";
      EXPECT_EQ(database.integer("SELECT COUNT(*) FROM datasets WHERE number > 100"), 4) << "the rows stay in the file";
      database.execute("DELETE FROM datasets WHERE number > 100");
    }
  }
}

TEST_F(LostRegistry, NorIsARecordAdoptedThatDoes) {
  const std::string id = post(), other = post();
  test_.stop();
  const fs::path outside = test_.folder() / "letter.txt", folder = layout().dataset(id);
  std::ofstream(outside) << "GOOD";
  Dataset dataset = *read_record(folder);
  dataset.raster = "../../../letter.txt";
  ASSERT_TRUE(write_record(folder, dataset).ok());
  fs::remove(folder / kStoreFile);
  fs::rename(layout().dataset(other), layout().dataset("Not_An_Id"));
  {
    auto opened = Registry::open(registry().string());
    ASSERT_TRUE(opened);
    for (const std::string& gone : {id, other}) (*opened)->remove(gone);
  }
  test_.start();
  EXPECT_TRUE(listed().empty());
  for (const std::string& aside : {id, std::string("Not_An_Id")}) EXPECT_TRUE(fs::exists(layout().orphans() / aside)) << aside;
  EXPECT_EQ(file_text(outside), "GOOD");
}

TEST_F(LostRegistry, NorIsAListOfChangesReadThatDoes) {
  const Layout restored{test_.folder() / "restored"};
  fs::create_directories(restored.dataset("some"));
  for (const auto& [path, good] : std::vector<std::pair<std::string, bool>>{{"sources/abc.tif", true},
                                                                            {"source.tif", true},
                                                                            {"", true},
                                                                            {"../letter.txt", false},
                                                                            {"sources/../../letter.txt", false},
                                                                            {"sources/..", false},
                                                                            {"..", false},
                                                                            {"/etc/passwd", false}}) {
    for (const bool behind : {false, true}) {
      proto::SourceChange change;
      (behind ? change.add_more() : change.mutable_source())->mutable_spec()->set_path(path);
      ASSERT_TRUE(updates::begin(restored.dataset("some"), change).ok());
      if (good)
        EXPECT_EQ(updates::Ledger(restored).read("some").pending_size(), 1) << path;
      else
        EXPECT_THROW(updates::Ledger(restored).read("some"), pipeline::StoreError) << path;
    }
  }
}

/// A kill at any step of a deletion.
TEST_F(LostRegistry, WhatWasDeletedStaysSo) {
  const std::string marked = post(), without_row = post(), kept = post();
  test_.stop();
  ASSERT_TRUE(mark_deleted(layout().dataset(marked)));
  ASSERT_TRUE(mark_deleted(layout().dataset(without_row)));
  {
    auto opened = Registry::open(registry().string());
    ASSERT_TRUE(opened);
    (*opened)->remove(without_row);
  }
  test_.start();
  ASSERT_EQ(listed().size(), 1u);
  EXPECT_EQ(listed()[0]["id"], kept);
  EXPECT_FALSE(fs::exists(layout().dataset(marked)));
  EXPECT_FALSE(fs::exists(layout().dataset(without_row)));
  EXPECT_FALSE(fs::exists(layout().orphans()));
}

}  // namespace
}  // namespace cordillera::server
