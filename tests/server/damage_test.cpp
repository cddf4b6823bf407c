// What a damaged disk makes of answers.
#include <gtest/gtest.h>

#include "pipeline/store/sqlite.h"
#include "tests/server/fixture.h"

namespace cordillera::server {
namespace {

class DamagedDataset : public testing::Test {
 protected:
  void SetUp() override {
    id_ = body_of(service_.post("GOOD", {{"name", "one"}}, {{"prefer", "wait=60"}}))["id"];
    ASSERT_EQ(get("tiles/0/0/0.drc").status, 200);
  }
  Response get(const std::string& path) { return service_.get("/v1/datasets/" + id_ + "/" + path); }
  /// What the reader has open does not change under it in life; here the service is started anew.
  void change(const std::string& sql) {
    service_.stop();
    pipeline::Database((service_.data() / "datasets" / id_ / kStoreFile).string(), pipeline::Database::Mode::create).execute(sql);
    service_.start();
  }
  TestService service_;
  std::string id_;
};

TEST_F(DamagedDataset, IsToldToWhoAsksAndToTheOperator) {
  EXPECT_FALSE(body_of(service_.get("/readyz")).contains("damaged_datasets"));
  change("UPDATE tiles SET drc = (SELECT drc FROM tiles WHERE level = 1) WHERE level = 0");
  const Response answer = get("tiles/0/0/0.drc");
  EXPECT_EQ(answer.status, 500);
  EXPECT_EQ(slug_of(answer), "store-damaged");
  EXPECT_EQ(answer.body.find(service_.data().string()), std::string::npos) << "where it lies is nobody's business";
  EXPECT_EQ(get("tiles/1/1/1.drc").status, 200) << "the rest is served";
  const Response ready = service_.get("/readyz");
  EXPECT_EQ(ready.status, 200) << "a dataset that is damaged keeps nobody from posting another";
  EXPECT_EQ(body_of(ready).value("damaged_datasets", 0), 1);
  const std::string metrics = service_.get("/metrics").body;
  EXPECT_NE(metrics.find("cordillera_store_damaged_total 1\n"), std::string::npos);
  EXPECT_NE(metrics.find("cordillera_datasets_damaged 1\n"), std::string::npos);
  EXPECT_NE(metrics.find("cordillera_problems_total{type=\"store-damaged\"} 1\n"), std::string::npos);
  service_.send("DELETE", "/v1/datasets/" + id_);
  EXPECT_FALSE(body_of(service_.get("/readyz")).contains("damaged_datasets"));
}

TEST_F(DamagedDataset, IsToldWhereItsManifestIsAnothersToo) {
  change("UPDATE meta SET value = CAST(value || 'x' AS BLOB) WHERE key = 'manifest'");
  EXPECT_EQ(slug_of(get("manifest.json")), "store-damaged");
  EXPECT_EQ(slug_of(get("tiles/0/0/0.drc")), "store-damaged");
}

}  // namespace
}  // namespace cordillera::server
