// Pages of the list, and that nobody waits for the registry.
#include "server/api/dataset_list.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iomanip>
#include <numbers>
#include <set>

#include "fixture.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/tileset/manifest_json.h"
#include "server/access/tokens.h"
#include "server/api/documents/web.h"

namespace cordillera::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

/// A row that no job touches.
void add(TestService& test, const std::string& id, State state = State::failed, bool is_private = false,
         const std::string& title = "") {
  Dataset dataset;
  dataset.options.set_title(title);
  dataset.id = dataset.name = id;
  dataset.state = state;
  dataset.created = "2026-01-01T00:00:00Z";
  dataset.is_private = is_private;
  ASSERT_TRUE(test.service().registry().add(dataset));
}

using Box = std::array<double, 4>;  // west, south, east, north in degrees

/// With a store whose tiles have these boxes, in which the manifest's bounds are found, and this title.
void add_ready(TestService& test, const std::string& id, const std::vector<Box>& boxes, const std::string& title) {
  const Layout layout{test.data()};
  std::filesystem::create_directories(layout.dataset(id));
  proto::Plan plan;
  plan.add_levels()->set_level(0);
  auto writer = pipeline::StoreWriter::open(layout.store(id).string(), plan);
  ASSERT_TRUE(writer) << writer.problem().line();
  pipeline::FinishedTask task;
  for (const Box& box : boxes) {
    task.tiles.push_back(test_tile(0, static_cast<std::uint32_t>(task.tiles.size()), 0));
    proto::TileRecord& record = task.tiles.back().record;
    for (int k = 0; k < 4; ++k) record.set_region(k, box[static_cast<std::size_t>(k)] * std::numbers::pi / 180);
  }
  ASSERT_TRUE((*writer)->commit(task));
  proto::Manifest manifest;
  manifest.set_id(id);
  manifest.set_title(title);
  ASSERT_TRUE((*writer)->publish(manifest));
  add(test, id, State::ready, false, title);
}

Response asked(TestService& test, const Given& query, const std::map<std::string, std::string>& headers = {}) {
  Request request;
  request.path = "/v1/datasets";
  request.query = query;
  request.headers = headers;
  return test.api().handle(request);
}

std::vector<std::string> ids_of(const Response& response) {
  std::vector<std::string> ids;
  const Json body = body_of(response);
  for (const Json& dataset : body["datasets"]) ids.push_back(dataset["id"]);
  return ids;
}

/// The query of a page's `next`, as it is coded; empty: it is the last.
Given next_of(const Response& response) {
  const Json next = body_of(response)["next"];
  Given query;
  if (next.is_null()) return query;
  std::istringstream words(next.get<std::string>().substr(std::string("/v1/datasets?").size()));
  for (std::string word; std::getline(words, word, '&');)
    query.emplace_back(word.substr(0, word.find('=')), word.substr(word.find('=') + 1));
  return query;
}

TEST(DatasetList, AListIsBoundedAndSaysHowToGoOn) {
  TestService test;
  for (int k = 0; k < 250; ++k) add(test, "d" + std::to_string(k));
  std::vector<std::size_t> sizes;
  std::set<std::string> seen;
  for (Given query;;) {
    const Response page = asked(test, query);
    ASSERT_EQ(page.status, 200) << page.body;
    const auto ids = ids_of(page);
    ASSERT_FALSE(ids.empty()) << page.body;
    sizes.push_back(ids.size());
    for (const std::string& id : ids) EXPECT_TRUE(seen.insert(id).second) << id << " twice";
    // Who deletes what it reads, and what comes meanwhile, moves nothing.
    test.service().registry().remove(ids.back());
    add(test, "later" + std::to_string(sizes.size()));
    query = next_of(page);
    if (query.empty()) break;
  }
  EXPECT_THAT(sizes, ElementsAre(100, 100, 50));
  EXPECT_EQ(ids_of(asked(test, {{"limit", "1"}})).front(), "later3") << "newest first";
  EXPECT_EQ(body_of(asked(test, {{"limit", "1000"}}))["next"], nullptr);
}

TEST(DatasetList, ItsEndIsNoEmptyPage) {
  TestService test;
  for (const char* id : {"a", "b"}) add(test, id);
  EXPECT_EQ(body_of(asked(test, {{"limit", "2"}}))["next"], nullptr);
  EXPECT_FALSE(next_of(asked(test, {{"limit", "1"}})).empty());
}

