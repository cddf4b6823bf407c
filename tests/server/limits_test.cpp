// Every limit, met once; and what the service says of them.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <future>

#include "fixture.h"
#include "proto/cores.h"
#include "server/access/tokens.h"
#include "server/jobs/job_queue.h"
#include "server/jobs/spare_disk.h"
#include "server/limits/disk.h"
#include "server/memory/memory_limit.h"
#include "server/options/request_policy.h"

namespace cordillera::server {
namespace {

/// A post whose body comes when it is told to.
class SlowPost {
 public:
  SlowPost(TestService& test, std::map<std::string, std::string> headers, const std::string& client = "192.0.2.1") {
    Request request;
    request.method = "POST";
    request.path = "/v1/datasets";
    request.client = client;
    request.headers = std::move(headers);
    request.headers.emplace("content-length", "4");
    request.read_body = [this](const Request::Sink& sink) {
      begun_.set_value();
      go_.get_future().wait();
      return sink("GOOD");
    };
    answer_ = std::async(std::launch::async, [&test, request] { return test.api().handle(request); });
    begun_.get_future().wait();
  }
  Response end() {
    go_.set_value();
    return answer_.get();
  }

 private:
  std::promise<void> begun_, go_;
  std::future<Response> answer_;
};

Response post_from(TestService& test, const std::string& client, const std::map<std::string, std::string>& headers = {}) {
  Request request;
  request.method = "POST";
  request.path = "/v1/datasets";
  request.client = client;
  request.headers = headers;
  request.headers.emplace("content-length", "4");
  request.read_body = [](const Request::Sink& sink) { return sink("GOOD"); };
  return test.api().handle(request);
}

TEST(Limits, WhoPostsAsksForNoMoreThanABuildTakesByItself) {
  proto::BuildOptions greedy;
  greedy.set_threads(1024), greedy.set_memory(1 << 24);
  ASSERT_FALSE(apply_policy(Settings(), greedy));
  EXPECT_EQ(greedy.threads(), proto::usable_cores());
  EXPECT_EQ(greedy.memory(), default_memory_mib(greedy));
  Settings server;
  server.build.set_threads(3), server.build.set_memory(9000);
  greedy.set_threads(1024), greedy.set_memory(1 << 24);
  ASSERT_FALSE(apply_policy(server, greedy));
  EXPECT_EQ(greedy.threads(), 3u);
  EXPECT_EQ(greedy.memory(), 9000u);
  proto::BuildOptions modest;
  ASSERT_FALSE(apply_policy(Settings(), modest));
  EXPECT_EQ(modest.threads(), 0u) << "as many as there are, wherever it is built";
}

TEST(Limits, UploadsOfOneClient) {
  Settings settings;
  settings.serve.limits.client_uploads = 1;
  TestService test(settings);
  SlowPost first(test, {});
  const Response second = post_from(test, "192.0.2.1");
  EXPECT_EQ(second.status, 429);
  EXPECT_EQ(slug_of(second), "too-many-uploads");
  EXPECT_EQ(second.header("Retry-After"), "5");
  EXPECT_EQ(post_from(test, "192.0.2.2").status, 202);  // another one's are his own
  EXPECT_EQ(first.end().status, 202);
  EXPECT_EQ(post_from(test, "192.0.2.1").status, 202);
}

TEST(Limits, UploadsOfOneNetwork) {
  Settings settings;
  settings.serve.limits.client_uploads = 1;
  TestService test(settings);
  SlowPost first(test, {}, "2001:db8:0:7::1");
  EXPECT_EQ(slug_of(post_from(test, "2001:db8:0:7:ab::9")), "too-many-uploads");
  EXPECT_EQ(post_from(test, "2001:db8:0:8::1").status, 202);
  EXPECT_EQ(first.end().status, 202);
}

TEST(Limits, UploadsAreThoseOfAToken) {
  const access::NewToken one = access::make_token("one", access::Role::write),
                         two = access::make_token("two", access::Role::write);
  Settings settings;
  settings.serve.token_lines = one.line + ";" + two.line;
  settings.serve.limits.client_uploads = 1;
  TestService test(settings);
  SlowPost first(test, {{"authorization", "Bearer " + one.token}});
  EXPECT_EQ(post_from(test, "192.0.2.9", {{"authorization", "Bearer " + one.token}}).status, 429);
  EXPECT_EQ(post_from(test, "192.0.2.1", {{"authorization", "Bearer " + two.token}}).status, 202);
  EXPECT_EQ(first.end().status, 202);
}

TEST(Limits, UploadsOfAll) {
  Settings settings;
  settings.serve.limits.uploads = 1;
  TestService test(settings);
  SlowPost first(test, {});
  const Response second = post_from(test, "192.0.2.2");
  EXPECT_EQ(second.status, 503);
  EXPECT_EQ(slug_of(second), "service-busy");
  EXPECT_FALSE(second.header("Retry-After").empty());
  EXPECT_EQ(body_of(test.get("/v1/limits"))["in_use"]["max_uploads"], 1);
  EXPECT_EQ(first.end().status, 202);
  EXPECT_EQ(body_of(test.get("/v1/limits"))["in_use"]["max_uploads"], 0);
}

TEST(Limits, BuildsThatWait) {
  Settings settings;
  settings.serve.limits.queue = 1;
  TestService test(settings);
  ASSERT_EQ(test.post("SLOW").status, 202);
  ASSERT_TRUE(eventually([&] { return test.service().registry().counts().running == 1; }));
  ASSERT_EQ(test.post("GOOD", {}, {{"idempotency-key", "again"}}).status, 202);
  const Response third = test.post("GOOD");
  EXPECT_EQ(third.status, 503);
  EXPECT_EQ(slug_of(third), "queue-full");
  EXPECT_EQ(third.header("Retry-After"), "30");
  EXPECT_EQ(test.post("GOOD", {}, {{"idempotency-key", "again"}}).status, 202);  // it has its place
  const Response ready = test.get("/readyz");
  EXPECT_EQ(ready.status, 503);
  EXPECT_EQ(body_of(ready)["reasons"], Json::array({"queue-full"}));
  EXPECT_EQ(test.get("/healthz").status, 200);
}

TEST(Limits, Datasets) {
  Settings settings;
  settings.serve.limits.datasets = 1;
  TestService test(settings);
  const std::string id = body_of(test.post("GOOD"))["id"];
  const Response second = test.post("GOOD");
  EXPECT_EQ(second.status, 507);
  EXPECT_EQ(slug_of(second), "datasets-full");
  EXPECT_EQ(body_of(test.get("/readyz"))["reasons"], Json::array({"datasets-full"}));
  EXPECT_EQ(test.send("DELETE", "/v1/datasets/" + id).status, 204);
  EXPECT_THAT(test.post("GOOD").status, testing::AnyOf(201, 202)) << "its build may be over by then";
  EXPECT_EQ(test.get("/readyz").status, 503);
}

TEST(Limits, WhatFailedTakesNoPlaceOfADataset) {
  Settings settings;
  settings.serve.limits.datasets = 2;
  TestService test(settings);
  for (int k = 0; k < 3; ++k) EXPECT_EQ(test.post("BAD", {}, kWait).status, 422);
  EXPECT_EQ(test.get("/readyz").status, 200);
  EXPECT_EQ(body_of(test.get("/v1/limits"))["in_use"]["max_datasets"], 0);
  EXPECT_EQ(test.post("GOOD", {}, kWait).status, 201);
}

TEST(Limits, OfMoreThanAThousandThatFailedTheOldestGo) {
  TestService test;
  Registry& registry = test.service().registry();
  Dataset old;
  old.state = State::failed;
  for (int k = 0; k < 1000; ++k) {
    old.id = "old-" + std::to_string(k);
    ASSERT_TRUE(registry.add(old));
  }
  EXPECT_EQ(test.post("BAD", {}, kWait).status, 422);
  ASSERT_TRUE(eventually([&] { return !registry.find("old-0"); }));
  EXPECT_EQ(test.get("/v1/datasets/old-0").status, 404);
  EXPECT_EQ(test.get("/v1/datasets/old-1").status, 200);
  EXPECT_EQ(registry.counts().failed, 1000u);
}

/// Which of those that failed goes, when there are too many: by when they failed, not by when they were posted.
TEST(Limits, OfThoseThatFailedTheLastOnesStay) {
  TestService test;
  Registry& registry = test.service().registry();
  const std::string id = posted_id(test.post("LIVE"));
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(test.service().layout().provisional(id)); }));
  Dataset other;
  other.state = State::failed;
  for (std::size_t k = 0; k < kMostFailed; ++k) {
    other.id = "failed-" + std::to_string(k);
    ASSERT_TRUE(registry.add(other));
  }
  std::ofstream(test.service().layout().dataset(id) / "fail") << "now";
  ASSERT_TRUE(eventually([&] { return !registry.find("failed-0") || !registry.find(id); }));
  ASSERT_TRUE(registry.find(id)) << "who waits for it is still to be told why";
  EXPECT_EQ(registry.find(id)->state, State::failed);
  test.post("BAD", {}, kWait);
  ASSERT_TRUE(eventually([&] { return !registry.find("failed-1") || !registry.find(id); }));
  EXPECT_TRUE(registry.find(id));
  EXPECT_EQ(registry.counts().failed, kMostFailed);
}

