// Who may do what: tokens, roles, what is private, what strangers try.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <future>
#include <set>

#include "fixture.h"
#include "server/access/client_address.h"
#include "server/access/tokens.h"
#include "server/http/digest.h"

namespace cordillera::server {
namespace {

using access::make_token;
using access::Role;
using testing::HasSubstr;

struct Tokens {
  access::NewToken reader = make_token("reader", Role::read), writer = make_token("writer", Role::write),
                   other = make_token("other", Role::write), admin = make_token("admin", Role::admin);
  std::string lines() const { return reader.line + ";" + writer.line + ";" + other.line + ";" + admin.line; }
};

Settings guarded(const Tokens& tokens) {
  Settings settings;
  settings.serve.token_lines = tokens.lines();
  return settings;
}

std::map<std::string, std::string> bearer(const access::NewToken& token) { return {{"authorization", "Bearer " + token.token}}; }

Response remove(TestService& test, const std::string& id, const std::map<std::string, std::string>& headers) {
  Request request;
  request.method = "DELETE";
  request.path = "/v1/datasets/" + id;
  request.headers = headers;
  return test.api().handle(request);
}

std::string posted(TestService& test, const access::NewToken& token, const Given& query = {}) {
  const std::string id = body_of(test.post("GOOD", query, bearer(token)))["id"];
  EXPECT_TRUE(eventually([&] { return test.service().registry().find(id)->state == State::ready; }));
  return id;
}

std::vector<Json> audited(TestService& test) {
  std::vector<Json> lines;
  std::istringstream text(file_text(test.data() / "audit.jsonl"));
  for (std::string line; std::getline(text, line);) lines.push_back(Json::parse(line));
  return lines;
}

TEST(Tokens, LinesAreReadAndRefused) {
  const Tokens tokens;
  const auto read = access::read_tokens(
      "# who writes\n\n" + tokens.reader.line + "  # with a word\n" + tokens.admin.line + ";" + tokens.writer.line, "here");
  ASSERT_TRUE(read) << read.problem().line();
  ASSERT_EQ(read->size(), 3u);
  EXPECT_EQ((*read)[1].name, "admin");
  EXPECT_EQ((*read)[2].role, Role::write);
  for (const std::string& bad :
       std::vector<std::string>{"name", "name write", "na/me write sha256:00:00", "name owner " + tokens.reader.line.substr(12),
                                "name write md5:00:00", tokens.reader.line + " more", tokens.reader.line.substr(0, 60),
                                "name write " + std::string(5000, 'a')}) {
    const auto refused = access::read_tokens(bad, "here");
    ASSERT_FALSE(refused) << bad;
    EXPECT_EQ(refused.problem().type, "tokens-invalid");
    EXPECT_THAT(refused.problem().detail, HasSubstr("here, line 1"));
  }
}

TEST(Tokens, AreFoundByTheirWholeTextAlone) {
  const Tokens tokens;
  const auto lines = access::read_tokens(tokens.lines(), "here");
  EXPECT_EQ(access::find_token(*lines, tokens.writer.token).name, "writer");
  EXPECT_EQ(access::find_token(*lines, tokens.writer.token).role, Role::write);
  for (const std::string& wrong :
       std::vector<std::string>{std::string(), std::string("writer"), tokens.writer.token + " ", tokens.writer.token.substr(1),
                                tokens.writer.line, tokens.writer.token.substr(0, tokens.writer.token.size() - 1)}) {
    EXPECT_EQ(access::find_token(*lines, wrong).role, Role::none) << wrong;
  }
  EXPECT_THAT(tokens.writer.line, testing::Not(HasSubstr(tokens.writer.token.substr(4))));
  EXPECT_NE(make_token("a", Role::read).token, make_token("a", Role::read).token);
}

TEST(Tokens, OfMoreThanFourKibibytesAreNotLookedFor) {
  for (const auto& [length, role] : {std::pair{4096, Role::write}, {4097, Role::none}}) {
    const std::string token(static_cast<std::size_t>(length), 'a'), salt(32, '0');
    const auto lines = access::read_tokens("long write sha256:" + salt + ":" + digest(salt + token), "here");
    ASSERT_TRUE(lines) << lines.problem().line();
    EXPECT_EQ(access::find_token(*lines, token).role, role) << length;
  }
}

/// Rows: what is asked, and the status for nobody, a wrong token, and the roles read, write, admin.
TEST(Access, EveryRoleMayWhatItMay) {
  const Tokens tokens;
  TestService test(guarded(tokens));
  const std::string open = posted(test, tokens.writer), hidden = posted(test, tokens.writer, {{"private", "1"}});
  struct Row {
    std::string method, path;
    std::array<int, 5> wanted;
  };
  const std::vector<Row> rows = {
      {"GET", "/", {200, 401, 200, 200, 200}},
      {"GET", "/v1", {200, 401, 200, 200, 200}},
      {"GET", "/v1/limits", {200, 401, 200, 200, 200}},
      {"GET", "/healthz", {200, 401, 200, 200, 200}},
      {"GET", "/metrics", {401, 401, 200, 200, 200}},
      {"GET", "/v1/datasets", {200, 401, 200, 200, 200}},
      {"GET", "/v1/datasets/" + open, {200, 401, 200, 200, 200}},
      {"GET", "/v1/datasets/" + open + "/tiles/1/1/1.drc", {200, 401, 200, 200, 200}},
      {"GET", "/v1/datasets/" + hidden, {404, 401, 200, 200, 200}},
      {"HEAD", "/v1/datasets/" + hidden + "/manifest.json", {404, 401, 200, 200, 200}},
      {"GET", "/v1/datasets/" + hidden + "/tileset.json", {404, 401, 200, 200, 200}},
      {"GET", "/v1/datasets/" + hidden + "/events", {404, 401, 200, 200, 200}},
      {"GET", "/v1/datasets/" + hidden + "/tiles/1/1/1.drc", {404, 401, 200, 200, 200}},
      {"POST", "/v1/datasets/" + hidden + "/elevation", {404, 401, 400, 400, 400}},
      {"POST", "/v1/datasets", {401, 401, 403, 202, 202}},
      {"PUT", "/v1/datasets/" + open, {401, 401, 403, 405, 405}},
      {"DELETE", "/v1/datasets/none", {401, 401, 403, 404, 404}},
      {"DELETE", "/v1/datasets/" + open, {401, 401, 403, -1, -1}},
      {"OPTIONS", "/v1/datasets/" + hidden, {204, 401, 204, 204, 204}},
  };
  const std::vector<std::map<std::string, std::string>> callers = {
      {}, {{"authorization", "Bearer cdl_none"}}, bearer(tokens.reader), bearer(tokens.writer), bearer(tokens.admin)};
  for (const Row& row : rows) {
    for (std::size_t i = 0; i < callers.size(); ++i) {
      if (row.wanted[i] < 0) continue;
      Request request;
      request.method = row.method;
      request.path = row.path;
      request.headers = callers[i];
      request.headers.emplace("content-length", "4");
      request.read_body = [](const Request::Sink& sink) { return sink("GOOD"); };
      const Response answer = test.api().handle(request);
      EXPECT_EQ(answer.status, row.wanted[i]) << row.method << " " << row.path << " by caller " << i << ": " << answer.body;
      if (answer.status == 401) {
        EXPECT_THAT(answer.header("WWW-Authenticate"), HasSubstr("Bearer realm=\"cordillera\"")) << row.path;
      }
    }
  }
}

TEST(Access, WhatIsPrivateIsNotListedAndNotCached) {
  const Tokens tokens;
  TestService test(guarded(tokens));
  const std::string open = posted(test, tokens.writer), hidden = posted(test, tokens.writer, {{"private", "1"}});
  EXPECT_EQ(body_of(test.get("/v1/datasets"))["datasets"].size(), 1u);
  EXPECT_EQ(body_of(test.get("/v1/datasets", bearer(tokens.reader)))["datasets"].size(), 2u);
  EXPECT_THAT(test.get("/").body, testing::Not(HasSubstr(hidden)));
  EXPECT_EQ(body_of(test.get("/v1/datasets/" + hidden, bearer(tokens.reader)))["private"], true);
  const std::string path = "/v1/datasets/" + hidden + "/tiles/1/1/1.drc";
  const Response tile = test.get(path, bearer(tokens.reader));
  EXPECT_EQ(tile.header("Cache-Control"), "private, no-cache");
  EXPECT_EQ(test.get("/v1/datasets/" + open + "/tiles/1/1/1.drc").header("Cache-Control"), "public, no-cache");
  // Nor does a tag that somebody learnt open it.
  EXPECT_EQ(test.get(path, {{"if-none-match", tile.header("ETag")}}).status, 404);
}

TEST(Access, PrivateIsTheDefaultWhereTheOperatorSaysSo) {
  const Tokens tokens;
  Settings settings = guarded(tokens);
  settings.private_dataset = true;
  TestService test(settings);
  EXPECT_EQ(test.get("/v1/datasets/" + posted(test, tokens.writer)).status, 404);
  EXPECT_EQ(test.get("/v1/datasets/" + posted(test, tokens.writer, {{"private", "0"}})).status, 200);
  test.stop();
  test.start();  // and it is remembered
  EXPECT_EQ(body_of(test.get("/v1/datasets"))["datasets"].size(), 1u);
}

TEST(Access, WritersRemoveWhatTheyPosted) {
  const Tokens tokens;
  TestService test(guarded(tokens));
  const std::string one = posted(test, tokens.writer), two = posted(test, tokens.writer);
  const Response refused = remove(test, one, bearer(tokens.other));
  EXPECT_EQ(refused.status, 403);
  EXPECT_EQ(slug_of(refused), "role-too-low");
  EXPECT_THAT(refused.header("WWW-Authenticate"), HasSubstr("insufficient_scope"));
  EXPECT_EQ(remove(test, one, bearer(tokens.writer)).status, 204);
  EXPECT_EQ(remove(test, two, bearer(tokens.admin)).status, 204);
}

/// Whoever comes second finds nothing, and is not told of a full disk.
TEST(Access, SeveralWhoRemoveADatasetAtOnceRemoveItOnce) {
  const Tokens tokens;
  TestService test(guarded(tokens));
  for (int round = 0; round < 40; ++round) {
    const std::string id = posted(test, tokens.writer);
    std::vector<std::future<int>> answers;
    for (int k = 0; k < 8; ++k)
      answers.push_back(std::async(std::launch::async, [&] { return remove(test, id, bearer(tokens.writer)).status; }));
    std::multiset<int> statuses;
    for (auto& answer : answers) statuses.insert(answer.get());
    EXPECT_EQ(statuses.count(204), 1u);
    EXPECT_EQ(statuses.count(404), 7u);
  }
}

TEST(Access, ABodyIsNotReadForWhoMayNotSendIt) {
  const Tokens tokens;
  TestService test(guarded(tokens));
  Request request;
  request.method = "POST";
  request.path = "/v1/datasets";
  request.headers = {{"content-length", "4"}};
  bool read = false;
  request.read_body = [&](const Request::Sink&) { return read = true; };
  EXPECT_EQ(slug_of(test.api().handle(request)), "token-missing");
  EXPECT_FALSE(read);
  EXPECT_EQ(test.leftovers(), 0u);
}

TEST(Access, TokensAreChangedWithoutARestart) {
  TempFolder folder;
  const std::filesystem::path file = folder.path() / "tokens";
  const Tokens tokens;
  const auto write = [&](const std::string& text) {
    std::ofstream(file) << text;
    // Its time may be that of the former one, as the file system tells it.
    static int later = 0;
    std::filesystem::last_write_time(file, std::filesystem::file_time_type::clock::now() + std::chrono::seconds(++later));
  };
  write(tokens.writer.line + "\n");
  Settings settings;
  settings.serve.tokens = file.string();
  TestService test(settings);
  EXPECT_EQ(test.post("GOOD", {}, bearer(tokens.writer)).status, 202);
  EXPECT_EQ(test.post("GOOD", {}, bearer(tokens.other)).status, 401);
  write(tokens.writer.line + "\n" + tokens.other.line + "\n");
  EXPECT_EQ(test.post("GOOD", {}, bearer(tokens.other)).status, 202);
  write(tokens.other.line + "\n");
  EXPECT_EQ(test.post("GOOD", {}, bearer(tokens.writer)).status, 401);
  write("half a li");  // what cannot be read changes nothing
  EXPECT_EQ(test.post("GOOD", {}, bearer(tokens.other)).status, 202);
  std::filesystem::remove(file);
  EXPECT_EQ(test.post("GOOD", {}, bearer(tokens.other)).status, 202);
  EXPECT_EQ(test.post("GOOD").status, 401);
}

proto::Result<std::unique_ptr<access::Gate>> gate(const std::string& listen, const std::string& lines = "",
                                                  bool insecure = false) {
  return access::Gate::open({listen, "", lines, insecure});
}

TEST(Access, AnOpenServiceStaysOnThisMachine) {
  for (const char* listen : {"127.0.0.1:8080", "127.1.2.3:1", "localhost:80", "LOCALHOST:80", "localhost.:80", "[::1]:8080"})
    EXPECT_TRUE(gate(listen)) << listen;
  for (const char* listen : {"0.0.0.0:8080", "192.168.0.1:8080", "[::]:8080", "example.org:80", "127.example.org:80",
                             "127.abc.de:80", "localhost.example.org:80"}) {
    const auto refused = gate(listen);
    ASSERT_FALSE(refused) << listen;
    EXPECT_EQ(refused.problem().type, "listen-unprotected");
    EXPECT_TRUE(gate(listen, make_token("a", Role::write).line)) << listen;
    EXPECT_TRUE(gate(listen, "", true)) << listen;
  }
  EXPECT_EQ(gate("0.0.0.0:1", make_token("a", Role::write).line, true).problem().type, "options-conflict");
  Settings hidden;
  hidden.private_dataset = true;
  TempFolder folder;
  hidden.serve.data = folder.path().string();
  EXPECT_EQ(Service::open(hidden, play_job).problem().type, "options-conflict");
}

/// A page that a user of this machine looks at must not write here, nor what comes through a proxy.
TEST(Access, WithoutTokensStrangersDoNotWrite) {
  TestService test;
  struct Row {
    std::map<std::string, std::string> headers;
    std::string problem;
  };
  const std::vector<Row> rows = {
      {{}, ""},
      {{{"host", "127.0.0.1:8080"}}, ""},
      {{{"host", "localhost:8080"}, {"origin", "http://localhost:8080"}, {"sec-fetch-site", "same-origin"}}, ""},
      {{{"host", "[::1]:8080"}}, ""},
      {{{"host", "127.0.0.1:8080"}, {"origin", "https://example.org"}}, "origin-forbidden"},
      {{{"host", "127.0.0.1:8080"}, {"origin", "http://127.0.0.1:9090"}}, "origin-forbidden"},
      {{{"host", "127.0.0.1:8080"}, {"origin", "null"}}, "origin-forbidden"},
      {{{"host", "127.0.0.1:8080"}, {"sec-fetch-site", "cross-site"}}, "origin-forbidden"},
      {{{"host", "127.0.0.1:8080"}, {"sec-fetch-site", "same-site"}}, "origin-forbidden"},  // another port of this machine
      {{{"host", "rebound.example.org:8080"}, {"origin", "http://rebound.example.org:8080"}}, "token-missing"},
      {{{"host", "LocalHost:8080"}}, ""},
      {{{"host", "localhost."}}, ""},
      {{{"host", "[::ffff:127.0.0.1]:8080"}}, ""},
      // Names that look like addresses, and what no two programs read alike.
      {{{"host", "127.abc.de:8080"}, {"origin", "http://127.abc.de:8080"}}, "token-missing"},
      {{{"host", "127.0.0.1.cc"}}, "token-missing"},
      {{{"host", "127.cafe.be:8080"}}, "token-missing"},
      {{{"host", "127.1"}}, "token-missing"},
      {{{"host", "127.0.0.01"}}, "token-missing"},
      {{{"host", "127.0.0.1."}}, "token-missing"},
      {{{"host", "[::1]abc.de:8080"}}, "token-missing"},
      {{{"host", "[::1"}}, "token-missing"},
      {{{"host", "localhost..:8080"}}, "token-missing"},
      {{{"host", ""}}, "token-missing"},
      {{{"host", "127.0.0.1:8080"}, {"x-forwarded-for", "192.0.2.1"}}, "token-missing"},
      {{{"host", "127.0.0.1:8080"}, {"forwarded", "for=192.0.2.1"}}, "token-missing"},
      {{{"host", "127.0.0.1:8080"}, {"x-real-ip", "192.0.2.1"}}, "token-missing"},
      {{{"host", "127.0.0.1:8080"}, {"via", "1.1 proxy"}}, "token-missing"},
      {{{"host", "127.0.0.1:8080"}, {"x-forwarded-proto", "https"}}, "token-missing"},
      {{{"host", "127.0.0.1:8080"}, {"x-forwarded-server", "proxy"}}, "token-missing"},
      {{{"host", "127.0.0.1:8080"}, {"x-original-host", "terrain.example"}}, "token-missing"},
      {{{"host", "127.0.0.1:8080"}, {"x-client-ip", "192.0.2.1"}}, "token-missing"},
      {{{"host", "127.0.0.1:8080"}, {"cf-connecting-ip", "192.0.2.1"}}, "token-missing"},
      {{{"host", "127.0.0.1:8080"}, {"true-client-ip", "192.0.2.1"}}, "token-missing"},
      {{{"host", "127.0.0.1:8080"}, {"x-forwarded-host", "terrain.example"}, {"origin", "https://terrain.example"}},
       "token-missing"},
  };
  for (const Row& row : rows) {
    const Response answer = test.post("GOOD", {}, row.headers);
    const auto host = row.headers.find("host");
    EXPECT_EQ(answer.problem, row.problem) << (host == row.headers.end() ? "no host" : host->second) << ": " << answer.body;
    if (row.problem.empty()) { EXPECT_EQ(answer.status, 202); }
  }
  EXPECT_EQ(slug_of(test.post("GOOD", {{"private", "1"}})), "option-forbidden");
}

TEST(Access, TheClientIsTheLastOneThatNoTrustedProxyIs) {
  const std::vector<std::string> trusted = {"127.0.0.1", "10.0.0.1", "2001:db8::1"};
  const auto client = [&](const std::string& peer, const std::string& forwarded) {
    Request request;
    request.client = peer;
    if (!forwarded.empty()) request.headers["x-forwarded-for"] = forwarded;
    return access::client_address(request, trusted);
  };
  EXPECT_EQ(client("192.0.2.1", ""), "192.0.2.1");
  EXPECT_EQ(client("192.0.2.1", "198.51.100.7"), "192.0.2.1");  // not trusted: it may say what it likes
  EXPECT_EQ(client("127.0.0.1", "198.51.100.7"), "198.51.100.7");
  EXPECT_EQ(client("127.0.0.1", "203.0.113.9, 198.51.100.7, 10.0.0.1"), "198.51.100.7");
  EXPECT_EQ(client("127.0.0.1", "203.0.113.9,<script>"), "127.0.0.1");
  EXPECT_EQ(client("127.0.0.1", "10.0.0.1"), "10.0.0.1");
  EXPECT_EQ(client("127.0.0.1", "2001:db8::7"), "2001:db8::7");
  EXPECT_EQ(client("127.0.0.1", "2001:DB8:0::0:7, 2001:db8:0:0::1"), "2001:db8::7") << "one address, however it is written";
  EXPECT_EQ(client("::ffff:127.0.0.1", "198.51.100.7"), "198.51.100.7") << "a socket for both kinds shows IPv4 like this";
  EXPECT_EQ(client("127.0.0.1", "198.51.100.7:4711, [2001:db8::1]:80"), "198.51.100.7") << "some proxies write the port";
  for (const char* none : {"abc.de", "127.abc.de", "1.2.3", "1.2.3.4.5", "dead.beef", "999.0.0.1", "1.2.3.04", ":",
                           "::1::", "a::b::c", "fe80::1%lo", "unknown"}) {
    EXPECT_EQ(client("127.0.0.1", none), "127.0.0.1") << none;
  }
}

/// Who has a network of IPv6 has 2^64 addresses.
TEST(Access, AddressesOfOneNetworkShareItsLimits) {
  using access::share_of;
  EXPECT_EQ(share_of("2001:db8:0:7:1::1"), "2001:db8:0:7::/64");
  EXPECT_EQ(share_of("2001:db8:0:7:ffff:ffff:ffff:ffff"), share_of("2001:db8:0:7::"));
  EXPECT_NE(share_of("2001:db8:0:8::1"), share_of("2001:db8:0:7::1"));
  EXPECT_EQ(share_of("192.0.2.1"), "192.0.2.1");
  EXPECT_EQ(share_of("::ffff:192.0.2.1"), "192.0.2.1");
  EXPECT_EQ(share_of("fe80::1%lo"), "fe80::1%lo");
  EXPECT_EQ(share_of(""), "");
}

TEST(Access, WritesAreAudited) {
  const Tokens tokens;
  TestService test(guarded(tokens));
  const std::string id = posted(test, tokens.writer);
  test.post("GOOD", {{"error", "none"}}, {{"authorization", "Bearer " + tokens.writer.token}, {"x-request-id", "mine-1"}});
  test.post("GOOD");  // let in by nobody
  test.get("/v1/datasets/" + id);
  remove(test, id, bearer(tokens.admin));
  const std::vector<Json> lines = audited(test);
  ASSERT_EQ(lines.size(), 3u);
  EXPECT_EQ(lines[0]["who"], "writer");
  EXPECT_EQ(lines[0]["method"], "POST");
  EXPECT_EQ(lines[0]["dataset"], id);
  EXPECT_EQ(lines[0]["bytes"], 4);
  EXPECT_EQ(lines[0]["status"], 202);
  EXPECT_EQ(lines[1]["problem"], "option-invalid");
  EXPECT_EQ(lines[1]["request"], "mine-1");
  EXPECT_EQ(lines[1]["dataset"], nullptr);
  EXPECT_EQ(lines[2]["who"], "admin");
  EXPECT_EQ(lines[2]["method"], "DELETE");
  EXPECT_EQ(lines[2]["dataset"], id);
  EXPECT_EQ(lines[2]["status"], 204);
  for (const Json& line : lines) EXPECT_EQ(std::string(line["time"]).size(), 24u);
}

}  // namespace
}  // namespace cordillera::server
