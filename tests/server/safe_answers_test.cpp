// Request ids, headers that keep browsers from mistakes, and what strangers put into paths and headers.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fixture.h"
#include "server/log/log.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

TEST(RequestId, IsTheClientsIfItIsSane) {
  TestService test;
  for (const char* sane : {"a", "7f3e-42", "trace:1.2_3", "0123456789012345678901234567890123456789012345678901234567890123"}) {
    EXPECT_EQ(test.get("/healthz", {{"x-request-id", sane}}).header("X-Request-Id"), sane);
  }
  for (const std::string bad : {"", "two words", "a\r\nSet-Cookie: b", "<script>", "\"", "ü",
                                "01234567890123456789012345678901234567890123456789012345678901234"}) {
    const std::string made = test.get("/healthz", {{"x-request-id", bad}}).header("X-Request-Id");
    EXPECT_NE(made, bad);
    EXPECT_EQ(made.size(), 16u);
    EXPECT_EQ(made.find_first_not_of("0123456789abcdef"), made.npos);
  }
  EXPECT_NE(test.get("/healthz").header("X-Request-Id"), test.get("/healthz").header("X-Request-Id"));
}

TEST(RequestId, IsInEveryAnswerAndEveryProblem) {
  TestService test;
  for (const char* path :
       {"/", "/v1", "/v1/datasets", "/api", "/metrics", "/v1/limits", "/readyz", "/v1/none", "/v1/datasets/none", "/none"}) {
    const Response answer = test.get(path, {{"x-request-id", "me-1"}});
    EXPECT_EQ(answer.header("X-Request-Id"), "me-1") << path;
    if (answer.header("Content-Type") != "application/problem+json") continue;
    EXPECT_EQ(body_of(answer)["request_id"], "me-1") << path;
    EXPECT_EQ(body_of(answer)["status"], answer.status) << path;
  }
  EXPECT_EQ(body_of(test.post("GOOD", {{"eror", "1"}}, {{"x-request-id", "me-2"}}))["request_id"], "me-2");
}

TEST(SafeHeaders, NothingIsTakenForSomethingElse) {
  TestService test;
  for (const char* path : {"/", "/v1", "/v1/datasets", "/none", "/metrics"}) {
    EXPECT_EQ(test.get(path).header("X-Content-Type-Options"), "nosniff") << path;
  }
  const Response page = test.get("/");
  EXPECT_THAT(page.header("Content-Security-Policy"), HasSubstr("default-src 'none'"));
  EXPECT_THAT(page.header("Content-Security-Policy"), HasSubstr("frame-ancestors 'self'"));
  EXPECT_THAT(page.header("Content-Security-Policy"),
              HasSubstr("script-src 'self' 'unsafe-eval' blob:;"));  // no scripts in the page, none from elsewhere
  EXPECT_EQ(page.header("Referrer-Policy"), "strict-origin-when-cross-origin");
}

/// The page of a map library may have its own script and libraries of one host; it is the same for every id, so it tells of none.
TEST(SafeHeaders, AClientsPageMayHaveItsLibraryAndTellsOfNoDataset) {
  TestService test;
  std::filesystem::create_directories(test.folder() / "web" / "demo");
  std::ofstream(test.folder() / "web" / "demo" / "leaflet.html") << "<!doctype html><p>Leaflet</p>";
  const std::string id = body_of(test.post("GOOD"))["id"];
  const Response there = test.get("/v1/datasets/" + id + "/demo/leaflet.html"),
                 nowhere = test.get("/v1/datasets/none/demo/leaflet.html");
  EXPECT_EQ(there.status, 200);
  EXPECT_EQ(there.bytes(), "<!doctype html><p>Leaflet</p>");
  EXPECT_EQ(there.bytes(), nowhere.bytes());
  EXPECT_EQ(there.header("ETag"), nowhere.header("ETag"));
  EXPECT_EQ(there.header("Cache-Control"), "no-cache");
  EXPECT_EQ(test.get("/v1/datasets/none/demo/leaflet.html", {{"if-none-match", there.header("ETag")}}).status, 304);
  EXPECT_THAT(there.header("Content-Security-Policy"),
              HasSubstr("script-src 'self' 'unsafe-inline' 'unsafe-eval' blob: https://cdn.jsdelivr.net/npm/;"));
  EXPECT_EQ(slug_of(test.get("/v1/datasets/none/demo/other.html")), "not-found");
  EXPECT_EQ(test.get("/v1/datasets/none/demo/../../x.html").status, 404);
}