/// Somebody reads it, and has it built once more, between the look at it and its removal.
TEST(Limits, AFailedOneThatIsBuiltOnceMoreStays) {
  TestService test;
  Registry& registry = test.service().registry();
  Dataset dataset;
  dataset.id = "woken";
  dataset.state = State::failed;
  ASSERT_TRUE(registry.add(dataset));
  registry.set_state("woken", State::queued, std::nullopt);
  EXPECT_FALSE(registry.remove_failed("woken"));
  ASSERT_TRUE(registry.find("woken"));
  EXPECT_EQ(registry.find("woken")->state, State::queued);
  EXPECT_TRUE(Registry::read_only(test.service().layout().registry().string())->find("woken"));
  registry.set_state("woken", State::failed, std::nullopt);
  EXPECT_TRUE(registry.remove_failed("woken"));
  EXPECT_FALSE(registry.find("woken"));
  EXPECT_FALSE(Registry::read_only(test.service().layout().registry().string())->find("woken"));
  EXPECT_FALSE(registry.remove_failed("woken")) << "there is none";
}

TEST(Limits, ShareOfTheDisk) {
  Settings settings;
  settings.serve.limits.free_percent = 100;
  TestService test(settings);
  const Response refused = test.post("GOOD");
  EXPECT_EQ(refused.status, 507);
  EXPECT_EQ(slug_of(refused), "storage-full");
  EXPECT_EQ(test.leftovers(), 0u);
  EXPECT_EQ(body_of(test.get("/readyz"))["reasons"], Json::array({"disk-full"}));
  EXPECT_EQ(limits::room({1000, 300}, 20), 100u);
  EXPECT_EQ(limits::room({1000, 200}, 20), 0u);
  EXPECT_EQ(limits::room({1000, 100}, 20), 0u);
}

