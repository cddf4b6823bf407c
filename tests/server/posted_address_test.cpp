// Whether a raster at an address is read where it stands or copied: what the request says of it, and what the operator.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fixture.h"

namespace cordillera::server {
namespace {

/// What the operator said of build=; empty: nothing. Nobody answers at the address.
Settings told(const std::string& build) {
  Settings settings;
  settings.serve.source_allow = {"http://127.0.0.1:1/"};
  if (!build.empty()) settings.build.set_build(build);
  return settings;
}

/// "there" is lazy, "copied" is not, unless it says otherwise; or a problem with the parameter that it names.
std::string made(TestService& test, Given query) {
  query.emplace_back("source", "http://127.0.0.1:1/dem.tif");
  const Response answer = test.post("", query);
  const Json said = body_of(answer);
  if (answer.status != 202) return slug_of(answer) + " " + said.value("parameter", "");
  const auto row = test.service().registry().find(said.value("id", ""));
  if (!row->address.empty()) return is_lazy(*row) ? "there" : "there, full";
  return is_lazy(*row) ? "copied, lazy" : "copied";
}

/// What came of a query where the operator said nothing, full and lazy.
struct Case {
  Given query;
  std::string without, full, lazy;
};

TEST(PostedAddress, IsReadWhereItStandsUnlessItIsToBeCopied) {
  const std::string conflict = "options-conflict ";
  const Case cases[] = {
      {{}, "there", "copied", "there"},
      {{{"updates", "0"}}, "there", "there", "there"},
      {{{"updates", "1"}}, "copied", "copied", "copied, lazy"},
      {{{"build", "lazy"}}, "there", "there", "there"},
      {{{"build", "full"}}, "copied", "copied", "copied"},
      {{{"build", "lazy"}, {"updates", "1"}}, "copied, lazy", "copied, lazy", "copied, lazy"},
      {{{"build", "full"}, {"updates", "0"}}, conflict + "source", conflict + "source", conflict + "source"},
      {{{"keep", "0.5"}}, "copied", "copied", "copied"},
      {{{"provisional", "0"}}, "copied", "copied", "copied"},
      {{{"keep", "0.5"}, {"updates", "0"}}, conflict + "source", conflict + "source", conflict + "source"},
      {{{"dry_run", "1"}}, conflict + "updates", conflict + "updates", conflict + "updates"},
      {{{"keep", "0.5"}, {"build", "lazy"}}, conflict + "build", conflict + "build", conflict + "build"},
      {{{"dry_run", "1"}, {"build", "lazy"}}, conflict + "dry_run", conflict + "dry_run", conflict + "dry_run"},
  };
  TestService without(told("")), full(told("full")), lazy(told("lazy"));
  for (const Case& row : cases) {
    std::string words;
    for (const auto& [name, value] : row.query) words += name + "=" + value + " ";
    EXPECT_EQ(made(without, row.query), row.without) << words;
    EXPECT_EQ(made(full, row.query), row.full) << words;
    EXPECT_EQ(made(lazy, row.query), row.lazy) << words;
  }
}

TEST(PostedAddress, IsCopiedWhereTheOperatorWantsNoProvisionalTiles) {
  Settings settings = told("");
  settings.build.set_provisional(false);
  TestService test(settings);
  EXPECT_EQ(made(test, {}), "copied");
  EXPECT_EQ(made(test, {{"provisional", "1"}}), "there");
}

/// A key that was used without a word of build= is that of build=lazy, and not of a copy.
TEST(PostedAddress, IsOneWithItsKey) {
  TestService test(told(""));
  const auto post = [&](const Given& more) {
    Given query = more;
    query.emplace_back("source", "http://127.0.0.1:1/dem.tif");
    return test.post("", query, {{"idempotency-key", "dem"}});
  };
  const std::string id = body_of(post({})).value("id", "");
  EXPECT_EQ(body_of(post({})).value("id", ""), id);
  EXPECT_EQ(body_of(post({{"build", "lazy"}})).value("id", ""), id);
  EXPECT_EQ(slug_of(post({{"updates", "1"}})), "idempotency-key-reused");
  EXPECT_EQ(slug_of(post({{"build", "full"}})), "idempotency-key-reused");
}

}  // namespace
}  // namespace cordillera::server