/// Of what is mounted, too: a client may read `after` as a double, as JSON's numbers are read.
TEST(DatasetList, APlaceIsANumberThatADoubleHolds) {
  const TempFolder folder;
  proto::Manifest manifest;
  for (const double side : {-72.0, 44.0, -71.0, 45.0, 0.0, 100.0}) manifest.add_bounds(side);
  std::ofstream(folder.path() / "manifest.json") << pipeline::manifest_json(manifest);
  Settings settings;
  for (const char* name : {"a", "b", "c"}) settings.serve.mounts.push_back({name, folder.path().string()});
  TestService test(settings);
  add(test, "posted");
  std::vector<std::string> seen;
  for (Given query = {{"limit", "1"}}; !query.empty() && seen.size() < 5;) {
    const Response page = asked(test, query);
    ASSERT_THAT(ids_of(page), testing::SizeIs(1)) << page.body;
    seen.push_back(ids_of(page).front());
    query = next_of(page);
    if (!query.empty()) {
      std::ostringstream as_double;
      as_double << std::fixed << std::setprecision(0) << std::stod(query.front().second);
      query.front().second = as_double.str();
    }
  }
  EXPECT_THAT(seen, ElementsAre("a", "b", "c", "posted"));
}

TEST(DatasetList, FiltersAreKeptOnTheWay) {
  TestService test;
  for (int k = 0; k < 3; ++k) add(test, "Alp & co " + std::to_string(k));
  add(test, "other");
  const Response first = asked(test, {{"limit", "2"}, {"q", "aLP & C"}, {"state", "failed,ready"}});
  EXPECT_THAT(ids_of(first), ElementsAre("Alp & co 2", "Alp & co 1"));
  EXPECT_THAT(std::string(body_of(first)["next"]), HasSubstr("&limit=2&q=aLP%20%26%20C&state=failed,ready"));
  const Given next = next_of(first);
  EXPECT_THAT(ids_of(asked(test, {{"after", next.front().second}, {"q", "alp & c"}})), ElementsAre("Alp & co 0"));
}

TEST(DatasetList, StateAndPlaceAndText) {
  TestService test;
  add(test, "gone");
  add_ready(test, "alps", {{6, 45, 11, 47}}, "The Alps");
  add_ready(test, "fiji", {{177, -19, 180, -16}, {-180, -19, -178, -16}}, "Fiji");
  add_ready(test, "andes", {{-72, -40, -66, -30}}, "Cordillera");
  const auto with = [&](const std::string& name, const std::string& value) { return ids_of(asked(test, {{name, value}})); };
  EXPECT_THAT(with("state", "ready"), ElementsAre("andes", "fiji", "alps"));
  EXPECT_THAT(with("state", "failed"), ElementsAre("gone"));
  EXPECT_THAT(with("state", "queued"), IsEmpty());
  EXPECT_THAT(with("bbox", "0,40,7,50"), ElementsAre("alps"));
  EXPECT_THAT(with("bbox", "10.9,46.9,12,48"), ElementsAre("alps")) << "a corner of it";
  EXPECT_THAT(with("bbox", "11.1,40,12,50"), IsEmpty());
  EXPECT_THAT(with("bbox", "179,-20,-179,-15"), ElementsAre("fiji"));
  EXPECT_THAT(with("bbox", "-180,-20,-179,-15"), ElementsAre("fiji"));
  EXPECT_THAT(with("bbox", "-180,-90,180,90"), ElementsAre("andes", "fiji", "alps"));
  EXPECT_THAT(with("q", "THE"), ElementsAre("alps"));
  EXPECT_THAT(with("q", "and"), ElementsAre("andes"));
  EXPECT_EQ(body_of(asked(test, {{"q", "fiji"}}))["datasets"][0]["manifest"]["title"], "Fiji");
}

TEST(DatasetList, AnUnfinishedOneHasItsTitleToo) {
  TestService test;
  Dataset lazy;
  lazy.id = lazy.name = "n46e008";
  lazy.state = State::running;
  lazy.created = "2026-01-01T00:00:00Z";
  lazy.options.set_title("Glarus");
  ASSERT_TRUE(test.service().registry().add(lazy));
  add_ready(test, "alps", {{6, 45, 11, 47}}, "The Alps");
  const auto titles = [&](const Given& query) {
    std::vector<std::string> all;
    const Json body = body_of(asked(test, query));
    for (const Json& dataset : body["datasets"]) all.push_back(dataset["title"]);
    return all;
  };
  EXPECT_THAT(titles({}), ElementsAre("The Alps", "Glarus"));
  EXPECT_THAT(titles({{"q", "glarus"}}), ElementsAre("Glarus"));
  EXPECT_THAT(titles({{"q", "glarus"}, {"bbox", "-180,-90,180,90"}}), IsEmpty()) << "nobody knows yet where it is";
}

