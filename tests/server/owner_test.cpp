// What belongs to one token: keys, the existence of private datasets, signed addresses; and a change that comes too late.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>

#include "fixture.h"
#include "pipeline/store/sqlite.h"
#include "pipeline/store/store_schema.h"
#include "server/access/tokens.h"
#include "server/datasets/ledger.h"

namespace cordillera::server {
namespace {

using access::make_token;
using access::Role;
using testing::HasSubstr;
using testing::Not;

class Owners : public testing::Test {
 protected:
  using Headers = std::map<std::string, std::string>;
  static Headers of(const access::NewToken& token, Headers more = {}) {
    more.emplace("authorization", "Bearer " + token.token);
    return more;
  }
  static Settings settings() {
    Settings settings;
    settings.serve.token_lines = alice().line + ";" + bob().line + ";" + admin().line;
    settings.serve.source_allow = {"http://127.0.0.1:1/"};
    return settings;
  }
  static const access::NewToken& alice() {
    static const access::NewToken token = make_token("alice", Role::write);
    return token;
  }
  static const access::NewToken& bob() {
    static const access::NewToken token = make_token("bob", Role::write);
    return token;
  }
  static const access::NewToken& admin() {
    static const access::NewToken token = make_token("admin", Role::admin);
    return token;
  }
  Response ask(const std::string& method, const std::string& path, const Headers& headers = {}) {
    Request request;
    request.method = method;
    request.path = path;
    request.headers = headers;
    return test_.api().handle(request);
  }
  std::string posted(const Headers& headers, const Given& query = {}) {
    Headers all = headers;
    all.emplace("prefer", "wait=60");
    const Response answer = test_.post("GOOD", query, all);
    EXPECT_EQ(answer.status, 201) << answer.body;
    return body_of(answer)["id"];
  }

