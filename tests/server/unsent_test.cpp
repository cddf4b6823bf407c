// What answers take of the memory: shared bytes, a budget for large ones, readers that are too slow, and what is forgotten with a
// dataset.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <sys/resource.h>
#include <unistd.h>

#include <fstream>

#include "front_fixture.h"
#include "pipeline/store/content_hash.h"
#include "pipeline/store/sqlite.h"
#include "server/front/answer_budget.h"
#include "server/front/content_coding.h"
#include "server/front/pace.h"
#include "server/front/shared.h"
#include "server/limits/descriptors.h"
#include "server/memory/heap.h"

namespace cordillera::server {
namespace {

using front::AnswerBudget;
using std::chrono::seconds;
using testing::HasSubstr;
using testing::StartsWith;

AnswerBudget::Bytes bytes_of(std::size_t size) { return std::make_shared<const std::string>(size, 'x'); }

std::string ready_dataset(TestService& test) { return body_of(test.post("GOOD", {}, {{"prefer", "wait=60"}}))["id"]; }

Request asking(const std::string& path, const std::map<std::string, std::string>& headers = {}) {
  Request request;
  request.path = path;
  request.headers = headers;
  return request;
}

TEST(AnswerBudget, SharedBytesCountOnceAndGoWithTheLastHolder) {
  AnswerBudget budget(100, 60);
  const auto shared = bytes_of(40);
  auto a = budget.take("a", shared), again = budget.take("a", shared), b = budget.take("b", shared);
  EXPECT_EQ(budget.all(), 40u);
  EXPECT_EQ(budget.take("a", bytes_of(30)), nullptr) << "70 of 60";
  auto other = budget.take("b", bytes_of(20));
  EXPECT_EQ(budget.all(), 60u);
  EXPECT_TRUE(budget.full("b"));
  EXPECT_FALSE(budget.full("a"));
  a = again = nullptr;
  EXPECT_EQ(budget.all(), 60u);
  b = other = nullptr;
  EXPECT_EQ(budget.all(), 0u);
}

TEST(AnswerBudget, AllTogetherHaveABoundToo) {
  AnswerBudget budget(100, 60);
  const auto a = budget.take("a", bytes_of(60)), b = budget.take("b", bytes_of(30));
  EXPECT_EQ(budget.take("c", bytes_of(20)), nullptr);
  EXPECT_NE(budget.take("c", bytes_of(10)), nullptr);
}

TEST(AnswerBudget, WhatIsLargerThanItIsLetInAlone) {
  AnswerBudget budget(100, 60);
  const auto a = budget.take("a", bytes_of(500));
  EXPECT_NE(a, nullptr);
  EXPECT_EQ(budget.take("a", bytes_of(1)), nullptr);
}

TEST(Pace, ALargeAnswerHasToBeReadFaster) {
  front::HttpLimits limits;
  limits.min_rate = 1000;
  limits.answer = seconds(600);
  const front::Clock::time_point start{};
  const auto too_slow = [&](std::uint64_t whole) {
    front::Pace pace(limits);
    pace.start(whole);
    pace.wait(start);
    pace.moved(40000, start + seconds(19));
    pace.wait(start + seconds(19));
    return pace.too_slow(start + seconds(20));
  };
  EXPECT_FALSE(too_slow(0)) << "2 kB/s of an answer whose end is not known";
  EXPECT_FALSE(too_slow(600000));
  EXPECT_TRUE(too_slow(6000000)) << "it would take fifty minutes";
}

TEST(Descriptors, EverythingFitsIntoFewOfThem) {
  const Limits most;
  for (const std::size_t descriptors : {64, 256, 1024, 4096}) {
    ServeSettings settings;
    settings.limits.loops = 16;  // of a large machine: each takes four
    EXPECT_THAT(limits::fit_to_descriptors(settings, descriptors), HasSubstr(" " + std::to_string(descriptors) + " descriptors"));
    const Limits& now = settings.limits;
    EXPECT_LE(now.connections + limits::refused_sockets(now.connections) + now.uploads + 4 * now.open_datasets, descriptors);
    for (const std::uint32_t limit : {now.connections, now.client_connections, now.uploads, now.open_datasets})
      EXPECT_GE(limit, 1u) << descriptors;
    EXPECT_GE(now.connections, descriptors / 8);
    EXPECT_GE(now.loops, 2u);
    EXPECT_LT(now.connections, most.connections);
    EXPECT_LT(now.client_connections, now.connections) << "nobody takes all";
    EXPECT_LE(now.client_uploads, std::max(1u, now.uploads / 2)) << "nor all uploads";
    EXPECT_GE(now.client_uploads, 1u);
  }
  ServeSettings settings;
  EXPECT_EQ(limits::fit_to_descriptors(settings, 1 << 20), "");
  EXPECT_EQ(settings.limits.connections, most.connections);
}

/// 0: what is asked for when hardly any memory is left is refused before it is begun, and answered when there is some again.
int refused_before_it_is_begun() {
  TestService test;
  front::Shared shared(test.api(), front::HttpLimits{}, [](const front::Served&) {});
  const Request request = asking("/healthz");
  rlimit before{};
  getrlimit(RLIMIT_AS, &before);
  std::ifstream statm("/proc/self/statm");
  rlim_t pages = 0;
  statm >> pages;
  // A hard limit cannot be raised again.
  const rlimit little{pages * static_cast<rlim_t>(sysconf(_SC_PAGESIZE)) + (rlim_t{2} << 20), before.rlim_max};
  setrlimit(RLIMIT_AS, &little);
  set_up_heap();
  std::vector<void*> taken;  // a thread's heap may have had much more
  Response refused;
  for (int round = 0; round < 64 && refused.status != 503; ++round) {  // a thread that ends meanwhile gives its stack back
    while (void* const block = std::malloc(std::size_t{1} << 20)) taken.push_back(block);
    refused = front::answer_of(shared, request, parse_route(request.path));
  }
  for (void* const block : taken) std::free(block);
  setrlimit(RLIMIT_AS, &before);
  const Response answered = front::answer_of(shared, request, parse_route(request.path));
  if (refused.status != 503 || refused.body.find("service-busy") == std::string::npos) return 1;
  return answered.status == 200 ? 0 : 2;
}

TEST(Answers, NothingIsBegunWithHardlyAnyMemory) {
  if (kSanitized) GTEST_SKIP() << "a sanitizer's addresses cannot be counted";
  GTEST_FLAG_SET(death_test_style, "threadsafe");
  EXPECT_EXIT(_exit(refused_before_it_is_begun()), testing::ExitedWithCode(0), "");
}

TEST(Answers, TilesAndFilesOfTheViewerAreSharedByAllWhoReadThem) {
  TestService test;
  const std::string id = ready_dataset(test);
  std::filesystem::create_directories(test.folder() / "web");
  std::ofstream(test.folder() / "web" / "a.bin") << "some bytes";
  for (const std::string& path : {"/v1/datasets/" + id + "/tiles/0/0/0.drc", std::string("/a.bin")}) {
    // The end of its build may close the dataset's store once more.
    EXPECT_TRUE(eventually([&] {
      const Response first = test.api().handle(asking(path)), second = test.api().handle(asking(path));
      return first.shared != nullptr && first.shared == second.shared;
    })) << path;
  }
  std::ofstream(test.folder() / "web" / "a.bin") << "other bytes!";
  EXPECT_EQ(test.get("/a.bin").body, "other bytes!") << "a file that was replaced";
}

TEST(Answers, ATileThatTheClientHasIsNotRead) {
  TestService test;
  const std::string id = ready_dataset(test), path = "/v1/datasets/" + id + "/tiles/0/0/0.drc";
  // Without a journal beside the store: what is left of the build is removed at this moment.
  pipeline::Database(test.service().layout().store(id).string(), pipeline::Database::Mode::create)
      .execute("PRAGMA journal_mode=MEMORY; DELETE FROM blobs");
  const std::string tag = quoted(pipeline::hex(pipeline::content_hash("drc of 0")));
  const Response same = test.get(path, {{"if-none-match", tag}});
  EXPECT_EQ(same.status, 304);
  EXPECT_EQ(same.header("ETag"), tag);
  EXPECT_NE(test.get(path, {{"if-none-match", "\"another\""}}).status, 304);
  EXPECT_NE(test.get(path).status, 200) << "there is nothing to read";
}

TEST(Answers, WhatWasCompressedOfADatasetGoesWithIt) {
  TestService test;
  const std::string path = "/v1/datasets/" + ready_dataset(test);
  front::ContentCoder coder;
  const auto compressed = [&] {
    const Request request = asking(path + "/manifest.json", {{"accept-encoding", "gzip"}});
    Response response = test.api().handle(request);
    coder.encode(request, response);
    EXPECT_EQ(response.header("Content-Encoding"), "gzip");
    return response.shared;
  };
  // "ready" is told a moment before what was kept of the unfinished dataset is forgotten.
  EXPECT_TRUE(eventually([&] {
    const auto once = compressed();
    return compressed() == once;
  })) << "compressed once";
  const std::weak_ptr<const std::string> kept = compressed();
  ASSERT_EQ(test.send("DELETE", path).status, 204);
  EXPECT_TRUE(kept.expired());
}

TEST(Answers, LargeOnesThatAreNotReadAreBounded) {
  front::HttpLimits limits;
  limits.unsent_per_client = std::uint64_t{20} << 20;
  Front front(limits);
  const auto web = front.test().folder() / "web";
  std::filesystem::create_directories(web);
  for (const char* name : {"a.bin", "b.bin"}) std::ofstream(web / name) << std::string(std::size_t{16} << 20, *name);
  std::vector<RawClient> slow;
  for (int i = 0; i < 5; ++i) {
    slow.push_back(front.client(4096));
    slow.back().say(get("/a.bin"));
    EXPECT_TRUE(slow.back().until("\r\n\r\n"));
    EXPECT_THAT(slow.back().seen(), StartsWith("HTTP/1.1 200 ")) << "the same bytes count once";
  }
  RawClient next = front.client();
  next.say(get("/b.bin", "Connection: close\r\n"));
  EXPECT_THAT(next.rest(), AllOf(StartsWith("HTTP/1.1 503 "), HasSubstr("Retry-After: "), HasSubstr("service-busy")));
  slow.clear();
  EXPECT_TRUE(eventually([&] {
    RawClient again = front.client();
    again.say(get("/b.bin", "Connection: close\r\n"));
    return again.rest().starts_with("HTTP/1.1 200 ");
  }));
}

}  // namespace
}  // namespace cordillera::server