/// What a header or a line of the log ends with must not come from outside.
TEST(SafeHeaders, NoHeaderHoldsWhatEndsIt) {
  TestService test;
  const std::string evil = "a\r\nSet-Cookie: b=c\r\n\r\n<script>";
  std::vector<Response> answers = {test.get("/" + evil),
                                   test.get("/v1/datasets/" + evil),
                                   test.get("/v1/" + evil),
                                   test.post("GOOD", {{"name", evil}}),
                                   test.post("GOOD", {{evil, "1"}}),
                                   test.post("GOOD", {{"title", evil}}),
                                   test.post("GOOD", {}, {{"prefer", "wait=1" + evil}}),
                                   test.post("GOOD", {}, {{"idempotency-key", evil}})};
  for (const char* header : {"x-request-id", "authorization", "x-forwarded-host", "x-forwarded-proto", "x-forwarded-prefix",
                             "host", "origin", "range", "if-none-match"}) {
    answers.push_back(test.get("/v1/datasets", {{header, evil}}));
    answers.push_back(test.post("GOOD", {}, {{header, evil}}));
  }
  for (const Response& answer : answers) {
    for (const auto& [name, value] : answer.headers) EXPECT_EQ(value.find_first_of("\r\n"), value.npos) << name << ": " << value;
  }
}

TEST(SafePaths, NothingOutsideTheFoldersIsRead) {
  TestService test;
  std::filesystem::create_directories(test.settings().serve.web);
  std::ofstream(std::filesystem::path(test.settings().serve.web) / "index.html") << "the page";
  std::ofstream(test.folder() / "secret") << "the secret";
  std::filesystem::create_symlink(test.folder() / "secret", std::filesystem::path(test.settings().serve.web) / "link");
  EXPECT_EQ(test.get("/").body, "the page");
  for (const std::string path :
       {"/../secret", "/../../../../../../etc/passwd", "//etc/passwd", "/./../secret", "/link", "/index.html/../../secret",
        "/..%2fsecret", "/\\..\\secret", "/v1/datasets/../../secret", "/v1/datasets/a/../../../secret",
        "/v1/datasets/a/tiles/../../../secret", "/v1/datasets/a/tiles/1/1/../../1.drc", "/v1/datasets/%00", "/v1//datasets",
        "/v1/datasets//", "/registry.sqlite", "/../data/registry.sqlite", "/../data/audit.jsonl"}) {
    const Response answer = test.get(path);
    EXPECT_EQ(answer.status, 404) << path;
    EXPECT_THAT(answer.body, testing::Not(HasSubstr("the secret"))) << path;
  }
  EXPECT_EQ(test.get(std::string("/index.html\0.png", 16)).status, 404);
}

TEST(Log, LinesStayLines) {
  EXPECT_EQ(printable("a\nb\r\x1b[2Jc\td"), "a?b??[2Jc?d");
  EXPECT_EQ(printable("ü µ"), "ü µ");
  EXPECT_EQ(printable("x\xc2\x9b"
                      "31m\xe2\x80\xae"),
            "x?31m?");
  EXPECT_EQ(printable("x\x9b"
                      "31m"),
            "x?31m")
      << "no UTF-8: a terminal of bytes takes it";
}

}  // namespace
}  // namespace cordillera::server
