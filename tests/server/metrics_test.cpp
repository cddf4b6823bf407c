// GET /metrics: in the format, counting what happened, and having what the dashboard asks for.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>

#include "fixture.h"
#include "prometheus_text.h"
#include "server/access/tokens.h"

namespace cordillera::server {
namespace {

using testing::IsEmpty;

PrometheusText metrics_of(TestService& test) { return read_prometheus(test.get("/metrics").body); }

TEST(Metrics, AreInTheFormat) {
  TestService test;
  test.post("GOOD");
  test.post("BAD");
  test.get("/v1/datasets/none");
  const Response answer = test.get("/metrics");
  EXPECT_EQ(answer.header("Content-Type"), "text/plain; version=0.0.4; charset=utf-8");
  const PrometheusText text = read_prometheus(answer.body);
  EXPECT_THAT(text.wrong, IsEmpty());
  EXPECT_GT(text.samples.size(), 50u);
}

/// A family that /metrics does not tell would be counted for nobody.
TEST(Metrics, EveryFamilyThatIsDeclaredIsTold) {
  TestService test;
  const PrometheusText text = metrics_of(test);
  const auto folder = std::filesystem::path(CORDILLERA_SOURCE_DIR) / "server" / "metrics";
  const std::string source = file_text(folder / "service_metrics.h") + file_text(folder / "service_metrics.cpp");
  static const std::regex kName("\"(cordillera_[a-z_]+)\"");
  std::set<std::string> names;
  for (std::sregex_iterator at(source.begin(), source.end(), kName), end; at != end; ++at) names.insert((*at)[1]);
  EXPECT_GT(names.size(), 30u);
  for (const std::string& name : names) EXPECT_TRUE(text.types.contains(name)) << name;
}

TEST(Metrics, TheReaderSeesWhatIsWrong) {
  const std::string good = "# HELP a_total A.\n# TYPE a_total counter\na_total{b=\"c\"} 1\n";
  EXPECT_THAT(read_prometheus(good).wrong, IsEmpty());
  const std::string histogram =
      "# HELP h H.\n# TYPE h histogram\nh_bucket{le=\"1\"} 2\nh_bucket{le=\"+Inf\"} 3\nh_sum 4\nh_count 3\n";
  EXPECT_THAT(read_prometheus(histogram).wrong, IsEmpty());
  for (const std::string bad :
       {"", "a_total 1\n", "# HELP a A.\n# TYPE a counter\na 1\n", "# HELP a A.\n# TYPE a gauge\na 1", "# TYPE a gauge\na 1\n",
        "# HELP a A.\n# TYPE a gauge\na 1\na 2\n", "# HELP a A.\n# TYPE a gauge\na{b=c} 1\n",
        "# HELP a A.\n# TYPE a gauge\na{b=\"c} 1\n", "# HELP a A.\n# TYPE a gauge\na  1\n",
        "# HELP a A.\n# TYPE a gauge\na one\n", "# HELP a_total A.\n# TYPE a_total counter\na_total -1\n",
        "# HELP h H.\n# TYPE h histogram\nh_bucket{le=\"1\"} 4\nh_bucket{le=\"+Inf\"} 3\nh_sum 4\nh_count 3\n",
        "# HELP h H.\n# TYPE h histogram\nh_bucket{le=\"1\"} 2\nh_sum 4\nh_count 2\n",
        "# HELP h H.\n# TYPE h histogram\nh_bucket{le=\"+Inf\"} 3\nh_sum 4\nh_count 2\n"}) {
    EXPECT_FALSE(read_prometheus(bad).wrong.empty()) << bad;
  }
}

TEST(Metrics, CountWhatHappened) {
  TestService test;
  const std::string id = body_of(test.post("GOOD", {}, {{"prefer", "wait=200"}}))["id"];
  ASSERT_TRUE(eventually([&] { return test.service().registry().counts().ready == 1; }));
  const std::string base = "/v1/datasets/" + id;
  test.get(base + "/tiles/1/1/1.drc");
  test.get(base + "/tiles/1/1/1.drc");
  test.get(base + "/tiles/9/1/1.drc");
  const std::string failing = body_of(test.post("BAD"))["id"];
  ASSERT_TRUE(eventually([&] { return test.service().registry().counts().failed == 1; }));
  ASSERT_TRUE(eventually([&] { return metrics_of(test).sum("cordillera_builds_total") == 2; }));
  const PrometheusText text = metrics_of(test);
  EXPECT_EQ(text.sum("cordillera_http_requests_total", {{"route", "drc"}, {"status", "200"}, {"method", "GET"}}), 2);
  EXPECT_EQ(text.sum("cordillera_http_requests_total", {{"route", "drc"}, {"status", "404"}}), 1);
  EXPECT_EQ(text.sum("cordillera_http_requests_total", {{"route", "datasets"}, {"method", "POST"}}), 2);
  EXPECT_EQ(text.sum("cordillera_http_request_duration_seconds_count", {{"route", "drc"}}), 3);
  EXPECT_EQ(text.sum("cordillera_http_received_bytes_total"), 7);
  EXPECT_EQ(text.sum("cordillera_problems_total", {{"type", "tile-unknown"}}), 1);
  EXPECT_EQ(text.sum("cordillera_builds_total", {{"outcome", "ready"}}), 1);
  EXPECT_EQ(text.sum("cordillera_builds_total", {{"outcome", "failed"}}), 1);
  EXPECT_EQ(text.sum("cordillera_build_duration_seconds_count"), 2);
  EXPECT_GT(text.sum("cordillera_build_stage_seconds_total", {{"stage", "build"}}), 0);
  EXPECT_EQ(text.sum("cordillera_datasets", {{"state", "ready"}}), 1);
  EXPECT_EQ(text.sum("cordillera_datasets", {{"state", "failed"}}), 1);
  EXPECT_EQ(text.sum("cordillera_http_requests_in_flight"), 1);  // this one
  EXPECT_EQ(text.sum("cordillera_ready"), 1);
  EXPECT_GT(text.sum("cordillera_disk_size_bytes"), text.sum("cordillera_disk_free_bytes"));
  EXPECT_GT(text.sum("process_resident_memory_bytes"), 1e6);
  EXPECT_GT(text.sum("process_open_fds"), 3);
  EXPECT_EQ(text.sum("cordillera_build_info", {{"version", CORDILLERA_VERSION}}), 1);
}

/// Labels must not grow with what strangers send.
TEST(Metrics, NobodyMakesLabels) {
  TestService test;
  const std::size_t before = (test.get("/v1/none"), test.send("BREW", "/v1/datasets"), metrics_of(test).samples.size());
  for (int i = 0; i < 50; ++i) {
    test.get("/v1/none" + std::to_string(i));
    test.get("/page" + std::to_string(i));
    test.send("BREW" + std::to_string(i), "/v1/datasets");
  }
  EXPECT_LT(metrics_of(test).samples.size(), before + 60);  // a histogram of the viewer, one of the metrics
}

TEST(Metrics, TakeATokenWhereThereAreAny) {
  const access::NewToken reader = access::make_token("prometheus", access::Role::read);
  Settings settings;
  settings.serve.token_lines = reader.line;
  TestService test(settings);
  EXPECT_EQ(test.get("/metrics").status, 401);
  EXPECT_EQ(test.get("/metrics", {{"authorization", "Bearer " + reader.token}}).status, 200);
}

/// Every name in a dashboard's or an alert's expressions.
std::set<std::string> names_asked_for(const Json& json) {
  std::set<std::string> names;
  static const std::regex kName(R"((?:cordillera|process)_[a-z0-9_]+)");
  if (json.is_object() && json.contains("expr")) {
    const std::string expression = json["expr"];
    for (std::sregex_iterator at(expression.begin(), expression.end(), kName), end; at != end; ++at) names.insert(at->str());
  }
  if (json.is_structured()) {
    for (const Json& part : json) names.merge(names_asked_for(part));
  }
  return names;
}

TEST(Metrics, TheDashboardAsksForNoOthers) {
  TestService test;
  const PrometheusText text = metrics_of(test);
  const Json dashboard = Json::parse(file_text(std::filesystem::path(CORDILLERA_SOURCE_DIR) / "deploy" / "grafana.json"));
  const std::set<std::string> asked = names_asked_for(dashboard);
  EXPECT_GT(asked.size(), 20u);
  for (const char* name : {"datasets_damaged", "store_damaged_total", "changes_waiting", "tile_wait_seconds_bucket", "live_bytes",
                           "live_forgotten_total", "live_asked_total"})
    EXPECT_TRUE(asked.contains(std::string("cordillera_") + name)) << name << " is shown nowhere";
  for (const std::string& name : asked) {
    EXPECT_TRUE(!family_of(text, name).empty()) << "the dashboard asks for " << name << ", which /metrics does not have";
  }
}

}  // namespace
}  // namespace cordillera::server