TEST(Limits, ABodyThatDoesNotFitIsRefusedBeforeItComes) {
  TestService test;
  const auto disk = limits::disk_space(test.data());
  ASSERT_TRUE(disk);
  EXPECT_EQ(test.service().admission().enter("a", disk->free).problem().type, "storage-full");
  EXPECT_TRUE(test.service().admission().enter("a", 1000));
}

TEST(Limits, AFolderThatCannotBeWrittenIsNotReady) {
  TestService test;
  EXPECT_EQ(test.get("/readyz").status, 200);
  std::filesystem::remove_all(test.data() / "incoming");  // root writes anywhere: what is gone nobody can write
  const Response ready = test.get("/readyz");
  EXPECT_EQ(ready.status, 503);
  EXPECT_EQ(slug_of(ready), "not-ready");
  EXPECT_EQ(body_of(ready)["reasons"], Json::array({"data-not-writable"}));
  EXPECT_THAT(ready.body, testing::Not(testing::HasSubstr(test.data().string())));
  EXPECT_FALSE(ready.header("Retry-After").empty());
}

TEST(Limits, AServiceThatStopsSaysSo) {
  TestService test;
  test.service().stop();
  const Response ready = test.get("/readyz");
  EXPECT_EQ(ready.status, 503);
  EXPECT_EQ(slug_of(ready), "service-stopping");
  EXPECT_EQ(body_of(ready)["reasons"], Json::array({"stopping"}));
}

