// What changes while a request's body comes, or while a stream goes on: other requests are answered meanwhile.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <atomic>
#include <thread>

#include "fixture.h"
#include "server/access/tokens.h"
#include "server/datasets/dataset_folder.h"

namespace cordillera::server {
namespace {

using access::make_token;
using access::Role;
using testing::HasSubstr;

class Meanwhile : public testing::Test {
 protected:
  const access::NewToken writer_ = make_token("writer", Role::write), reader_ = make_token("reader", Role::read);
  TestService test_{[this] {
    Settings settings;
    settings.serve.token_lines = writer_.line + ";" + reader_.line;
    return settings;
  }()};

  std::string posted(const std::string& raster = "GOOD") {
    return body_of(test_.post(raster, {}, {{"authorization", "Bearer " + writer_.token}}))["id"];
  }
  std::string ready() {
    const std::string id = posted();
    EXPECT_TRUE(eventually([&] { return test_.service().registry().find(id)->state == State::ready; }));
    return id;
  }
  /// before: once half of the body has come.
  Request asked(const std::string& method, const std::string& path, const std::string& body,
                const std::function<void()>& before = nullptr) {
    Request request;
    request.method = method;
    request.path = path;
    request.headers = {{"content-type", "application/json"}, {"content-length", std::to_string(body.size())}};
    request.read_body = [body, before](const Request::Sink& sink) {
      if (!sink(std::string_view(body).substr(0, body.size() / 2))) return false;
      if (before) before();
      return sink(std::string_view(body).substr(body.size() / 2));
    };
    return request;
  }
  Response change(const std::string& id, const std::string& body, const std::function<void()>& before = nullptr) {
    Request request = asked("PATCH", "/v1/datasets/" + id, body, before);
    request.headers["authorization"] = "Bearer " + writer_.token;
    return test_.api().handle(request);
  }
  int read_by_anybody(const std::string& id) { return test_.get("/v1/datasets/" + id).status; }
};

TEST_F(Meanwhile, AChangeUndoesNoneThatWasMadeWhileItsBodyCame) {
  const std::string id = ready();
  const Response late = change(id, R"({"title": "Hills"})", [&] { EXPECT_EQ(change(id, R"({"private": true})").status, 200); });
  EXPECT_EQ(late.status, 200) << late.body;
  EXPECT_EQ(body_of(late)["private"], true);
  EXPECT_EQ(body_of(late)["manifest"]["title"], "Hills");
  EXPECT_EQ(read_by_anybody(id), 404);
}

/// Whether a thread of this process waits for something.
bool is_asleep(pid_t thread) {
  const std::string stat = file_text("/proc/self/task/" + std::to_string(thread) + "/stat");
  const std::size_t name = stat.rfind(')');
  return name != stat.npos && stat.substr(name, 3) == ") S";
}

/// Else its folder would be there again, with a record alone, and a dataset at the next start.
TEST_F(Meanwhile, AChangeDoesNotBringBackWhatIsDeleted) {
  const std::string id = ready();
  const std::filesystem::path folder = test_.service().layout().dataset(id);
  std::atomic<pid_t> thread{0};
  std::atomic<int> answered{0};
  std::jthread changes;
  test_.service().ledger().apart([&] {  // as a deletion does
    changes = std::jthread([&] {
      answered = change(id, R"({"title": "Hills"})", [&] { thread = static_cast<pid_t>(syscall(SYS_gettid)); }).status;
    });
    EXPECT_TRUE(eventually([&] { return answered != 0 || (thread != 0 && is_asleep(thread)); }));
    EXPECT_EQ(answered, 0) << "it was written down while a deletion takes the row away";
    test_.service().registry().remove(id);
    std::filesystem::remove_all(folder);
  });
  changes.join();
  EXPECT_EQ(answered, 404);
  EXPECT_FALSE(std::filesystem::exists(folder));
}

TEST_F(Meanwhile, ARecordDoesNotMakeAFolderAnew) {
  const std::string id = ready();
  const Row row = test_.service().registry().find(id);
  const std::filesystem::path gone = test_.folder() / id;
  const auto written = write_record(gone, *row);
  ASSERT_FALSE(written);
  EXPECT_EQ(written.problem().type, "dataset-unknown");
  EXPECT_FALSE(std::filesystem::exists(gone));
}

/// It has no folder any more, and its row is still listed.
TEST_F(Meanwhile, WhatFailedIsDescribedWithoutAFolder) {
  const std::string id = posted("BAD");
  EXPECT_TRUE(eventually([&] {
    return test_.service().registry().find(id)->state == State::failed &&
           !std::filesystem::exists(test_.service().layout().dataset(id));
  }));
  const Response described = change(id, R"({"private": true})");
  EXPECT_EQ(described.status, 200) << described.body;
  EXPECT_EQ(read_by_anybody(id), 404);
  EXPECT_FALSE(std::filesystem::exists(test_.service().layout().dataset(id)));
}

TEST_F(Meanwhile, HeightsAreNotToldOfWhatBecamePrivateWhileThePlacesCame) {
  const std::string id = ready();
  const Response told = test_.api().handle(asked("POST", "/v1/datasets/" + id + "/elevation", R"({"points": [[-90, 20]]})",
                                                 [&] { EXPECT_EQ(change(id, R"({"private": true})").status, 200); }));
  EXPECT_EQ(told.status, 404) << told.body;
}

TEST_F(Meanwhile, AnArchiveIsNotGivenOfWhatBecamePrivateWhileItWasMade) {
  for (const bool becomes_private : {false, true}) {
    const std::string id = ready();
    Request request;
    request.path = "/v1/datasets/" + id + ".pmtiles";
    request.query = {{"format", "drc"}};
    request.headers = {{"prefer", "wait=10"}};
    Response waiting = test_.api().handle(request);
    ASSERT_TRUE(waiting.later) << waiting.status << waiting.body;
    if (becomes_private) { ASSERT_EQ(change(id, R"({"private": true})").status, 200); }
    const Response come = TestService::settled(std::move(waiting));
    EXPECT_EQ(come.status, becomes_private ? 404 : 200) << come.body;
    EXPECT_EQ(come.header("Preference-Applied"), "wait=10");
  }
}

TEST_F(Meanwhile, AStreamEndsForWhoMayNotReadTheDatasetAnyMore) {
  const std::string id = posted("SLOW");
  Request request;
  request.path = "/v1/datasets/" + id + "/events";
  const Response anybody = test_.api().handle(request);
  request.headers = {{"authorization", "Bearer " + reader_.token}};
  const Response reader = test_.api().handle(request);
  ASSERT_TRUE(anybody.next_piece && reader.next_piece);
  EXPECT_THAT(anybody.next_piece().value_or(""), HasSubstr("event: progress"));
  EXPECT_THAT(reader.next_piece().value_or(""), HasSubstr("event: progress"));
  EXPECT_EQ(change(id, R"({"private": true})").status, 200);
  EXPECT_THAT(anybody.next_piece().value_or(""), HasSubstr("dataset-unknown"));
  EXPECT_FALSE(anybody.next_piece());
  EXPECT_THAT(reader.next_piece().value_or(""), HasSubstr("event: progress"));
}

TEST_F(Meanwhile, ANumberThatIsTooGreatIsToldSo) {
  const Response refused = change(ready(), R"({"title": 1e999})");
  EXPECT_EQ(refused.status, 400);
  EXPECT_EQ(slug_of(refused), "json-invalid");
  EXPECT_THAT(refused.body, HasSubstr("greater than any"));
}

/// Pages ask before they read, and show no token then.
TEST_F(Meanwhile, ABrowserMayAskForTheMetrics) {
  const Response asked = test_.send("OPTIONS", "/metrics");
  EXPECT_EQ(asked.status, 204) << asked.body;
  EXPECT_EQ(test_.get("/metrics").status, 401);
}

}  // namespace
}  // namespace cordillera::server
