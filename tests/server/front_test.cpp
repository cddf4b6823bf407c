// HTTP as it comes over the wire: what is read in one way only, and what is refused because it could be read in two.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>

#include "front_fixture.h"
#include "server/front/message/answer_head.h"
#include "server/front/workers.h"

namespace cordillera::server {
namespace {

using testing::AnyOf;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;
using namespace std::string_literals;

const std::string kPost = "POST /v1/datasets?name=a HTTP/1.1\r\nHost: localhost\r\n";
/// A request that must never be answered: it stands in the body of another one.
const std::string kHidden = "GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: hidden\r\n\r\n";

TEST(Front, PipelinedRequestsAreAnsweredInOrder) {
  const Front front;
  std::string asked, expected;
  for (int i = 0; i < 300; ++i)
    asked += i % 3 == 0 ? get("/healthz") : i % 3 == 1 ? get("/v1/datasets") : get("/nothing/" + std::to_string(i));
  const std::string seen = front.answer(asked + get("/healthz", "Connection: close\r\n"));
  EXPECT_EQ(count_of(seen, "HTTP/1.1 200 OK"), 201u);
  EXPECT_EQ(count_of(seen, "HTTP/1.1 404 Not Found"), 100u);
  std::size_t at = 0;
  for (int i = 2; i < 300; i += 3) {
    const auto found = seen.find("/nothing/" + std::to_string(i), at);
    ASSERT_NE(found, std::string::npos) << i;
    at = found;
  }
}

TEST(Front, ARequestInPiecesIsOne) {
  const Front front;
  RawClient client = front.client();
  const std::string bytes = "\r\n"s.append(get("/healthz", "Connection: close\r\n"));
  for (const char c : bytes) client.say(std::string(1, c));
  EXPECT_THAT(client.rest(), AllOf(StartsWith("HTTP/1.1 200 OK"), HasSubstr("\r\nDate: ")));
}

struct Row {
  const char* what;
  std::string bytes;
};

TEST(Front, WhatCouldBeReadInTwoWaysIsRefusedAndEndsTheConnection) {
  const Front front;
  const Row rows[] = {
      {"two lengths", kPost + "Content-Length: 4\r\nContent-Length: 50\r\n\r\nGOOD"},
      {"two equal lengths", kPost + "Content-Length: 4\r\nContent-Length: 4\r\n\r\nGOOD"},
      {"a list of lengths", kPost + "Content-Length: 4, 4\r\n\r\nGOOD"},
      {"a length with a sign", kPost + "Content-Length: +4\r\n\r\nGOOD"},
      {"a negative length", kPost + "Content-Length: -4\r\n\r\nGOOD"},
      {"a hexadecimal length", kPost + "Content-Length: 0x4\r\n\r\nGOOD"},
      {"an empty length", kPost + "Content-Length:\r\n\r\n"},
      {"a length beyond 64 bits", kPost + "Content-Length: 99999999999999999999\r\n\r\nGOOD"},
      {"a length beside chunks", kPost + "Content-Length: 4\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"},
      {"chunks beside a length", kPost + "Transfer-Encoding: chunked\r\nContent-Length: 4\r\n\r\n0\r\n\r\n"},
      {"chunked twice", kPost + "Transfer-Encoding: chunked, chunked\r\n\r\n0\r\n\r\n"},
      {"chunked in two headers", kPost + "Transfer-Encoding: chunked\r\nTransfer-Encoding: identity\r\n\r\n0\r\n\r\n"},
      {"another coding", kPost + "Transfer-Encoding: gzip\r\n\r\n0\r\n\r\n"},
      {"a coding misspelt", kPost + "Transfer-Encoding: xchunked\r\n\r\n0\r\n\r\n"},
      {"a coding with a tab in it", kPost + "Transfer-Encoding: \vchunked\r\n\r\n0\r\n\r\n"},
      {"chunks in HTTP/1.0", "POST /v1/datasets HTTP/1.0\r\nHost: localhost\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\n"},
      {"a folded header", "GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: b\r\n c\r\n\r\n"},
      {"a header that begins with a blank", "GET /healthz HTTP/1.1\r\n Host: localhost\r\n\r\n"},
      {"a blank before the colon", kPost + "Content-Length : 4\r\n\r\nGOOD"},
      {"a header without a name", "GET /healthz HTTP/1.1\r\nHost: localhost\r\n: b\r\n\r\n"},
      {"a header without a colon", "GET /healthz HTTP/1.1\r\nHost: localhost\r\nchunked\r\n\r\n"},
      {"bare line feeds", "GET /healthz HTTP/1.1\nHost: a\n\n"},
      {"one bare line feed", "GET /healthz HTTP/1.1\r\nHost: a\nX: b\r\n\r\n"},
      {"a bare carriage return", "GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: b\rTransfer-Encoding: chunked\r\n\r\n"},
      {"a NUL in a header", "GET /healthz HTTP/1.1\r\nHost: localhost\r\nX: b\0c\r\n\r\n"s},
      {"a NUL in the address", "GET /healthz%00 HTTP/1.1\r\nHost: localhost\r\n\r\n"},
      {"a raw NUL in the address", "GET /health\0z HTTP/1.1\r\nHost: localhost\r\n\r\n"s},
      {"no host", "GET /healthz HTTP/1.1\r\n\r\n"},
      {"two hosts", "GET /healthz HTTP/1.1\r\nHost: localhost\r\nHost: localhost\r\n\r\n"},
      {"two blanks", "GET  /healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"},
      {"a blank in the address", "GET /healthz /v1 HTTP/1.1\r\nHost: localhost\r\n\r\n"},
      {"a tab for a blank", "GET\t/healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"},
      {"no version", "GET /healthz\r\nHost: localhost\r\n\r\n"},
      {"a version misspelt", "GET /healthz HTTP/1.1x\r\nHost: localhost\r\n\r\n"},
      {"an address that is none", "GET healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"},
      {"an absolute address without a host", "GET http:///healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"},
      {"another scheme", "GET ftp://a/healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"},
      {"an absolute address with a user", "GET http://u@a/healthz HTTP/1.1\r\nHost: localhost\r\n\r\n"},
      {"an absolute address and no Host", "GET http://localhost/healthz HTTP/1.1\r\n\r\n"},
      {"an absolute address and a broken Host", "GET http://localhost/healthz HTTP/1.1\r\nHost: a b\r\n\r\n"},
      {"no method", "G(T / HTTP/1.1\r\nHost: localhost\r\n\r\n"},
      {"two empty lines first", "\r\n\r\n"s.append(get("/healthz"))},
      {"TLS", "\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03\r\n\r\n"s},
  };
  for (const Row& row : rows) {
    const std::string seen = front.answer(row.bytes + kHidden);
    EXPECT_THAT(seen, AllOf(StartsWith("HTTP/1.1 400 "), HasSubstr("request-invalid"), HasSubstr("Connection: close")))
        << row.what;
    EXPECT_EQ(count_of(seen, "HTTP/1.1 "), 1u) << row.what << ": " << seen;
  }
}

TEST(Front, WhatIsNoHostIsRefused) {
  const Front front;
  for (const char* host : {"",      "a b", "a/b",  "<x>",    "a b/<x>",     "u@a", "a:b", "a:99999999", "a:65536",  "a:-1",
                           "a:1:2", ":80", "[::1", "[::1]x", "[127.0.0.1]", "[a]", "a%2", "a,b c",      "http://a", "\xc3\xa4"}) {
    const std::string seen = front.answer("GET /healthz HTTP/1.1\r\nHost: " + std::string(host) + "\r\n\r\n" + kHidden);
    EXPECT_THAT(seen, AllOf(StartsWith("HTTP/1.1 400 "), HasSubstr("request-invalid"))) << host;
    EXPECT_EQ(count_of(seen, "HTTP/1.1 "), 1u) << host;
  }
  for (const char* host :
       {"a", "a:", "a:0", "a:65535", "A-b_c.example.", "127.0.0.1:80", "[::1]", "[2001:db8::1]:8080", "a%20b"}) {
    EXPECT_THAT(front.answer("GET /healthz HTTP/1.1\r\nHost: " + std::string(host) + "\r\nConnection: close\r\n\r\n"),
                StartsWith("HTTP/1.1 200 OK"))
        << host;
  }
}

TEST(Front, WhatIsKnownToHttpAndNotToUsIsToldSo) {
  const Front front;
  for (const char* line :
       {"CONNECT a:80 HTTP/1.1", "TRACE / HTTP/1.1", "BREW /pot HTTP/1.1", "get / HTTP/1.1", "PROPFIND * HTTP/1.1"}) {
    EXPECT_THAT(front.answer(std::string(line) + "\r\nHost: localhost\r\n\r\n" + kHidden),
                AllOf(StartsWith("HTTP/1.1 501 Not Implemented"), HasSubstr("method-unknown")))
        << line;
  }
  for (const char* line : {"GET / HTTP/2.0", "GET / HTTP/1.2", "GET / HTTP/0.9", "PRI * HTTP/2.0"}) {
    EXPECT_THAT(front.answer(std::string(line) + "\r\nHost: localhost\r\n\r\n" + kHidden),
                AllOf(StartsWith("HTTP/1.1 505 "), HasSubstr("http-version")))
        << line;
  }
}

TEST(Front, AnEscapedSlashIsNoBorder) {
  const Front front;
  for (const char* path : {"/v1%2fdatasets", "/v1%2Fdatasets", "/%2fv1/datasets", "/v1/datasets%2f"}) {
    EXPECT_THAT(front.answer(get(path, "Connection: close\r\n")), StartsWith("HTTP/1.1 404 ")) << path;
  }
  EXPECT_THAT(front.answer(get("/v1/dat%61sets", "Connection: close\r\n")), StartsWith("HTTP/1.1 200 "));
}

TEST(Front, ChunksThatBreakTheRulesBreakTheUpload) {
  Front front;
  const std::string chunked = kPost + "Transfer-Encoding: chunked\r\n\r\n";
  for (const std::string& body :
       {"4\nGOOD\r\n0\r\n\r\n"s, "4\r\nGOODx\r\n0\r\n\r\n"s, "-4\r\nGOOD\r\n0\r\n\r\n"s, "0x4\r\nGOOD\r\n0\r\n\r\n"s,
        " 4\r\nGOOD\r\n0\r\n\r\n"s, "4 \r\nGOOD\r\n0\r\n\r\n"s, ";a\r\nGOOD\r\n0\r\n\r\n"s,
        "fffffffffffffffff\r\nGOOD\r\n0\r\n\r\n"s, "4\r\nGOOD\n0\r\n\r\n"s, "4;a\nb\r\nGOOD\r\n0\r\n\r\n"s,
        "4\r\nGOOD\r\n0\r\ntrailer\r\n\r\n"s, "4\r\nGOOD\r\n0\r\n: x\r\n\r\n"s, "4\r\nGOOD\r\n0\r\nA: x\r\nb\r\n\r\n"s}) {
    const std::string seen = front.answer(chunked + body + kHidden);
    EXPECT_THAT(seen, AllOf(StartsWith("HTTP/1.1 400 "), HasSubstr("body-incomplete"))) << body;
    EXPECT_EQ(count_of(seen, "HTTP/1.1 "), 1u) << body;
  }
  const std::string seen = front.answer(chunked + std::string("2;a=\"b\"\r\nGO\r\n002\r\nOD\r\n0\r\nTrailer: x\r\n\r\n") +
                                        get("/healthz", "Connection: close\r\n"));
  EXPECT_THAT(seen, AllOf(StartsWith("HTTP/1.1 202 "), HasSubstr("\"ok\""))) << "and the next request begins where the body ends";
}

TEST(Front, TheWholeAddressMayBeGiven) {
  const Front front;
  EXPECT_THAT(front.answer("GET HTTP://127.0.0.1:1/healthz HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"),
              StartsWith("HTTP/1.1 200 OK"));
  EXPECT_THAT(front.answer("OPTIONS * HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\r\n"), StartsWith("HTTP/1.1 204 "));
  EXPECT_THAT(front.answer(get("/%68ealthz?%zz#x", "Connection: close\r\n")), StartsWith("HTTP/1.1 200 OK"));
}

TEST(Front, HeadsHaveASize) {
  const Front front;
  EXPECT_THAT(front.answer(get("/" + std::string(9000, 'a'))), AllOf(StartsWith("HTTP/1.1 414 "), HasSubstr("uri-too-long")));
  EXPECT_THAT(front.answer("GET /" + std::string(100000, 'a')), AllOf(StartsWith("HTTP/1.1 414 "), HasSubstr("uri-too-long")));
  EXPECT_THAT(front.answer(get("/healthz", "X: " + std::string(40000, 'a') + "\r\n")),
              AllOf(StartsWith("HTTP/1.1 431 "), HasSubstr("head-too-large")));
  std::string many;
  for (int i = 0; i < 200; ++i) many.append("X").append(std::to_string(i)).append(": a\r\n");
  EXPECT_THAT(front.answer(get("/healthz", many)), AllOf(StartsWith("HTTP/1.1 431 "), HasSubstr("head-too-large")));
}

TEST(Front, OldClientsAreServed) {
  Front front;
  const std::string seen = front.answer("GET /healthz HTTP/1.0\r\n\r\n");
  EXPECT_THAT(seen, AllOf(StartsWith("HTTP/1.1 200 OK"), HasSubstr("Connection: close")));
  RawClient stays = front.client();
  for (int i = 0; i < 2; ++i) stays.say("GET /healthz HTTP/1.0\r\nConnection: keep-alive\r\n\r\n");
  stays.say("GET /healthz HTTP/1.0\r\n\r\n");
  EXPECT_EQ(count_of(stays.rest(), "\"ok\""), 3u);
  const std::string id = body_of(front.test().post("GOOD", {}, {{"prefer", "wait=200"}}))["id"];
  const std::string events = front.answer("GET /v1/datasets/" + id + "/events HTTP/1.0\r\n\r\n");
  EXPECT_THAT(events, AllOf(HasSubstr("\r\n\r\nevent: ready"), Not(HasSubstr("chunked"))));
}

TEST(Front, AHalfClosedUploadIsAnswered) {
  Front front;
  for (const std::string& body : {"Content-Length: 1000\r\n\r\nGOOD"s, "Transfer-Encoding: chunked\r\n\r\n4\r\nGOOD\r\n"s}) {
    RawClient client = front.client();
    client.say(kPost + body);
    client.half_close();
    EXPECT_THAT(client.rest(), AllOf(StartsWith("HTTP/1.1 400 "), HasSubstr("body-incomplete")));
  }
  RawClient whole = front.client();
  whole.say(kPost + "Content-Length: 4\r\n\r\nGOOD");
  whole.half_close();
  EXPECT_THAT(whole.rest(), StartsWith("HTTP/1.1 202 ")) << "a client that has said all may close its side";
  EXPECT_TRUE(eventually([&] { return std::filesystem::is_empty(front.test().data() / "incoming"); }));
}

TEST(Front, ABodyThatNobodyReadsEndsTheConnectionAndIsNoRequest) {
  const Front front;
  for (const std::string& head :
       {"GET /healthz HTTP/1.1\r\nHost: localhost\r\n"s, "DELETE /v1/datasets/x HTTP/1.1\r\nHost: localhost\r\n"s}) {
    const std::string seen = front.answer(head + "Content-Length: " + std::to_string(kHidden.size()) + "\r\n\r\n" + kHidden);
    EXPECT_EQ(count_of(seen, "HTTP/1.1 "), 1u) << seen;
    EXPECT_THAT(seen, HasSubstr("Connection: close"));
  }
  const std::string refused = "POST /v1/datasets?eror=1 HTTP/1.1\r\nHost: localhost\r\nContent-Length: 4\r\n\r\nGOOD";
  const std::string seen = front.answer(refused + get("/healthz", "Connection: close\r\n"));
  EXPECT_THAT(seen, AllOf(StartsWith("HTTP/1.1 400 "), HasSubstr("option-unknown"), HasSubstr("\"ok\"")))
      << "a small one does not cost the connection";
}

TEST(Front, CompressedUploadsAreRead) {
  Front front;
  const auto file = (front.test().folder() / "a").string();
  std::ofstream(file) << "GOOD" << std::string(100000, 'x');
  ASSERT_EQ(std::system(("gzip '" + file + "'").c_str()), 0);
  const std::string body = file_text(file + ".gz");
  const std::string head = kPost + "Prefer: wait=200\r\nConnection: close\r\nContent-Encoding: gzip\r\nContent-Length: ";
  EXPECT_THAT(front.answer(head + std::to_string(body.size()) + "\r\n\r\n" + body),
              AllOf(StartsWith("HTTP/1.1 201 "), HasSubstr("\"ready\"")));
  std::string wrong_sum = body;
  wrong_sum[body.size() - 6] ^= 1;
  for (const std::string& bad : {"GOOD"s, body + "more", wrong_sum}) {
    EXPECT_THAT(front.answer(head + std::to_string(bad.size()) + "\r\n\r\n" + bad),
                AllOf(StartsWith("HTTP/1.1 400 "), HasSubstr("coding-invalid"), HasSubstr("gzip")));
  }
  const std::string json = kPost + "Content-Type: application/json\r\nConnection: close\r\nContent-Encoding: deflate\r\n";
  EXPECT_THAT(front.answer(json + "Content-Length: 4\r\n\r\n{}{}"), HasSubstr("coding-invalid")) << "whatever reads it";
  EXPECT_THAT(front.answer(head + std::to_string(body.size() - 8) + "\r\n\r\n" + body.substr(0, body.size() - 8)),
              HasSubstr("body-incomplete"))
      << "without its end";
  const std::string unknown = kPost + "Content-Encoding: zstd\r\nConnection: close\r\nContent-Length: 4\r\n\r\nGOOD";
  EXPECT_THAT(front.answer(unknown), AllOf(StartsWith("HTTP/1.1 415 "), HasSubstr("coding-unknown"),
                                           HasSubstr("\r\nAccept-Encoding: gzip, deflate, br\r\n")));
}

TEST(Front, HeadersOfAnswersStayOnTheirLines) {
  Response response;
  response.set("Location", "a\r\nSet-Cookie: b");
  EXPECT_THAT(front::answer_head(response, {}), HasSubstr("Location: a  Set-Cookie: b\r\n"));
  EXPECT_THAT(front::http_date(),
              testing::MatchesRegex("[A-Z][a-z]{2}, [0-9]{2} [A-Z][a-z]{2} [0-9]{4} [0-9]{2}:[0-9]{2}:[0-9]{2} GMT"));
}

TEST(Workers, ClientsTakeTurns) {
  std::string order;
  {
    front::Workers workers(1, 1000, 100);
    std::mutex gate;
    gate.lock();
    EXPECT_EQ(workers.run("first", [&] { const std::lock_guard wait(gate); }), front::Workers::Taken::yes);
    for (int i = 0; i < 99; ++i) EXPECT_EQ(workers.run("many", [&] { order += 'm'; }), front::Workers::Taken::yes);
    EXPECT_EQ(workers.run("many", [] {}), front::Workers::Taken::yes);
    EXPECT_EQ(workers.run("many", [] {}), front::Workers::Taken::client_has_many);
    EXPECT_EQ(workers.run("one", [&] { order += 'o'; }), front::Workers::Taken::yes);
    gate.unlock();
  }
  EXPECT_EQ(order.size(), 100u);
  EXPECT_LE(order.find('o'), 1u) << "one does not wait for the hundred of another";
}

}  // namespace
}  // namespace cordillera::server
