// Slow, idle and greedy clients: what they may take, what they are told, and that others do not notice.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <iterator>

#include "front_fixture.h"

namespace cordillera::server {
namespace {

using std::chrono::seconds;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

TEST(FrontLimits, ASlowHeadIsToldAndLeaves) {
  front::HttpLimits limits;
  limits.head = seconds(1);
  const Front front(limits);
  RawClient slow = front.client();
  slow.say("GET /healthz HTTP/1.1\r\nHost: localhost\r\n");
  EXPECT_THAT(slow.rest(), AllOf(StartsWith("HTTP/1.1 408 "), HasSubstr("request-timeout"), HasSubstr("Connection: close")));
  EXPECT_TRUE(slow.ended());
}

TEST(FrontLimits, AnIdleConnectionIsClosedWithoutAWord) {
  front::HttpLimits limits;
  limits.idle = seconds(1);
  const Front front(limits);
  RawClient idle = front.client();
  EXPECT_EQ(idle.rest(), "");
  EXPECT_TRUE(idle.ended());
}

TEST(FrontLimits, ABodyThatStopsIsToldAndNothingIsKept) {
  front::HttpLimits limits;
  limits.stall = seconds(1);
  Front front(limits);
  RawClient slow = front.client();
  slow.say("POST /v1/datasets HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100000\r\n\r\nGOOD");
  EXPECT_THAT(slow.rest(), AllOf(StartsWith("HTTP/1.1 408 "), HasSubstr("request-timeout")));
  EXPECT_TRUE(eventually([&] { return front.test().leftovers() == 0; }));
}

TEST(FrontLimits, ABodyThatTricklesIsTold) {
  front::HttpLimits limits;
  limits.grace = seconds(1);
  limits.min_rate = 100000;
  Front front(limits);
  RawClient slow = front.client();
  slow.say("POST /v1/datasets HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100000\r\n\r\n");
  std::atomic<bool> told{false};
  std::thread trickle([&] {
    for (int i = 0; i < 3000 && !told && slow.say("GOOD"); ++i) std::this_thread::sleep_for(std::chrono::milliseconds(20));
  });
  EXPECT_TRUE(slow.until("request-timeout")) << "it never stopped for long, and was still too slow";
  told = true;
  trickle.join();
}

TEST(FrontLimits, AReaderThatStopsIsLeft) {
  front::HttpLimits limits;
  limits.stall = seconds(1);
  std::atomic<int> broken{0};
  Front front(limits, [&](const front::Served& served) { broken += served.whole ? 0 : 1; });
  std::filesystem::create_directories(front.test().folder() / "web");
  const std::size_t size = std::size_t{32} << 20;
  std::ofstream(front.test().folder() / "web" / "big.bin") << std::string(size, 'x');
  RawClient slow = front.client(4096);
  slow.say(get("/big.bin"));
  EXPECT_TRUE(eventually([&] { return broken == 1; }));
  EXPECT_LT(slow.rest().size(), size);
  // Who reads gets all; of a server that is patient with a machine on which a reader comes to nothing for a second.
  Front patient;
  std::filesystem::create_directories(patient.test().folder() / "web");
  std::filesystem::rename(front.test().folder() / "web" / "big.bin", patient.test().folder() / "web" / "big.bin");
  RawClient reader = patient.client();
  reader.say(get("/big.bin", "Connection: close\r\n"));
  EXPECT_GT(reader.rest().size(), size);
}

TEST(FrontLimits, IdleConnectionsTakeNoThreadsAndNoTime) {
  const Front front;
  RawClient reader = front.client();
  const auto ask = [&] {
    const std::size_t before = count_of(reader.seen(), "\"ok\"");
    reader.say(get("/healthz"));
    while (count_of(reader.seen(), "\"ok\"") == before)
      ASSERT_TRUE(reader.until("\"ok\"") && !reader.ended() && reader.rest(std::chrono::milliseconds(1)) != "");
  };
  ask();
  const std::size_t before = threads();
  std::vector<RawClient> idle;
  for (int i = 0; i < 500; ++i) {
    idle.push_back(front.client());
    if (i % 2 == 1) idle.back().say("GET /healthz HTTP/1.1\r\nHost: localhost\r\n");
  }
  for (int i = 0; i < 50; ++i) ask();
  EXPECT_LE(threads(), before + 1);
}

TEST(FrontLimits, EventStreamsTakeNoThreadsAndEachClientHasAFewOnly) {
  front::HttpLimits limits;
  limits.streams_per_client = 40;
  Front front(limits);
  const std::string id = body_of(front.test().post("SLOW"))["id"];
  const std::string events = get("/v1/datasets/" + id + "/events");
  std::vector<RawClient> streams;
  std::size_t before = 0;
  for (int i = 0; i < 40; ++i) {
    streams.push_back(front.client());
    streams.back().say(events);
    EXPECT_TRUE(streams.back().until("event: progress"));
    if (i == 0) before = threads();
  }
  EXPECT_LE(threads(), before + 1);
  RawClient next = front.client();
  next.say(events);
  EXPECT_TRUE(next.until("too-many-streams"));
  EXPECT_THAT(next.seen(), AllOf(StartsWith("HTTP/1.1 429 "), HasSubstr("Retry-After: ")));
  EXPECT_EQ(count_of(next.seen(), "Retry-After: "), 1u);
  EXPECT_THAT(next.seen(), testing::ContainsRegex("Access-Control-Expose-Headers: [^\r]*Retry-After"))
      << "to pages of other origins";
  streams.front().close();
  EXPECT_TRUE(eventually([&] {  // the server hears of it when it writes
    front.test().service().hub().touch(id);
    RawClient again = front.client();
    again.say(get("/v1/datasets/" + id + "/events", "Connection: close\r\n"));
    return again.until("event: ");
  }));
  front.test().send("DELETE", "/v1/datasets/" + id);
  EXPECT_THAT(streams.back().until("event: failed"), true) << "a stream is told at once";
}

TEST(FrontLimits, AnAddressHasItsShareOfConnections) {
  front::HttpLimits limits;
  limits.connections_per_client = 3;
  const Front front(limits);
  std::vector<RawClient> held;
  for (int i = 0; i < 3; ++i) {
    held.push_back(front.client());
    held.back().say(get("/healthz"));
    EXPECT_TRUE(held.back().until("\"ok\""));
  }
  EXPECT_THAT(front.client().rest(),
              AllOf(StartsWith("HTTP/1.1 429 "), HasSubstr("too-many-connections"), HasSubstr("Retry-After: ")));
  held.front().close();
  EXPECT_TRUE(eventually([&] {
    RawClient again = front.client();
    again.say(get("/healthz", "Connection: close\r\n"));
    return count_of(again.rest(), "\"ok\"") == 1;
  }));
}

TEST(FrontLimits, ATrustedProxyMayHaveTheConnectionsOfAllItsClients) {
  front::HttpLimits limits;
  limits.connections_per_client = 3;
  limits.trusted_proxies = {"127.0.0.1"};
  const Front front(limits);
  std::vector<RawClient> held;
  for (int i = 0; i < 6; ++i) {
    held.push_back(front.client());
    held.back().say(get("/healthz"));
    EXPECT_TRUE(held.back().until("\"ok\"")) << i;
  }
}

std::size_t descriptors() {
  return static_cast<std::size_t>(
      std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator()));
}

TEST(FrontLimits, RefusedConnectionsTakeFewDescriptorsToo) {
  front::HttpLimits limits;
  limits.loops = 4;
  limits.connections = 20;
  limits.connections_per_client = 3;
  const Front front(limits);
  const std::size_t before = descriptors();
  std::vector<RawClient> held;
  for (int i = 0; i < 60; ++i) held.push_back(front.client());
  held.back().say(get("/healthz"));
  EXPECT_TRUE(held.back().until("HTTP/1.1 ")) << "it came last, so all others have been looked at";
  EXPECT_LE(descriptors(), before + held.size() + 30) << "20, and a few that are told why they are refused";
}

TEST(FrontLimits, WhereAllPlacesAreTakenTheLongestIdleMakesRoom) {
  front::HttpLimits limits;
  limits.connections = 20;
  const Front front(limits);
  std::vector<RawClient> idle;
  for (int i = 0; i < 60; ++i) {
    idle.push_back(front.client());
    idle.back().say(get("/healthz"));
    EXPECT_TRUE(idle.back().until("\"ok\"")) << i << idle.back().seen();
  }
  idle.front().rest();
  EXPECT_TRUE(idle.front().ended());
}

TEST(FrontLimits, BodiesOfOneAddressAreBounded) {
  front::HttpLimits limits;
  limits.uploads_per_client = 4;
  Front front(limits);
  std::vector<RawClient> held;
  const std::string half = "POST /v1/datasets HTTP/1.1\r\nHost: localhost\r\nContent-Length: 100\r\n\r\nGOOD";
  for (std::size_t i = 0; i < 4; ++i) {
    held.push_back(front.client());
    held.back().say(half);
    EXPECT_TRUE(eventually([&] { return front.test().leftovers() >= 2 * (i + 1); }));
  }
  EXPECT_THAT(front.answer(half), AllOf(StartsWith("HTTP/1.1 429 "), HasSubstr("too-many-uploads"), HasSubstr("Retry-After: ")));
  EXPECT_THAT(front.answer(get("/healthz", "Connection: close\r\n")), HasSubstr("\"ok\"")) << "readers do not notice";
}

TEST(FrontLimits, AnswersUnderWayGoOutWhenTheServerStops) {
  Front front;
  std::filesystem::create_directories(front.test().folder() / "web");
  const std::size_t size = std::size_t{32} << 20;
  std::ofstream(front.test().folder() / "web" / "big.bin") << std::string(size, 'x');
  RawClient reader = front.client(65536), waiting = front.client();
  reader.say(get("/big.bin"));
  EXPECT_TRUE(reader.until("xxxx"));
  waiting.say("POST /v1/datasets HTTP/1.1\r\nHost: localhost\r\nPrefer: wait=600\r\nContent-Length: 4\r\n\r\nSLOW");
  EXPECT_TRUE(eventually([&] { return !front.test().service().registry().list().empty(); }));
  std::thread stopper([&] { front.stop(); });
  EXPECT_GT(reader.rest().size(), size);
  EXPECT_THAT(waiting.rest(), AllOf(StartsWith("HTTP/1.1 202 "), HasSubstr("Location: ")))
      << "it is accepted, and goes on at the next start";
  stopper.join();
}

}  // namespace
}  // namespace cordillera::server
