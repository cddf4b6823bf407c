// Real sockets: curl as a user types it, a client library, and a raw connection that breaks off.
#include "server/front/http_server.h"

#include <arpa/inet.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <httplib.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "fixture.h"

namespace cordillera::server {
namespace {

using front::HttpServer;
using testing::HasSubstr;

class Http : public testing::Test {
 protected:
  void SetUp() override {
    auto bound = HttpServer::bind(test_.api(), "127.0.0.1:0");
    ASSERT_TRUE(bound) << bound.problem().line();
    http_ = std::move(bound.value());
    thread_ = std::thread([this] { http_->run(); });
    base_ = "http://127.0.0.1:" + std::to_string(http_->port());
  }
  void TearDown() override {
    test_.service().stop();
    http_->stop();
    thread_.join();
  }

  /// Output of `curl -s ARGUMENTS`, which may use $U for the server's address.
  std::string curl(const std::string& arguments) {
    const std::string command =
        "cd '" + test_.folder().string() + "' && U=" + base_ + " && curl -q -s -m 300 " + arguments + " 2>&1";
    FILE* pipe = popen(command.c_str(), "r");
    std::string output;
    char bytes[4096];
    for (std::size_t count = 0; (count = fread(bytes, 1, sizeof bytes, pipe)) > 0;) output.append(bytes, count);
    pclose(pipe);
    return output;
  }
  std::string ready_dataset() {
    const Json json = Json::parse(curl("-H 'Prefer: wait=200' --data-binary GOOD $U/v1/datasets?name=a.tif"));
    EXPECT_EQ(json["state"], "ready") << json.dump();
    return json["id"];
  }
  void write(const std::string& name, const std::string& bytes) {
    std::ofstream(test_.folder() / name, std::ios::binary) << bytes;
  }

