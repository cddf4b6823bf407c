// Conditions of requests: If-Match and If-None-Match, of what is read and of what is changed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fixture.h"
#include "server/access/tokens.h"
#include "server/http/conditions.h"

namespace cordillera::server {
namespace {

using Headers = std::map<std::string, std::string>;

class Condition : public testing::Test {
 protected:
  void SetUp() override { base_ = "/v1/datasets/" + posted_id(test_.post("GOOD", {}, kWait)); }
  Response ask(const std::string& method, const std::string& path, const Headers& headers, const Given& query = {}) {
    Request request;
    request.method = method;
    request.path = path;
    request.headers = headers;
    request.query = query;
    return TestService::settled(test_.api().handle(request));
  }
  Response patch(const Headers& headers, const std::string& title = "Hills") {
    return ask("PATCH", base_, headers, {{"title", title}});
  }
  std::string tag() { return test_.get(base_).header("ETag"); }

  TestService test_;
  std::string base_;
};

TEST_F(Condition, AChangeIsMadeOnlyOfWhatWasRead) {
  const std::string tag = this->tag();
  ASSERT_TRUE(tag.starts_with('"')) << tag;
  for (const std::string& other : {std::string("\"nope\""), "W/" + tag, std::string("nope"), std::string(), std::string("\"")}) {
    EXPECT_EQ(slug_of(ask("DELETE", base_, {{"if-match", other}})), "precondition-failed") << other;
    EXPECT_EQ(patch({{"if-match", other}}).status, 412) << other;
  }
  EXPECT_EQ(this->tag(), tag) << "nothing was changed";
  const Response changed = patch({{"if-match", "\"other\", " + tag}});
  EXPECT_EQ(changed.status, 200) << changed.body;
  EXPECT_NE(changed.header("ETag"), tag);
  EXPECT_EQ(changed.header("ETag"), this->tag()) << "the next change can name it";
  EXPECT_EQ(patch({{"if-match", tag}}, "Valleys").status, 412) << "somebody else has changed it";
  EXPECT_EQ(patch({{"if-match", "*"}}, "Valleys").status, 200);
  EXPECT_EQ(ask("DELETE", base_, {{"if-match", changed.header("ETag")}}).status, 412);
  EXPECT_EQ(ask("DELETE", base_, {{"if-match", this->tag()}}).status, 204);
  EXPECT_EQ(ask("DELETE", base_, {{"if-match", "*"}}).status, 404) << "what is not there is told first";
}

TEST_F(Condition, WhatIsThereIsNotMadeAnew) {
  EXPECT_EQ(slug_of(ask("DELETE", base_, {{"if-none-match", "*"}})), "precondition-failed");
  EXPECT_EQ(patch({{"if-none-match", tag()}}).status, 412);
  EXPECT_EQ(patch({{"if-none-match", "\"other\""}}).status, 200);
}

TEST_F(Condition, RastersAndVersionsHaveTagsOfTheirOwn) {
  const auto send = [&](const std::string& path, const std::string& tag) {
    return ask("POST", base_ + path, {{"if-match", tag}, {"content-length", "0"}}).status;
  };
  EXPECT_EQ(send("/sources", "\"nope\""), 412);
  const std::string sources = test_.get(base_ + "/sources").header("ETag");
  EXPECT_NE(send("/sources", sources), 412);
  EXPECT_EQ(send("/rollback", "\"nope\""), 412);
  const std::string versions = test_.get(base_ + "/versions").header("ETag");
  EXPECT_TRUE(versions.starts_with('"')) << versions;
  EXPECT_NE(send("/rollback", versions), 412);
  EXPECT_EQ(ask("DELETE", base_ + "/sources/none", {{"if-match", "\"nope\""}}).status, 409)
      << "that its raster is fixed for good is told first";
  EXPECT_EQ(ask("POST", "/v1/datasets", {{"if-match", "\"nope\""}}).status, 412) << "the list has no tag";
}

TEST_F(Condition, WhatIsReadIsWhatWasReadBefore) {
  for (const std::string path : {"", "/tiles/1/1/1.drc", "/manifest.json", "/versions"}) {
    const std::string tag = test_.get(base_ + path).header("ETag");
    EXPECT_EQ(test_.get(base_ + path, {{"if-match", "*"}}).status, 200) << path;
    EXPECT_EQ(test_.get(base_ + path, {{"if-match", tag}}).status, tag.starts_with("W/") ? 412 : 200) << path;
    const Response other = test_.get(base_ + path, {{"if-match", "\"nope\""}, {"if-none-match", tag}});
    EXPECT_EQ(other.status, 412) << path << ": If-Match comes before If-None-Match";
    EXPECT_EQ(slug_of(other), "precondition-failed") << path;
  }
  EXPECT_EQ(test_.get("/v1/datasets/none", {{"if-match", "\"nope\""}}).status, 404);
}

/// Between the request's head and its effect somebody else may have been faster.
TEST_F(Condition, AChangeThatAnotherOvertookIsRefused) {
  const std::string body = R"({"title": "Late"})";
  Request late;
  late.method = "PATCH";
  late.path = base_;
  late.headers = {{"if-match", tag()}, {"content-type", "application/json"}, {"content-length", std::to_string(body.size())}};
  late.read_body = [&](const Request::Sink& sink) {
    EXPECT_EQ(patch({}, "Early").status, 200);
    return sink(body);
  };
  EXPECT_EQ(slug_of(test_.api().handle(late)), "precondition-failed");
  EXPECT_EQ(body_of(test_.get(base_))["title"], "Early");
}

TEST(Conditions, TellNobodyWhichPrivateDatasetsThereAre) {
  const access::NewToken admin = access::make_token("admin", access::Role::admin);
  const access::NewToken writer = access::make_token("writer", access::Role::write);
  Settings settings;
  settings.serve.token_lines = admin.line + ";" + writer.line;
  TestService test(settings);
  const Headers is_admin = {{"authorization", "Bearer " + admin.token}};
  const std::string base = "/v1/datasets/" + posted_id(test.post("GOOD", {{"private", "1"}}, is_admin));
  const auto status = [&](const std::string& method, const std::string& path, Headers headers) {
    headers["if-match"] = "\"nope\"";
    Request request;
    request.method = method;
    request.path = path;
    request.headers = headers;
    return test.api().handle(request).status;
  };
  for (const std::string& path : {base, std::string("/v1/datasets/none")}) EXPECT_EQ(status("GET", path, {}), 404) << path;
  for (const char* method : {"DELETE", "PATCH"}) {
    EXPECT_EQ(status(method, base, {}), status(method, "/v1/datasets/none", {})) << method;
    EXPECT_EQ(status(method, base, {{"authorization", "Bearer " + writer.token}}), 403) << "who may not is told that";
    EXPECT_EQ(status(method, base, is_admin), 412);
  }
}

TEST(Conditions, TagsAreComparedAsHttpHasIt) {
  const auto holds = [](const std::string& header, const std::string& tag) {
    Request request;
    request.headers["if-match"] = header;
    return if_match_holds(request, tag);
  };
  EXPECT_TRUE(if_match_holds(Request(), ""));
  EXPECT_TRUE(holds("\"ab\"", "\"ab\""));
  EXPECT_TRUE(holds("\"x\" ,\"ab-br\"", "\"ab\"")) << "of the same in another coding";
  EXPECT_TRUE(holds("\"ab-gzip\"", "\"ab\""));
  EXPECT_FALSE(holds("\"ab\"", ""));
  EXPECT_FALSE(holds("\"a\"", "\"ab\""));
  EXPECT_FALSE(holds("W/\"ab\"", "W/\"ab\"")) << "weak ones never match";
  EXPECT_FALSE(holds("ab", "\"ab\""));
  EXPECT_TRUE(names_tag("\"ab-gzip\"", "\"ab\""));
  EXPECT_FALSE(names_tag("\"ab-x\"", "\"ab\""));
}

}  // namespace
}  // namespace cordillera::server
