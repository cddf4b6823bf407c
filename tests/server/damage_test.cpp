// What a damaged disk makes of answers.
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <filesystem>
#include <fstream>
#include <functional>

#include "pipeline/exports/pmtiles.h"
#include "pipeline/faces/face.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store_schema.h"
#include "server/api/change_request.h"
#include "server/datasets/ledger.h"
#include "tests/server/fixture.h"

namespace cordillera::server {
namespace {

class DamagedDataset : public testing::Test {
 protected:
  void SetUp() override {
    id_ = body_of(service_.post("GOOD", {{"name", "one"}}, {{"prefer", "wait=60"}}))["id"];
    ASSERT_EQ(get("tiles/0/0/0.drc").status, 200);
  }
  Response get_archive() {
    Request request;
    request.path = "/v1/datasets/" + id_ + ".pmtiles";
    request.query = {{"format", "drc"}};
    request.headers = kWait;
    return TestService::settled(service_.api().handle(request));
  }
  Response get(const std::string& path) { return service_.get("/v1/datasets/" + id_ + "/" + path); }
  /// What the reader has open does not change under it in life; here the service is started anew.
  void change(const std::string& sql) {
    service_.stop();
    pipeline::Database((service_.data() / "datasets" / id_ / kStoreFile).string(), pipeline::Database::Mode::create).execute(sql);
    service_.start();
  }
  TestService service_;
  std::string id_;
};

TEST_F(DamagedDataset, IsToldToWhoAsksAndToTheOperator) {
  EXPECT_FALSE(body_of(service_.get("/readyz")).contains("damaged_datasets"));
  change("UPDATE tiles SET drc = (SELECT drc FROM tiles WHERE level = 1) WHERE level = 0");
  const Response answer = get("tiles/0/0/0.drc");
  EXPECT_EQ(answer.status, 500);
  EXPECT_EQ(slug_of(answer), "store-damaged");
  EXPECT_EQ(answer.body.find(service_.data().string()), std::string::npos) << "where it lies is nobody's business";
  EXPECT_EQ(get("tiles/1/1/1.drc").status, 200) << "the rest is served";
  const Response ready = service_.get("/readyz");
  EXPECT_EQ(ready.status, 200) << "a dataset that is damaged keeps nobody from posting another";
  EXPECT_EQ(body_of(ready).value("damaged_datasets", 0), 1);
  const std::string metrics = service_.get("/metrics").body;
  EXPECT_NE(metrics.find("cordillera_store_damaged_total 1\n"), std::string::npos);
  EXPECT_NE(metrics.find("cordillera_datasets_damaged 1\n"), std::string::npos);
  EXPECT_NE(metrics.find("cordillera_problems_total{type=\"store-damaged\"} 1\n"), std::string::npos);
  service_.send("DELETE", "/v1/datasets/" + id_);
  EXPECT_FALSE(body_of(service_.get("/readyz")).contains("damaged_datasets"));
}

TEST_F(DamagedDataset, IsToldToWhoAsksForAnArchive) {
  change("UPDATE blobs SET bytes = CAST('else' AS BLOB)");
  const Response answer = get_archive();
  EXPECT_EQ(answer.status, 500);
  EXPECT_EQ(slug_of(answer), "store-damaged");
  EXPECT_EQ(answer.body.find(service_.data().string()), std::string::npos) << answer.body;
  EXPECT_NE(service_.get("/metrics").body.find("cordillera_store_damaged_total 1\n"), std::string::npos);
  EXPECT_EQ(body_of(service_.get("/readyz")).value("damaged_datasets", 0), 1);
  // From the command line, too, where nobody lacks room.
  auto store = pipeline::StoreReader::open((service_.data() / "datasets" / id_ / kStoreFile).string());
  ASSERT_TRUE(store);
  const pipeline::faces::Terrain terrain(std::move(*store));
  for (const pipeline::faces::Face* face : pipeline::faces::all_faces()) {
    if (face->name != "drc") continue;
    const auto written = pipeline::exports::write_pmtiles(terrain, *face, (service_.folder() / "a.pmtiles").string(), {});
    ASSERT_FALSE(written);
    EXPECT_EQ(written.problem().type, "store-damaged");
    EXPECT_EQ(written.problem().accepted.find("free space"), std::string::npos) << written.problem().accepted;
  }
}

TEST_F(DamagedDataset, IsToldWhereItsManifestIsAnothersToo) {
  change("UPDATE meta SET value = CAST(value || 'x' AS BLOB) WHERE key = 'manifest'");
  EXPECT_EQ(slug_of(get("manifest.json")), "store-damaged");
  EXPECT_EQ(slug_of(get("tiles/0/0/0.drc")), "store-damaged");
}

/// Want of descriptors passes, and is no fault of what is on the disk.
TEST_F(DamagedDataset, IsNoneThatWantsADescriptor) {
  service_.stop();
  service_.start();
  EXPECT_EQ(service_.get("/readyz").status, 200);
  rlimit before{};
  getrlimit(RLIMIT_NOFILE, &before);
  const rlimit none{0, before.rlim_max};
  setrlimit(RLIMIT_NOFILE, &none);
  const Response answer = get("tiles/0/0/0.drc");
  setrlimit(RLIMIT_NOFILE, &before);
  EXPECT_EQ(answer.status, 503) << answer.body;
  EXPECT_EQ(slug_of(answer), "service-busy");
  EXPECT_FALSE(body_of(service_.get("/readyz")).contains("damaged_datasets"));
  EXPECT_EQ(get("tiles/0/0/0.drc").status, 200);
}

namespace fs = std::filesystem;

/// A dataset whose rasters can be changed. Only its note and its list say which rasters are its own: whatever becomes of these,
/// no raster goes.
class DamagedNote : public testing::Test {
 protected:
  void SetUp() override {
    id_ = body_of(service_.post("GOOD", {{"name", "one"}}, {{"prefer", "wait=60"}}))["id"];
    service_.stop();
    fs::create_directory(folder() / updates::kSources);
    for (const char* name : {"one.tif", "two.tif"}) std::ofstream(raster(name)) << "GOOD";
    fs::create_directory(folder() / updates::kVersions);
    fs::copy_file(store(), kept());
    put_version(store(), 2, "one.tif");
    put_version(kept(), 1, "two.tif");
    proto::SourceChanges changes;
    changes.set_last_number(2);
    changes.add_ended()->set_id("second");
    put_changes(changes);
  }
  fs::path folder() const { return Layout{service_.data()}.dataset(id_); }
  fs::path store() const { return folder() / kStoreFile; }
  fs::path kept() const { return updates::kept_store(folder(), 1); }
  fs::path raster(const std::string& name) const { return folder() / updates::kSources / name; }
  bool both_there() const { return fs::exists(raster("one.tif")) && fs::exists(raster("two.tif")); }
  std::string path() const { return "/v1/datasets/" + id_; }