TEST(Limits, AreShownAsTheyAre) {
  Settings settings;
  settings.serve.limits.queue = 7;
  TestService test(settings);
  const Json shown = body_of(test.get("/v1/limits"));
  EXPECT_EQ(shown["limits"]["max_queue"]["value"], 7);
  for (const auto& [option, field, unit] : limit_options()) {
    const Json& one = shown["limits"][spelt(option.name, Spelling::query)];
    EXPECT_EQ(one["value"], settings.serve.limits.*field) << option.name;
    EXPECT_FALSE(std::string(one["unit"]).empty()) << option.name;
  }
  EXPECT_GE(limit_options().size(), 9U);
}

/// With as much room as it had it would only fill the disk again.
TEST(Limits, AJobWithoutRoomLeavesWhatItMadeAndWaitsForMore) {
  const TempFolder folder;
  const auto store = folder.path() / kStoreFile;
  ASSERT_TRUE(write_job(folder.path(), proto::Job()));
  int runs = 0;
  std::optional<proto::Problem> problem = proto::Problem{"storage-full", "full", "", ""};
  // A disk that keeps all of itself free has no room, before and after.
  const JobRunner runner = sparing(
      [&](const std::filesystem::path&, const ProgressSink&,
          const std::atomic<bool>&) -> proto::Result<std::optional<proto::Estimate>> {
        ++runs;
        std::ofstream(store) << "half";
        if (problem) return *problem;
        return std::optional<proto::Estimate>();
      },
      100);
  const std::atomic<bool> never{false};
  const auto type = [&] {
    const auto outcome = runner(folder.path(), nullptr, never);
    return outcome ? std::string() : outcome.problem().type;
  };
  EXPECT_EQ(type(), "storage-full");
  EXPECT_FALSE(std::filesystem::exists(store)) << "others may need less";
  for (int k = 0; k < 12; ++k) EXPECT_EQ(type(), "storage-full");
  EXPECT_EQ(runs, 1) << "it filled the disk again";
  problem.reset();
  EXPECT_EQ(type(), "") << "what it had may have been others' in part: it is tried all the same";
  EXPECT_EQ(runs, 2);
  EXPECT_TRUE(std::filesystem::exists(store));
  problem = proto::Problem{"raster-unreadable", "damaged", "", ""};
  EXPECT_EQ(type(), "raster-unreadable");
  EXPECT_TRUE(std::filesystem::exists(store)) << "what it failed for is none of the disk's";
}

/// A look at what stands at a dataset's address now, or at a list there, runs in the folder of what is served.
TEST(Limits, ALookWithoutRoomLeavesWhatIsServed) {
  const TempFolder folder;
  const auto store = folder.path() / kStoreFile;
  std::ofstream(store) << "served";
  proto::Job dry, list;
  dry.set_dry_run(true);
  list.set_list(true);
  const std::atomic<bool> never{false};
  for (const proto::Job& job : {dry, list}) {
    const JobRunner runner = sparing(
        [](const std::filesystem::path&, const ProgressSink&, const std::atomic<bool>&) -> JobOutcome {
          return proto::Problem{"storage-full", "full", "", ""};
        },
        100);
    ASSERT_TRUE(write_job(folder.path(), job));
    EXPECT_EQ(runner(folder.path(), nullptr, never).problem().type, "storage-full");
    EXPECT_TRUE(std::filesystem::exists(store)) << job.ShortDebugString();
  }
}

}  // namespace
}  // namespace cordillera::server