TEST(DatasetList, WhatIsWrongIsNamed) {
  TestService test;
  const std::vector<std::array<std::string, 3>> rows = {
      {"limit", "0", "option-invalid"},  {"limit", "1001", "option-invalid"}, {"limit", "many", "option-invalid"},
      {"after", "-1", "option-invalid"}, {"after", "", "option-invalid"},     {"state", "done", "option-invalid"},
      {"state", "", "option-invalid"},   {"bbox", "1,2,3", "option-invalid"}, {"bbox", "1,3,2,2", "option-invalid"},
      {"q", "\x01", "option-invalid"},   {"name", "a", "option-unknown"}};
  for (const auto& [name, value, slug] : rows) {
    const Response refused = asked(test, {{name, value}});
    EXPECT_EQ(refused.status, 400) << name << "=" << value;
    EXPECT_EQ(slug_of(refused), slug) << refused.body;
  }
  EXPECT_EQ(slug_of(asked(test, {{"limit", "1"}, {"limit", "2"}})), "option-repeated");
  EXPECT_THAT(asked(test, {{"name", "a"}}).body, HasSubstr("limit, after, state, bbox, q"));
  for (const char* beyond : {"99999999999999999999", "9223372036854775807", "9007199254740992"})
    EXPECT_EQ(asked(test, {{"after", beyond}}).status, 400) << beyond;
  EXPECT_EQ(asked(test, {{"after", "9007199254740991"}}).status, 200);
}

TEST(DatasetList, WhatIsPrivateLeavesNoTrace) {
  const access::NewToken reader = access::make_token("reader", access::Role::read);
  Settings settings;
  settings.serve.token_lines = reader.line;
  TestService test(settings);
  add(test, "secret-old", State::failed, true);
  add(test, "open");
  add(test, "secret-new", State::failed, true);
  EXPECT_THAT(ids_of(asked(test, {{"limit", "1"}})), ElementsAre("open"));
  EXPECT_EQ(body_of(asked(test, {{"limit", "1"}}))["next"], nullptr) << "it says that there are more";
  EXPECT_THAT(ids_of(asked(test, {{"q", "secret"}})), IsEmpty());
  EXPECT_EQ(ids_of(asked(test, {}, {{"authorization", "Bearer " + reader.token}})).size(), 3u);
}

/// A change of a row, of its store or of its progress is seen in the next list.
TEST(DatasetList, WhatIsKeptIsNotStale) {
  TestService test;
  const std::string id = body_of(test.post("GOOD", {}, {{"prefer", "wait=60"}}))["id"];
  const auto entry = [&] { return body_of(asked(test, {}))["datasets"][0]; };
  EXPECT_EQ(entry()["state"], "ready");
  EXPECT_EQ(entry(), entry());
  test.service().registry().set_state(id, State::failed, proto::Problem{"internal", "broken", "", ""});
  EXPECT_EQ(entry()["error"]["detail"], "broken");
  test.service().registry().set_state(id, State::ready, std::nullopt);
  EXPECT_EQ(entry()["error"], nullptr);
  EXPECT_EQ(test.send("DELETE", "/v1/datasets/" + id).status, 204);
  EXPECT_TRUE(body_of(asked(test, {}))["datasets"].empty());
}

TEST(DatasetList, NoPageAsksForIt) {
  TempFolder folder;
  std::ofstream(folder.path() / "index.html") << "<p>viewer";
  int asked_for = 0;
  const auto datasets = [&] {
    ++asked_for;
    return std::vector<Row>();
  };
  WebFiles files;
  for (const char* path : {"/nosuchfile", "/", "/index.html"}) {
    Request request;
    request.path = path;
    page(files, folder.path().string(), request, datasets);
  }
  EXPECT_EQ(asked_for, 0);
  Request root;
  root.path = "/";
  EXPECT_EQ(page(files, (folder.path() / "none").string(), root, datasets).status, 200);
  EXPECT_EQ(asked_for, 1);
}

/// Another program holds the file, so who writes waits; who reads does not. If it did, the file would be held until the writer
/// gives up.
TEST(DatasetList, ReadersDoNotWaitForTheWriter) {
  TestService test;
  add(test, "one");
  Registry& registry = test.service().registry();
  auto held = std::make_unique<pipeline::Database>(Layout{test.data()}.registry().string(), pipeline::Database::Mode::create);
  held->execute("BEGIN IMMEDIATE");
  std::atomic<bool> begun{false}, written{false};
  std::thread writer([&] {
    begun = true;
    try {
      registry.set_state("one", State::queued, std::nullopt);
      written = true;
    } catch (const RegistryError&) {}
  });
  EXPECT_TRUE(eventually([&] { return begun.load(); }));
  for (int k = 0; k < 50; ++k) {
    EXPECT_EQ(registry.find("one")->state, State::failed);
    EXPECT_EQ(registry.counts().failed, 1u);
    EXPECT_EQ(asked(test, {}).status, 200);
    std::this_thread::sleep_for(std::chrono::milliseconds(1));  // so that the writer has come to the file
  }
  held.reset();
  writer.join();
  EXPECT_TRUE(written) << "readers waited until the writer gave up";
  EXPECT_EQ(registry.find("one")->state, State::queued);
}

}  // namespace
}  // namespace cordillera::server
