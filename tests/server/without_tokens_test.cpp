// A service without tokens over what was posted while there were some: this machine alone reads what is private.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fixture.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Whose program or page asks.
struct Asker {
  std::string client;
  std::map<std::string, std::string> headers;
};

class WithoutTokens : public testing::Test {
 protected:
  void open(const Settings& settings = {}) {
    test_ = std::make_unique<TestService>(settings);
    id_ = body_of(test_->post("GOOD", {}, kWait))["id"];
    Registry& registry = test_->service().registry();
    registry.describe(id_, registry.find(id_)->options, true);
  }
  Response ask(const Asker& asker, const std::string& method, const std::string& path) {
    Request request;
    request.method = method;
    request.path = path;
    request.headers = asker.headers;
    request.client = asker.client;
    return TestService::plain(test_->api().handle(request));
  }
  void expect_readable(const Asker& asker) {
    for (const std::string& path : paths()) EXPECT_EQ(ask(asker, "GET", path).status, 200) << path;
    for (const char* list : kLists) EXPECT_THAT(ask(asker, "GET", list).body, HasSubstr(id_)) << list;
    EXPECT_THAT(ask(asker, "GET", "/v1/datasets/" + id_ + "/tiles/1/1/1.drc").header("Vary"), HasSubstr("Origin"));
  }
  void expect_unknown(const Asker& asker) {
    for (const std::string& path : paths()) {
      const Response answer = ask(asker, "GET", path);
      EXPECT_EQ(answer.problem, "dataset-unknown") << path;
      EXPECT_EQ(answer.status, 404) << path;
    }
    for (const char* list : kLists) {
      const Response answer = ask(asker, "GET", list);
      EXPECT_EQ(answer.status, 200) << list;
      EXPECT_THAT(answer.body, Not(HasSubstr(id_))) << list;
    }
    EXPECT_NE(ask(asker, "DELETE", "/v1/datasets/" + id_).status, 204);
  }
  std::vector<std::string> paths() const {
    std::vector<std::string> all = {"/stac/collections/datasets/items/" + id_};
    for (const char* below : {"", "/manifest.json", "/tileset.json", "/events", "/tiles/1/1/1.drc"})
      all.push_back("/v1/datasets/" + id_ + below);
    return all;
  }

  static constexpr const char* kLists[] = {"/v1/datasets", "/stac/collections/datasets/items", "/"};
  std::unique_ptr<TestService> test_;
  std::string id_;
};

TEST_F(WithoutTokens, WhatIsPrivateIsReadByThisMachineAlone) {
  open();
  for (const Asker& here : std::vector<Asker>{
           {"", {}},
           {"127.0.0.1", {{"host", "localhost:8080"}}},
           {"127.0.0.1", {{"host", "127.0.0.1:8080"}, {"origin", "http://127.0.0.1:8080"}, {"sec-fetch-site", "same-origin"}}}})
    expect_readable(here);
  for (const Asker& stranger : std::vector<Asker>{{"127.0.0.1", {{"host", "127.0.0.1:8080"}, {"origin", "https://example.org"}}},
                                                  {"127.0.0.1", {{"host", "127.0.0.1:8080"}, {"sec-fetch-site", "cross-site"}}},
                                                  {"127.0.0.1", {{"host", "rebound.example.org:8080"}}},
                                                  {"127.0.0.1", {{"host", "127.0.0.1:8080"}, {"x-forwarded-for", "192.0.2.1"}}},
                                                  {"127.0.0.1", {{"host", "127.0.0.1:8080"}, {"via", "1.1 proxy"}}}})
    expect_unknown(stranger);
}

TEST_F(WithoutTokens, WhereEverybodyMayWriteThatIsSo) {
  Settings settings;
  settings.serve.listen = "0.0.0.0:8080";
  settings.serve.insecure_writes = true;
  open(settings);
  const std::string open_one = body_of(test_->post("GOOD", {}, kWait))["id"];
  const Asker network{"192.0.2.7", {{"host", "terrain.example.org:8080"}}};
  expect_unknown(network);
  expect_unknown({"192.0.2.7", {}});
  expect_unknown({"127.0.0.1", {{"host", "terrain.example.org:8080"}}});
  expect_unknown({"127.0.0.1", {{"host", "localhost:8080"}, {"origin", "https://example.org"}}});
  expect_readable({"127.0.0.1", {{"host", "localhost:8080"}}});
  EXPECT_EQ(ask(network, "DELETE", "/v1/datasets/" + id_).status, 404);
  EXPECT_EQ(ask(network, "DELETE", "/v1/datasets/" + open_one).status, 204) << "it may write";
}

TEST_F(WithoutTokens, TheLogSaysHowManyArePrivate) {
  const auto said_at_start = [&] {
    test_->stop();
    testing::internal::CaptureStdout();
    test_->start();
    return testing::internal::GetCapturedStdout();
  };
  open();
  EXPECT_THAT(said_at_start(), HasSubstr("only this machine reads what is private (1 dataset)"));
  Registry& registry = test_->service().registry();
  registry.describe(id_, registry.find(id_)->options, false);
  std::filesystem::remove(test_->data() / "datasets" / id_ / "dataset.json");
  EXPECT_THAT(said_at_start(), Not(HasSubstr("private")));
}

}  // namespace
}  // namespace cordillera::server