  int connected() {
    const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(http_->port()));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(connect(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    return descriptor;
  }

  TestService test_;
  std::unique_ptr<HttpServer> http_;
  std::thread thread_;
  std::string base_;
};

TEST_F(Http, CurlPostsAFileAndGetsTiles) {
  write("dem.tif", "GOOD" + std::string(3 << 20, 'x'));  // large enough for curl to say Expect: 100-continue
  const std::string posted =
      curl("-D - -H 'Prefer: wait=200' --data-binary @dem.tif \"$U/v1/datasets?name=My%20dem.tif&error=2.5\"");
  EXPECT_THAT(posted, HasSubstr("HTTP/1.1 100 Continue"));
  EXPECT_THAT(posted, HasSubstr("HTTP/1.1 201 Created"));
  EXPECT_THAT(posted, HasSubstr("Location: /v1/datasets/my-dem-"));
  const Json list = Json::parse(curl("$U/v1/datasets"))["datasets"];
  ASSERT_EQ(list.size(), 1u);
  const std::string base = "$U/v1/datasets/" + std::string(list[0]["id"]);
  EXPECT_EQ(curl(base + "/tiles/1/1/1.drc"), "drc of 1");
  EXPECT_EQ(curl(base + "/tiles/W/0/0/0.glb"), "glb of 0");
  EXPECT_EQ(curl("-H 'Range: bytes=2-3' " + base + "/tiles/1/1/1.drc"), "drc of 1") << "a range is answered with the whole";
}

TEST_F(Http, ChunkedUploads) {
  write("dem.tif", "GOOD" + std::string(200000, 'x'));
  EXPECT_EQ(curl("-o /dev/null -w '%{http_code}' -H 'Transfer-Encoding: chunked' -H 'Prefer: wait=200' --data-binary @dem.tif "
                 "$U/v1/datasets"),
            "201");
  EXPECT_EQ(curl("-o /dev/null -w '%{http_code}' -X POST -H 'Prefer: wait=200' -T - $U/v1/datasets < dem.tif"), "201");
}

TEST_F(Http, HeadAndConditionalGet) {
  const std::string tile = "$U/v1/datasets/" + ready_dataset() + "/tiles/1/1/1.drc";
  const std::string head = curl("-I " + tile);
  EXPECT_THAT(head, HasSubstr("HTTP/1.1 200 OK"));
  EXPECT_THAT(head, HasSubstr("Content-Length: 8"));
  EXPECT_THAT(head, HasSubstr("Access-Control-Allow-Origin: *"));
  EXPECT_THAT(head, HasSubstr("Accept-Ranges: none")) << "a range is answered with the whole";
  EXPECT_THAT(head, testing::Not(HasSubstr("bytes")));
  const auto start = head.find("ETag: ") + 6;
  const std::string etag = head.substr(start, head.find('\r', start) - start);
  EXPECT_EQ(curl("-o /dev/null -w '%{http_code}' -H 'If-None-Match: " + etag + "' " + tile), "304");
  EXPECT_EQ(curl("-o /dev/null -w '%{http_code}' -H 'If-None-Match: \"x\"' " + tile), "200");
  EXPECT_THAT(curl("-D - -X OPTIONS -H 'Origin: http://x' -H 'Access-Control-Request-Method: GET' " + tile), HasSubstr("204"));
}

TEST_F(Http, CompressedAndPlainAnswersAreTwoRepresentations) {
  const std::string manifest = "$U/v1/datasets/" + ready_dataset() + "/manifest.json";
  const auto header = [](const std::string& head, const std::string& name) {
    const auto start = head.find(name + ": ");
    return start == std::string::npos ? ""
                                      : head.substr(start + name.size() + 2, head.find('\r', start) - start - name.size() - 2);
  };
  for (const char* encoding : {"identity", "gzip", "br"}) {
    const std::string ask = std::string("-H 'Accept-Encoding: ") + encoding + "' ";
    const std::string head = curl("-D - -o /dev/null " + ask + manifest);
    EXPECT_EQ(header(head, "Content-Encoding"), encoding == std::string("identity") ? "" : encoding);
    EXPECT_EQ(header(head, "Vary"), "Accept-Encoding") << head;
    const std::string etag = header(head, "ETag");
    EXPECT_EQ(etag.substr(0, 2), "W/") << "a strong tag would say that the bytes are the same";
    EXPECT_EQ(curl("-o /dev/null -w '%{http_code}' " + ask + "-H 'If-None-Match: " + etag + "' " + manifest), "304");
  }
}

/// A guard must name bytes, and each coding has others.
TEST_F(Http, AStatusHasAStrongTagInEachCoding) {
  const std::string status = "$U/v1/datasets/" + ready_dataset(), title = " -X PATCH --data-urlencode title=";
  for (const char* encoding : {"identity", "gzip", "br"}) {
    const std::string ask = std::string("-H 'Accept-Encoding: ") + encoding + "' ";
    const std::string head = curl("-D - -o /dev/null " + ask + status);
    const auto start = head.find("ETag: ") + 6;
    const std::string tag = head.substr(start, head.find('\r', start) - start);
    EXPECT_TRUE(tag.starts_with('"')) << head;
    EXPECT_EQ(tag.ends_with(std::string("-") + encoding + "\""), encoding != std::string("identity")) << tag;
    const std::string again = curl("-D - " + ask + "-H 'If-None-Match: " + tag + "' " + status);
    EXPECT_THAT(again, testing::AllOf(HasSubstr("304"), HasSubstr("ETag: " + tag)));
    const std::string changed = "-o /dev/null -w '%{http_code}' -H 'If-Match: " + tag + "'" + title + encoding + " " + status;
    EXPECT_EQ(curl(changed), "200");
    EXPECT_EQ(curl(changed), "412") << "it is another by now";
  }
}

/// RFC 9110, 14.2: what cannot be read of it, and what has no parts, comes as a whole.
TEST_F(Http, ARangeThatIsNoneIsIgnored) {
  const std::string base = "$U/v1/datasets/" + ready_dataset();
  for (const char* range : {"bytes=abc", "bytes=0-0,", "bytes= 0-9", "bytes=", "tiles=1"}) {
    const std::string ask = std::string("-o /dev/null -w '%{http_code}' -H 'Range: ") + range + "' ";
    EXPECT_EQ(curl(ask + "$U/v1"), "200") << range;
    EXPECT_EQ(curl(ask + base + "/tileset.json"), "200") << range;
    EXPECT_EQ(curl(ask + "--json '{\"x\": 1}' " + base + "/elevation"), "400") << range << ": of the body, not of the range";
  }
}

TEST_F(Http, Deleting) {
  const std::string id = ready_dataset();
  EXPECT_EQ(curl("-o /dev/null -w '%{http_code}' -X DELETE $U/v1/datasets/" + id), "204");
  EXPECT_EQ(curl("-o /dev/null -w '%{http_code}' $U/v1/datasets/" + id), "404");
}

TEST_F(Http, IdempotencyKeys) {
  const std::string post = "-H 'Idempotency-Key: abc' -H 'Prefer: wait=200' --data-binary GOOD $U/v1/datasets";
  const Json first = Json::parse(curl(post)), again = Json::parse(curl(post));
  EXPECT_EQ(first["id"], again["id"]);
  EXPECT_EQ(curl("-o /dev/null -w '%{http_code}' " + post + "?error=1"), "422");
}

TEST_F(Http, RefusalsAreProblems) {
  EXPECT_THAT(curl("-D - --data-binary GOOD $U/v1/datasets?eror=1"), HasSubstr("application/problem+json"));
  EXPECT_THAT(curl("-F file=@/dev/null $U/v1/datasets"), HasSubstr("the file of the form is empty"));
  EXPECT_THAT(curl("-X POST $U/v1/datasets"), HasSubstr("body-empty"));
  EXPECT_THAT(curl("-X PATCH -d x $U/v1/datasets"), HasSubstr("method-not-allowed"));
  EXPECT_THAT(curl("-X BREW $U/v1/datasets"), HasSubstr("method-unknown"));
  EXPECT_THAT(curl("$U/v1/nothing"), HasSubstr("not-found"));
  EXPECT_THAT(curl("-X DELETE $U/v1/datasets/nobody"), HasSubstr("dataset-unknown"));
  EXPECT_THAT(curl("$U/" + std::string(9000, 'a')), HasSubstr("uri-too-long"));
}

TEST_F(Http, ARefusedLargeBodyIsNotAskedFor) {
  write("dem.tif", std::string(3 << 20, 'x'));
  const std::string answer =
      curl("-D - --expect100-timeout 200 -w 'sent %{size_upload}' --data-binary @dem.tif $U/v1/datasets?error=x");
  EXPECT_THAT(answer, HasSubstr("HTTP/1.1 400"));
  EXPECT_THAT(answer, HasSubstr("sent 0"));
  EXPECT_THAT(curl("-H 'Expect:' --data-binary @dem.tif $U/v1/datasets?error=x"), HasSubstr("option-invalid"));
  write("huge.tif", "");
  std::filesystem::resize_file(test_.folder() / "huge.tif", std::uintmax_t{1} << 28);
  EXPECT_THAT(curl("-o /dev/null -w '%{http_code}' -H 'Expect:' --data-binary @huge.tif $U/v1/datasets?error=x"),
              HasSubstr("400"));
}

TEST_F(Http, HalfAnUploadLeavesNothing) {
  for (const std::string head : {"Content-Length: 1000000\r\n\r\n", "Transfer-Encoding: chunked\r\n\r\n10000\r\n"}) {
    const int descriptor = connected();
    const std::string bytes = "POST /v1/datasets?name=half.tif HTTP/1.1\r\nHost: localhost\r\n" + head + std::string(5000, 'x');
    ASSERT_EQ(::write(descriptor, bytes.data(), bytes.size()), static_cast<ssize_t>(bytes.size()));
    EXPECT_TRUE(eventually([&] { return test_.leftovers() > 0; })) << "the upload should be under way";
    EXPECT_TRUE(Json::parse(curl("$U/v1/datasets"))["datasets"].empty()) << "and nobody sees it";
    close(descriptor);
    EXPECT_TRUE(eventually([&] { return test_.leftovers() == 0; }));
  }
  EXPECT_TRUE(Json::parse(curl("$U/v1/datasets"))["datasets"].empty());
}

TEST_F(Http, EventsArriveWhileTheBuildRuns) {
  const std::string id = Json::parse(curl("--data-binary SLOW $U/v1/datasets"))["id"];
  httplib::Client client("127.0.0.1", http_->port());
  client.set_read_timeout(300);
  std::string seen;
  client.Get("/v1/datasets/" + id + "/events", [&](const char* bytes, std::size_t count) {
    seen.append(bytes, count);
    if (seen.find("\"stage\":\"build\"") != std::string::npos) test_.send("DELETE", "/v1/datasets/" + id);
    return true;
  });
  EXPECT_THAT(seen, HasSubstr("event: progress"));
  EXPECT_THAT(seen, HasSubstr("event: failed"));
}

TEST_F(Http, OneConnectionServesManyRequests) {
  const std::string path = "/v1/datasets/" + ready_dataset() + "/tiles/1/1/1.drc";
  httplib::Client client("127.0.0.1", http_->port());
  client.set_read_timeout(300);
  client.set_keep_alive(true);
  for (int i = 0; i < 200; ++i) {
    const auto answer = client.Get(path);
    ASSERT_TRUE(answer && answer->status == 200) << i;
  }
}

TEST_F(Http, ManySlowClientsKeepNobodyWaiting) {
  std::vector<int> slow;
  const std::string half = "GET /healthz HTTP/1.1\r\nHost: a\r\n";
  for (int i = 0; i < 200; ++i) {
    slow.push_back(connected());
    ASSERT_EQ(send(slow.back(), half.data(), half.size(), 0), static_cast<ssize_t>(half.size()));
  }
  EXPECT_THAT(curl("-m 50 $U/healthz"), HasSubstr("ok")) << "the server would have waited 60 s for any of them";
  for (const int descriptor : slow) close(descriptor);
}

TEST(Listening, TwoServersDoNotShareAPort) {
  TestService test;
  const auto first = HttpServer::bind(test.api(), "127.0.0.1:0");
  ASSERT_TRUE(first);
  const auto second = HttpServer::bind(test.api(), "127.0.0.1:" + std::to_string((*first)->port()));
  ASSERT_FALSE(second) << "each would get some of the requests";
  EXPECT_EQ(second.problem().type, "listen-failed");
  EXPECT_THAT(second.problem().detail, HasSubstr("another program listens there"));
}

TEST(Listening, AStopThatComesBeforeTheRunIsNotLost) {
  TestService test;
  const auto http = HttpServer::bind(test.api(), "127.0.0.1:0");
  ASSERT_TRUE(http);
  (*http)->stop();
  (*http)->run();  // returns
}

TEST(Listening, OnATakenPortIsAProblem) {
  TestService test;
  auto first = HttpServer::bind(test.api(), "127.0.0.1:0");
  ASSERT_TRUE(first);
  const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  ASSERT_EQ(bind(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
  ASSERT_EQ(listen(descriptor, 1), 0);
  socklen_t size = sizeof address;
  getsockname(descriptor, reinterpret_cast<sockaddr*>(&address), &size);
  const auto taken = HttpServer::bind(test.api(), "127.0.0.1:" + std::to_string(ntohs(address.sin_port)));
  ASSERT_FALSE(taken);
  EXPECT_EQ(taken.problem().type, "listen-failed");
  close(descriptor);
}

}  // namespace
}  // namespace cordillera::server
