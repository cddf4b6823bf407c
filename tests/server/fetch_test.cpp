// Addresses that rasters are fetched from: which are refused, and where a redirect leads.
#include "server/jobs/fetch.h"

#include <gtest/gtest.h>

namespace cordillera::server::updates {
namespace {

ServeSettings allowing() {
  ServeSettings settings;
  settings.source_allow = {"https://host/tiles/", "s3://bucket/tiles/"};
  return settings;
}

TEST(Fetch, NoAddressLeadsOutOfItsPrefix) {
  for (const char* address :
       {"https://host/tiles/..?x", "https://host/tiles/..#x", "https://host/tiles/..;/secret.tif", "https://host/tiles/a/..;v=1/../b", "https://host/tiles/.?x",
        "https://host/tiles/..", "https://host/tiles/../secret.tif", "https://host/tiles/./a.tif", "https://host/tiles/%2e%2e/a.tif", "https://host/tiles/..%2Fa.tif",
        "https://host/tiles/..%3b/a.tif", "https://host/tiles/..\\a.tif", "https://host/tiles/a.tif?x=\\", "https://me@host/tiles/a.tif", "https://host/tiles/a b.tif",
        "https://host/tiles/a\n.tif", "https://host/tiles/\xff.tif", "https://host/secret/a.tif", "https://host", "https://host?/tiles/", "http://host/tiles/a.tif",
        "s3://bucket/tiles/..", "s3://bucket/tiles/../a.tif", "s3://bucket/tiles/..?x", "s3://bucket/a.tif", "file:///tiles/a.tif"}) {
    const auto refused = check_address(allowing(), address);
    ASSERT_FALSE(refused) << address;
    EXPECT_EQ(refused.problem().type, "option-forbidden") << address;
  }
}

TEST(Fetch, WhatOnlyLooksLikeItIsAllowed) {
  for (const char* address :
       {"https://host/tiles/a.tif", "https://host/tiles/..a/b..c/...tif", "https://host/tiles/a;v=1/b.tif", "https://host/tiles/a.tif?sig=ab%2Fcd%3D&p=../x",
        "https://host/tiles/a.tif#/../x", "s3://bucket/tiles/a..b.tif"}) {
    EXPECT_TRUE(check_address(allowing(), address)) << address;
  }
}

TEST(Fetch, ARefusalKeepsTheSignature) {
  EXPECT_EQ(check_address(allowing(), "https://other/a.tif?sig=SECRET").problem().line().find("SECRET"), std::string::npos);
  EXPECT_EQ(without_query("https://host/a.tif?sig=SECRET"), "https://host/a.tif");
  EXPECT_EQ(without_query("https://host/a.tif#SECRET"), "https://host/a.tif");
  EXPECT_EQ(without_query("https://host/a.tif;sig=SECRET"), "https://host/a.tif");
  EXPECT_EQ(without_query("https://host/a;sig=SECRET;b/c.tif;d?sig=SECRET"), "https://host/a/c.tif");
}

/// RFC 3986, 5.4, as far as it is ours.
TEST(Fetch, RedirectsAreResolvedAgainstTheAddress) {
  const std::string from = "https://host:1/tiles/b/c.tif?q=/x";
  EXPECT_EQ(resolved(from, "ok.tif"), "https://host:1/tiles/b/ok.tif");
  EXPECT_EQ(resolved(from, "d/ok.tif?y"), "https://host:1/tiles/b/d/ok.tif?y");
  EXPECT_EQ(resolved(from, "/other/ok.tif"), "https://host:1/other/ok.tif");
  EXPECT_EQ(resolved(from, "//elsewhere/ok.tif"), "https://elsewhere/ok.tif");
  EXPECT_EQ(resolved(from, "http://elsewhere/ok.tif"), "http://elsewhere/ok.tif");
  EXPECT_EQ(resolved(from, "file:/etc/passwd"), "file:/etc/passwd");
  EXPECT_EQ(resolved(from, "?y"), "https://host:1/tiles/b/c.tif?y");
  EXPECT_EQ(resolved(from, "./ok.tif"), "https://host:1/tiles/b/ok.tif");
  EXPECT_EQ(resolved(from, "d/../ok.tif?y=/../x"), "https://host:1/tiles/b/ok.tif?y=/../x");
  EXPECT_EQ(resolved(from, "../ok.tif"), "https://host:1/tiles/ok.tif");
  EXPECT_EQ(resolved(from, "../../../../ok.tif"), "https://host:1/ok.tif") << "nothing lies above the root";
  EXPECT_EQ(resolved(from, ".."), "https://host:1/tiles/");
  EXPECT_EQ(resolved(from, "d/."), "https://host:1/tiles/b/d/");
  EXPECT_EQ(resolved(from, "HTTP://elsewhere/a/../ok.tif"), "http://elsewhere/ok.tif");
  EXPECT_EQ(resolved(from, "..;x/ok.tif"), "https://host:1/tiles/b/..;x/ok.tif") << "no dots by the standard, and refused";
  EXPECT_EQ(resolved("https://host", "ok.tif"), "https://host/ok.tif");
}

/// Of a signature each escape counts. A slash is the same in a query with and without.
TEST(Fetch, EscapesOfARedirectArePutBack) {
  const std::string from = "https://host/tiles/a.tif";
  EXPECT_EQ(resolved(from, "ok.tif?sig=a/b+c d=&x=100%"), "https://host/tiles/ok.tif?sig=a/b%2Bc%20d=&x=100%25");
  EXPECT_EQ(resolved(from, "a+b c.tif"), "https://host/tiles/a+b%20c.tif");
  EXPECT_EQ(resolved(from, "h\xc3\xb6he.tif"), "https://host/tiles/h%C3%B6he.tif");
  EXPECT_EQ(resolved(from, "a.tif?sig=a%2Fb+c"), "https://host/tiles/a.tif?sig=a%2Fb+c");
}

}  // namespace
}  // namespace cordillera::server::updates