  TestService test_{settings()};
};

TEST_F(Owners, AnUploadIsItsOwnersAndAnAdminThrowsItAway) {
  const Response begun = ask("POST", "/v1/uploads", of(alice(), {{"upload-length", "4"}}));
  ASSERT_EQ(begun.status, 201) << begun.body;
  const std::string place = "/v1/" + begun.header("Location");
  EXPECT_EQ(ask("DELETE", place, of(bob())).status, 404);
  EXPECT_EQ(ask("HEAD", place, of(admin())).status, 404) << "what is in it is its owner's";
  EXPECT_EQ(ask("DELETE", place, of(admin())).status, 204);
  EXPECT_EQ(ask("HEAD", place, of(alice())).status, 404);
}

TEST_F(Owners, AKeyIsItsOwnersAlone) {
  const Headers mine = of(alice(), {{"idempotency-key", "k"}}), his = of(bob(), {{"idempotency-key", "k"}});
  const std::string hidden = posted(mine, {{"private", "1"}});
  const std::string same = posted(his, {{"private", "1"}});
  EXPECT_NE(same, hidden) << "another token's dataset is given away";
  EXPECT_EQ(posted(mine, {{"private", "1"}}), hidden);
  EXPECT_EQ(posted(his, {{"private", "1"}}), same);
  EXPECT_EQ(slug_of(test_.post("GOOD", {{"error", "2"}}, mine)), "idempotency-key-reused");
  Token under_way = test_.service().key_token("alice", "l");
  const Response in_use = test_.post("GOOD", {}, of(alice(), {{"idempotency-key", "l"}}));
  EXPECT_EQ(in_use.status, 409);
  EXPECT_EQ(in_use.header("Retry-After"), "5");
  EXPECT_EQ(test_.post("GOOD", {}, of(bob(), {{"idempotency-key", "l"}})).status, 202);
  under_way.reset();  // a request ends before its service
  test_.stop();
  test_.start();  // and it is remembered
  EXPECT_EQ(posted(mine, {{"private", "1"}}), hidden);
  EXPECT_EQ(posted(his, {{"private", "1"}}), same);
}

/// Keys of earlier versions stand without their owner.
TEST_F(Owners, AnEarlierVersionsKeyIsItsOwners) {
  const std::string id = posted(of(alice(), {{"idempotency-key", "k"}}));
  test_.stop();
  pipeline::Database(Layout{test_.data()}.registry().string(), pipeline::Database::Mode::create)
      .execute("UPDATE datasets SET idempotency_key = 'k'");
  test_.start();
  EXPECT_NE(posted(of(bob(), {{"idempotency-key", "k"}})), id);
  EXPECT_EQ(posted(of(alice(), {{"idempotency-key", "k"}})), id);
}

/// Without what differs between any two answers.
std::string comparable(const Response& response, const std::string& id) {
  std::string text = std::to_string(response.status) + "\n";
  for (const auto& [name, value] : response.headers) text += name == "X-Request-Id" ? "" : name + ": " + value + "\n";
  text += response.body.substr(0, response.body.find("\"request_id\""));
  for (auto at = text.find(id); at != text.npos; at = text.find(id)) text.replace(at, id.size(), "ID");
  return text;
}

TEST_F(Owners, APrivateIdLooksLikeNone) {
  const std::string hidden = posted(of(alice()), {{"private", "1"}, {"name", "dem.tif"}}), none = "dem-aaaaaaaa";
  ASSERT_EQ(hidden.size(), none.size());
  for (const char* method : {"GET", "HEAD", "POST", "PUT", "DELETE", "OPTIONS", "PATCH"}) {
    for (const char* below :
         {"", "/events", "/manifest.json", "/tileset.json", "/tiles/1/1/1.drc", "/mesh.glb", "/elevation", "/sources",
          "/sources/a", "/versions", "/rollback", "/versions/0123456789abcdef/tileset.json", "/nothing"}) {
      const std::string path = "/v1/datasets/";
      EXPECT_EQ(comparable(ask(method, path + hidden + below), hidden), comparable(ask(method, path + none + below), none))
          << method << below;
    }
  }
  const Response refused = ask("GET", "/v1/datasets/" + hidden);
  EXPECT_EQ(refused.status, 404);
  EXPECT_THAT(refused.body, HasSubstr("Authorization: Bearer TOKEN")) << "who forgot the token is not told";
  EXPECT_EQ(ask("GET", "/v1/datasets/" + hidden, of(alice())).status, 200);
}

TEST_F(Owners, ASignatureIsShownToWhoMayChangeTheDataset) {
  const std::string id = posted(of(alice()));
  const Layout layout{test_.data()};
  test_.stop();
  std::ofstream(layout.dataset(id) / updates::kChangesFile) << "{}";
  proto::DatasetVersion version;
  version.set_number(1);
  proto::DatasetSource& source = *version.add_sources();
  source.set_id("one");
  source.set_url("http://127.0.0.1:1/dem.tif?sig=SECRET");
  const std::string bytes = version.SerializeAsString();
  {
    pipeline::Database store(layout.store(id).string(), pipeline::Database::Mode::create);
    pipeline::Statement(store, pipeline::kPutMeta).bind(std::string(updates::kVersionNote), bytes).run();
  }
  test_.start();
  for (const std::string& path : {"/v1/datasets/" + id + "/sources", "/v1/datasets/" + id + "/sources/one"}) {
    EXPECT_THAT(ask("GET", path, of(alice())).body, HasSubstr("dem.tif?sig=SECRET"));
    EXPECT_THAT(ask("GET", path, of(admin())).body, HasSubstr("dem.tif?sig=SECRET"));
    for (const Headers& stranger : {Headers{}, of(bob())}) {
      const Response answer = ask("GET", path, stranger);
      EXPECT_EQ(answer.status, 200);
      EXPECT_THAT(answer.body, HasSubstr("http://127.0.0.1:1/dem.tif\""));
      EXPECT_THAT(answer.body, Not(HasSubstr("SECRET")));
    }
  }
}

/// Nor in the words of a problem, which everybody reads.
TEST_F(Owners, AnUnreachableAddressKeepsItsSignature) {
  for (const char* signature : {"?sig=SECRET", ";sig=SECRET", "#SECRET"}) {
    const Given query = {{"updates", "1"}, {"source", std::string("http://127.0.0.1:1/dem.tif") + signature}};
    const Json posted = body_of(test_.post("", query, of(alice())));
    const std::string id = posted["id"];
    EXPECT_EQ(posted["name"], "dem.tif") << signature;
    EXPECT_THAT(id, testing::StartsWith("dem-")) << signature;
    ASSERT_TRUE(eventually([&] { return test_.service().registry().find(id)->problem.has_value(); }));
    EXPECT_THAT(ask("GET", "/v1/datasets/" + id).body, HasSubstr("http://127.0.0.1:1/dem.tif cannot be fetched"));
    for (const std::string& path : {"/v1/datasets/" + id, "/v1/datasets/" + id + "/sources", std::string("/v1/datasets")}) {
      EXPECT_THAT(ask("GET", path).body, Not(HasSubstr("SECRET"))) << path;
    }
  }
}

TEST_F(Owners, AChangeOfADatasetThatIsGoneMakesNothing) {
  const std::string id = body_of(test_.post("SLOW", {{"updates", "1"}}, of(alice())))["id"], path = "/v1/datasets/" + id;
  Request change;
  change.method = "POST";
  change.path = path + "/sources";
  change.query = {{"name", "late.tif"}};
  change.headers = of(alice(), {{"content-length", "8"}});
  change.read_body = [&](const Request::Sink& sink) {
    if (!sink("late")) return false;
    EXPECT_EQ(ask("DELETE", path, of(alice())).status, 204);
    return sink("late");
  };
  const Response answer = test_.api().handle(change);
  EXPECT_EQ(answer.status, 404) << answer.body;
  EXPECT_EQ(slug_of(answer), "dataset-unknown");
  EXPECT_EQ(test_.leftovers(), 0u) << "its folder came back";
}

/// The build of the first version fails once a change waits behind it.
TEST(FirstVersion, ThatFailsIsToldToWhoWaitsForAChange) {
  const TempFolder folder;
  Settings settings;
  settings.serve.data = (folder.path() / "data").string();
  std::atomic<bool> fail{false};
  auto service = Service::open(
      settings, [&](const auto&, const auto&, const std::atomic<bool>& stop) -> proto::Result<std::optional<proto::Estimate>> {
        eventually([&] { return fail || stop; });
        return proto::Problem{"raster-unreadable", "damaged behind its beginning", "GeoTIFF", ""};
      });
  ASSERT_TRUE(service) << service.problem().line();
  Api api(**service);
  const auto post = [&](const std::string& path, const Given& query, const std::map<std::string, std::string>& headers) {
    Request request;
    request.method = "POST";
    request.path = path;
    request.query = query;
    request.headers = headers;
    request.headers.emplace("content-length", "4");
    request.read_body = [](const Request::Sink& sink) { return sink("GOOD"); };
    return api.handle(request);
  };
  const std::string id = posted_id(TestService::settled(post("/v1/datasets", {{"updates", "1"}}, {})));
  Response waiting = post("/v1/datasets/" + id + "/sources", {{"name", "more.tif"}}, kWait);
  ASSERT_TRUE(waiting.later) << waiting.status << waiting.body;
  fail = true;
  const Response told = TestService::settled(std::move(waiting));
  EXPECT_EQ(told.status, 409);
  EXPECT_EQ(slug_of(told), "dataset-failed") << told.body;
  EXPECT_THAT(told.body, HasSubstr("damaged behind its beginning"));
}

TEST_F(Owners, DescribeTheirDatasetsAnewWithoutABuild) {
  const std::string id = posted(of(alice()), {{"title", "Hils"}}), path = "/v1/datasets/" + id;
  const auto patch = [&](const Headers& headers, const Given& query) {
    Request request;
    request.method = "PATCH";
    request.path = path;
    request.query = query;
    request.headers = headers;
    return test_.api().handle(request);
  };
  const std::string version = body_of(ask("GET", path))["version"];
  EXPECT_EQ(patch({}, {{"title", "Hills"}}).status, 401);
  EXPECT_EQ(slug_of(patch(of(bob()), {{"title", "Hills"}})), "role-too-low");
  EXPECT_EQ(slug_of(patch(of(alice()), {{"error", "5"}})), "option-unknown");
  EXPECT_EQ(slug_of(patch(of(alice()), {})), "option-invalid");
  EXPECT_EQ(slug_of(patch(of(alice()), {{"title", "a"}, {"title", "b"}})), "option-repeated");
  for (const char* no_tiles : {"/{z}/{x}/{y}.png", "ftp://a/{z}/{x}/{y}", "https://a/{z}/{x}", "https://a/{z}/{x}/{y}/{y}",
                               "https://a/{z}/{x}/{y}\"", "https://{s}.a/{z}/{x}/{y}", "https://u:p@a/{z}/{x}/{y}"}) {
    EXPECT_EQ(slug_of(patch(of(alice()), {{"imagery", no_tiles}})), "option-invalid") << no_tiles;
  }
  for (const char* steers : {"a\x1b[31m",
                             "a\xc2\x9b"
                             "31m",
                             "a\xe2\x80\xa8"
                             "b",
                             "gpj.\xe2\x80\xae",
                             "\xe2\x81\xa6"
                             "a"}) {
    for (const char* word : {"title", "attribution"})
      EXPECT_EQ(slug_of(patch(of(alice()), {{word, steers}})), "option-invalid") << steers;
    EXPECT_EQ(slug_of(test_.post("GOOD", {{"name", steers}}, of(alice()))), "option-invalid") << steers;
  }
  const Response done =
      patch(of(alice()), {{"title", "Hills"}, {"attribution", "Somebody else"}, {"imagery", "https://a/{z}/{y}/{x}.jpg?k=1"}});
  ASSERT_EQ(done.status, 200) << done.body;
  EXPECT_EQ(body_of(done)["manifest"]["title"], "Hills");
  const Json manifest = body_of(TestService::plain(ask("GET", path + "/manifest.json")));
  EXPECT_EQ(manifest["title"], "Hills");
  EXPECT_EQ(manifest["attribution"], "Somebody else");
  EXPECT_EQ(manifest["options"]["imagery"], "https://a/{z}/{y}/{x}.jpg?k=1");
  EXPECT_EQ(body_of(done)["manifest"]["imagery"], "https://a/{z}/{y}/{x}.jpg?k=1");
  EXPECT_EQ(body_of(TestService::plain(ask("GET", path + "/tileset.json")))["asset"]["extras"]["imagery"],
            "https://a/{z}/{y}/{x}.jpg?k=1");
  EXPECT_NE(body_of(done)["version"], version);
  const auto titled = [&](const std::string& asked) {
    const Response answer = TestService::plain(ask("GET", path + "/versions/" + asked + "/manifest.json"));
    return answer.status == 200 ? std::string(body_of(answer)["title"]) : slug_of(answer);
  };
  const std::string second = body_of(done)["version"];
  EXPECT_EQ(titled(version), "Hils") << "what a version names never changes";
  EXPECT_EQ(titled(second), "Hills");
  test_.stop();
  test_.start();
  EXPECT_EQ(titled(version), "Hils") << "after a restart";
  EXPECT_EQ(patch(of(alice()), {{"private", "0"}}).status, 200);
  EXPECT_EQ(titled(version), "Hils") << "no word has changed";
  const auto sent = [&](const std::string& body, const char* type = "application/x-www-form-urlencoded") {
    Headers headers = of(alice());
    headers["content-type"] = type;
    headers["content-length"] = std::to_string(body.size());
    Request request;
    request.method = "PATCH";
    request.path = path;
    request.headers = headers;
    request.read_body = [body](const Request::Sink& sink) { return sink(body); };
    return test_.api().handle(request);
  };
  EXPECT_EQ(body_of(sent("title=White+Hills&attribution=A%26B"))["manifest"]["title"], "White Hills");
  EXPECT_EQ(titled(second), "Hills");
  EXPECT_EQ(titled(version), "version-unknown") << "one is kept";
  EXPECT_EQ(body_of(sent("{\"title\": \"Hills\"}"))["manifest"]["title"], "Hills");
  EXPECT_EQ(slug_of(sent("Hills")), "json-invalid");
  EXPECT_EQ(slug_of(sent("{\"private\": null}", "application/json")), "json-invalid");
  for (const char* no_text : {"5", "true", "[\"a\"]"})
    EXPECT_EQ(slug_of(sent(std::string("{\"title\": ") + no_text + "}", "application/json")), "json-invalid") << no_text;
  for (const char* bad : {"{\"title\": 5}", "[1]", "{\"title", ""}) {
    const Response refused = sent(bad, "application/json");
    EXPECT_THAT(refused.body, Not(HasSubstr("error\\\""))) << bad;
    EXPECT_EQ(refused.body.find("White Mountains") != std::string::npos, *bad != '\0') << "an example: " << refused.body;
  }
  for (const char* type : {"application/json", "application/x-www-form-urlencoded"})
    EXPECT_EQ(slug_of(sent("{\"title\": \"A\", \"attribution\": \"\", \"title\": \"B\"}", type)), "option-repeated") << type;
  const Json none = body_of(sent("{\"title\": null, \"attribution\": null, \"imagery\": null}", "application/json"));
  EXPECT_EQ(none["title"], "test") << "what the raster was called";
  EXPECT_EQ(none["manifest"]["attribution"], "");
  EXPECT_EQ(none["manifest"]["imagery"], "");
  EXPECT_EQ(body_of(TestService::plain(ask("GET", path + "/manifest.json")))["attribution"], "");
  const Json empty = body_of(patch(of(alice()), {{"title", ""}, {"imagery", ""}}));
  EXPECT_EQ(empty["title"], "test");
  EXPECT_EQ(body_of(sent("{\"title\": \"Hills\"}"))["manifest"]["title"], "Hills");
  const Response form = sent("--b\r\n", "multipart/form-data; boundary=b");
  EXPECT_EQ(slug_of(form), "body-form");
  EXPECT_THAT(std::string(body_of(form)["accepted"]), HasSubstr("as curl -d sends them"));
  EXPECT_EQ(patch(of(admin()), {{"private", "1"}}).status, 200);
  EXPECT_EQ(ask("GET", path).status, 404);
  EXPECT_EQ(ask("GET", path, of(bob())).status, 200);
  test_.stop();
  test_.start();
  EXPECT_EQ(ask("GET", path).status, 404) << "after a restart";
  EXPECT_EQ(body_of(ask("GET", path, of(alice())))["manifest"]["title"], "Hills");
}

TEST_F(Owners, AreAskedForTheirTokenOnPagesOfOtherOriginsToo) {
  const auto preflight = [&](const std::string& path) { return ask("OPTIONS", path, {{"origin", "https://example.org"}}); };
  EXPECT_THAT(preflight("/v1/datasets").header("Access-Control-Allow-Methods"), HasSubstr("POST, PUT"));
  EXPECT_THAT(preflight("/v1/datasets/a").header("Access-Control-Allow-Methods"), HasSubstr("PATCH, DELETE"));
  for (const char* name : {"Authorization", "Content-Type", "Prefer", "Idempotency-Key", "Upload-Offset", "Tus-Resumable"}) {
    EXPECT_THAT(preflight("/v1/uploads").header("Access-Control-Allow-Headers"), HasSubstr(name));
  }
  EXPECT_EQ(test_.post("GOOD", {}, of(alice(), {{"origin", "https://example.org"}})).status, 202);
  EXPECT_EQ(test_.post("GOOD", {}, {{"origin", "https://example.org"}}).status, 401);
  TestService open;
  Request request;
  request.method = "OPTIONS";
  request.path = "/v1/datasets";
  const Response none = open.api().handle(request);
  EXPECT_EQ(none.header("Access-Control-Allow-Methods"), "GET, HEAD, OPTIONS") << "without tokens any page could write";
  EXPECT_THAT(none.header("Access-Control-Allow-Headers"), Not(HasSubstr("Content-Type")));
}

TEST_F(Owners, HaveNoItemOfAPrivateDatasetForStrangers) {
  const std::string open = posted(of(alice())), hidden = posted(of(alice()), {{"private", "1"}});
  const std::string items = "/stac/collections/datasets/items";
  EXPECT_EQ(ask("GET", items + "/" + open).status, 200);
  const Response stranger = ask("GET", items + "/" + hidden);
  EXPECT_EQ(stranger.status, 404);
  EXPECT_EQ(slug_of(stranger), slug_of(ask("GET", items + "/nobody")));
  EXPECT_EQ(ask("GET", "/v1/datasets/" + hidden + ".pmtiles").status, 404);
  EXPECT_EQ(body_of(ask("GET", items))["numberReturned"], 1);
  EXPECT_EQ(body_of(ask("GET", items, of(bob())))["numberReturned"], 2);
  for (const char* path : {"/stac/other", "/stac/collections/datasets/items/A"}) EXPECT_EQ(ask("GET", path).status, 404) << path;
}

}  // namespace
}  // namespace cordillera::server