  static void put_version(const fs::path& store, std::uint32_t number, const std::string& name) {
    proto::DatasetVersion version;
    version.set_number(number);
    version.set_change(number == 2 ? "second" : "first");
    proto::DatasetSource& source = *version.add_sources();
    source.set_id("one");
    source.mutable_spec()->set_path(std::string(updates::kSources) + "/" + name);
    const std::string bytes = version.SerializeAsString();
    pipeline::Database database(store.string(), pipeline::Database::Mode::create);
    pipeline::Statement(database, pipeline::kPutMeta).bind(std::string(updates::kVersionNote), bytes).run();
  }
  void put_changes(const proto::SourceChanges& changes) const {
    std::ofstream(folder() / updates::kChangesFile) << to_json_line(changes);
  }
  static std::function<void(const fs::path&)> sql(const std::string& text) {
    return [text](const fs::path& store) { pipeline::Database(store.string(), pipeline::Database::Mode::create).execute(text); };
  }
  static constexpr const char* kFlip = "UPDATE meta SET value = CAST(x'09' || substr(value, 2) AS BLOB) WHERE key = 'version'";

  TestService service_;
  std::string id_;
};

TEST_F(DamagedNote, RemovesNoRasterAndIsTold) {
  service_.start();
  EXPECT_EQ(body_of(service_.get(path() + "/sources"))["sources"].size(), 1U);
  EXPECT_TRUE(both_there());
  service_.stop();
  const fs::path list = folder() / updates::kChangesFile;
  const std::string whole = file_text(store()), told = file_text(list);
  const std::pair<const char*, std::function<void(const fs::path&)>> kDamages[] = {
      {"a bit of its value", sql(kFlip)},
      {"a bit of its key", sql("UPDATE meta SET key = 'wersion' WHERE key = 'version'")},
      {"its row", sql("DELETE FROM meta WHERE key = 'version'")},
      {"a value that no program wrote", sql("UPDATE meta SET value = x'ff', sum = row_sum(key, x'ff') WHERE key = 'version'")},
      {"the file's head", [](const fs::path& store) { std::ofstream(store, std::ios::in | std::ios::out) << "no store at all"; }},
      {"the file", [](const fs::path& store) { fs::remove(store); }},
      {"the list's words", [&](const fs::path&) { std::ofstream(list) << told.substr(0, told.size() / 2); }},
      {"all of the list", [&](const fs::path&) { std::ofstream(list).close(); }},
      {"the list", [&](const fs::path&) { fs::remove(list); }},
  };
  for (const auto& [what, damage] : kDamages) {
    damage(store());
    service_.start();
    EXPECT_TRUE(both_there()) << what;
    const Response asked = service_.get(path() + "/sources");
    EXPECT_EQ(asked.status, 500) << what << asked.body;
    EXPECT_EQ(slug_of(asked), "store-damaged") << what;
    EXPECT_EQ(asked.body.find(service_.data().string()), std::string::npos) << what;
    EXPECT_EQ(body_of(service_.get("/readyz")).value("damaged_datasets", 0), 1) << what;
    for (const char* below : {"/sources", "/rollback"})
      EXPECT_EQ(slug_of(service_.send("POST", path() + below)), "store-damaged") << what << below;
    EXPECT_EQ(slug_of(service_.send("DELETE", path() + "/sources/one")), "store-damaged") << what;
    EXPECT_EQ(service_.get(path()).status, 200) << what;
    EXPECT_TRUE(both_there()) << what;
    service_.stop();
    std::ofstream(store(), std::ios::binary) << whole;
    std::ofstream(list, std::ios::binary) << told;
  }
  service_.start();
  EXPECT_EQ(body_of(service_.get(path() + "/sources"))["sources"].size(), 1U) << "with the file put back all is as it was";
  EXPECT_TRUE(both_there());
}

TEST_F(DamagedNote, OfAKeptVersionKeepsItsRasters) {
  sql(kFlip)(kept());
  service_.start();
  EXPECT_TRUE(both_there());
  EXPECT_EQ(body_of(service_.get(path() + "/versions"))["versions"].size(), 1U) << "the one that is served";
  EXPECT_EQ(body_of(service_.get("/readyz")).value("damaged_datasets", 0), 1);
  EXPECT_EQ(slug_of(service_.send("POST", path() + "/rollback")), "store-damaged");
  EXPECT_TRUE(fs::exists(kept()));
}

/// It would be built of its own raster alone, and would take the place of the others.
TEST_F(DamagedNote, EndsAChangeThatIsPending) {
  proto::SourceChanges changes;
  changes.set_last_number(3);
  changes.add_ended()->set_id("second");
  proto::SourceChange& change = *changes.add_pending();
  change.set_id("third");
  change.set_kind("add");
  change.set_number(3);
  change.mutable_source()->set_id("two");
  change.mutable_source()->mutable_spec()->set_path("sources/two.tif");
  put_changes(changes);
  sql(kFlip)(store());
  const std::string before = file_text(store());
  service_.start();
  ASSERT_TRUE(eventually([&] { return service_.service().ledger().read(id_).ended_size() == 2; }));
  EXPECT_NE(service_.service().ledger().read(id_).ended(1).problem().type().find("store-damaged"), std::string::npos);
  EXPECT_EQ(file_text(store()), before);
  EXPECT_TRUE(both_there());
}

class NoteOfAVersion : public DamagedNote {};

TEST_F(NoteOfAVersion, AndAChangeBehindItThatHasNotBegunIsQueued) {
  service_.start();
  proto::SourceChange change;
  change.set_id("third");
  change.set_kind("add");
  change.mutable_source()->set_id("two");
  ASSERT_TRUE(service_.service().ledger().add(id_, change, 10, [] { return proto::Result<void>(); }));
  const Json status = body_of(service_.get(path()));
  EXPECT_EQ(status["state"], "ready");
  EXPECT_EQ(status["progress"]["stage"], "queued") << "nobody has begun with it";
}

/// It is written down first: what a kill kept from being done is done when the client asks again, and never twice.
TEST_F(NoteOfAVersion, AndARollbackThatAKillInterruptedIsDoneOnce) {
  Request back;
  back.method = "POST";
  back.path = path() + "/rollback";
  back.headers = {{"idempotency-key", "back"}};
  proto::SourceChanges changes;
  changes.set_last_number(2);
  changes.add_ended()->set_id("second");
  proto::Rollback& noted = *changes.add_rollbacks();
  noted.set_idempotency_key("back");
  noted.set_request_hash(updates::hash_of(back));
  noted.set_from(2);
  noted.set_to(1);
  put_changes(changes);
  service_.start();
  for (int sent = 0; sent < 2; ++sent) {
    const Response answer = service_.api().handle(back);
    EXPECT_EQ(answer.status, 200) << answer.body;
    EXPECT_EQ(service_.service().ledger().current(id_).number(), 1U);
    EXPECT_FALSE(fs::exists(kept()));
  }
}

/// A version may come into its place although that failed, as when only the sync of its folder does.
TEST_F(NoteOfAVersion, AndAnAdditionThatIsServedIsNotTakenBack) {
  const auto taken = [&](const char* added) {
    proto::SourceChanges changes;
    for (const char* kind : {"add", "remove"}) {
      proto::SourceChange& change = *changes.add_pending();
      change.set_id(kind == std::string("add") ? added : "removal");
      change.set_kind(kind);
      change.mutable_source()->set_id("one");
      change.mutable_source()->mutable_spec()->set_path("sources/one.tif");
    }
    put_changes(changes);
    updates::Ledger ledger(Layout{service_.data()});
    ledger.note_waiting(id_, added, {"store-write", "it cannot be put into its place", "", ""});
    const auto back = ledger.take_back(id_);
    return back.ok() && *back;
  };
  EXPECT_FALSE(taken("second")) << "the version that is served was made by it";
  EXPECT_TRUE(taken("third"));
}

/// With a flipped bit the list would say something else: another raster, another number, no change at all.
TEST(DamagedList, IsToldOfEveryBit) {
  TempFolder place;
  const Layout layout{place.path()};
  const fs::path folder = layout.dataset("one"), list = folder / updates::kChangesFile;
  fs::create_directories(folder);
  proto::SourceChange change;
  change.set_id("first");
  change.set_kind("add");
  change.mutable_source()->set_id("one");
  change.mutable_source()->set_bytes(1234.5);
  change.mutable_source()->mutable_spec()->set_path("sources/one.tif");
  ASSERT_TRUE(updates::begin(folder, change));
  const updates::Ledger ledger(layout);
  const std::string whole = file_text(list);
  const auto read = [&](const std::string& text) {
    std::ofstream(list, std::ios::binary) << text;
    return ledger.read("one");
  };
  ASSERT_EQ(read(whole).pending(0).source().id(), "one");
  for (std::size_t k = 0; k < 8 * whole.size(); ++k) {
    std::string flipped = whole;
    flipped[k / 8] = static_cast<char>(flipped[k / 8] ^ 1 << k % 8);
    EXPECT_THROW((void)read(flipped), pipeline::StoreError) << "bit " << k << ": " << flipped;
  }
  EXPECT_THROW((void)read(whole + whole), pipeline::StoreError);
  EXPECT_THROW((void)read(whole.substr(0, whole.size() - 1)), pipeline::StoreError);
  proto::SourceChanges of_before;
  *of_before.add_pending() = change;
  const std::string without = to_json_line(of_before) + "\n";
  EXPECT_EQ(read(without).pending(0).id(), "first") << "as it was written before there were sums";
}

}  // namespace
}  // namespace cordillera::server
