// Addresses that rasters are fetched from: which are refused, where a redirect leads, and what is asked for on the way.
#include "server/fetch/fetch.h"

#include <gtest/gtest.h>

#include <future>
#include <stdexcept>
#include <thread>

#include "server/api/api_updates.h"
#include "server/fetch/addresses.h"
#include "server/fetch/apart.h"
#include "server/fetch/http_get.h"
#include "tests/server/fixture.h"
#include "tests/server/raster_host.h"

namespace cordillera::server::updates {
namespace {

ServeSettings allowing() {
  ServeSettings settings;
  settings.source_allow = {"https://host/tiles/", "s3://bucket/tiles/"};
  return settings;
}

TEST(Fetch, NoAddressLeadsOutOfItsPrefix) {
  for (const char* address :
       {"https://host/tiles/..?x", "https://host/tiles/..#x", "https://host/tiles/..;/secret.tif",
        "https://host/tiles/a/..;v=1/../b", "https://host/tiles/.?x", "https://host/tiles/..", "https://host/tiles/../secret.tif",
        "https://host/tiles/./a.tif", "https://host/tiles/%2e%2e/a.tif", "https://host/tiles/..%2Fa.tif",
        "https://host/tiles/..%3b/a.tif", "https://host/tiles/..\\a.tif", "https://host/tiles/a.tif?x=\\",
        "https://me@host/tiles/a.tif", "https://host/tiles/a b.tif", "https://host/tiles/a\n.tif", "https://host/tiles/\xff.tif",
        "https://host/secret/a.tif", "https://host", "https://host?/tiles/", "http://host/tiles/a.tif",
        // What ends a text for one program and not for another, and escapes for who decodes twice.
        "https://host/tiles/..%00/x", "https://host/tiles/..%09/x", "https://host/tiles/a%0a.tif", "https://host/tiles/a%7F.tif",
        "https://host/tiles/..%20/x", "https://host/tiles/%252e%252e/x", "https://host/tiles/%25252E./x",
        "https://host/tiles/..%252fx", "https://host/tiles/..%255cx", "https://host/tiles/..%253bx",
        "https://host/tiles/..%2500/x", "https://host/tiles/%2525252525252e%2e/x", "s3://bucket/tiles/%252e%252e/x",
        "s3://bucket/tiles/..%00/x", "s3://bucket/tiles/..", "s3://bucket/tiles/../a.tif", "s3://bucket/tiles/..?x",
        "s3://bucket/a.tif", "file:///tiles/a.tif"}) {
    const auto refused = check_address(allowing(), address);
    ASSERT_FALSE(refused) << address;
    EXPECT_EQ(refused.problem().type, "option-forbidden") << address;
  }
}

TEST(Fetch, WhatOnlyLooksLikeItIsAllowed) {
  for (const char* address : {"https://host/tiles/a.tif", "https://host/tiles/..a/b..c/...tif", "https://host/tiles/a;v=1/b.tif",
                              "https://host/tiles/a.tif?sig=ab%2Fcd%3D&p=../x", "https://host/tiles/a.tif#/../x",
                              "s3://bucket/tiles/a..b.tif", "https://host/tiles/a%20b%C3%A9.tif", "https://host/tiles/100%25.tif",
                              "https://host/tiles/100%25/a%2520b.tif", "https://host/tiles/a.tif?sig=%252e%00"}) {
    EXPECT_TRUE(check_address(allowing(), address)) << address;
  }
}

TEST(Fetch, ARasterIsCalledAsItsAddressReads) {
  EXPECT_EQ(name_in("https://host/tiles/%C3%A9l%C3%A9v%20a.tif?x=%41"), "\xc3\xa9l\xc3\xa9v a.tif");
  EXPECT_EQ(name_in("https://host/tiles/100%25.tif;x=1"), "100%.tif");
  EXPECT_EQ(name_in("https://host/tiles/%E9.tif"), "%E9.tif") << "no UTF-8";
  EXPECT_EQ(name_in("https://host/tiles/"), "raster");
}

TEST(Fetch, WhatHasToBeEscapedIsSaid) {
  for (const char* address : {"https://host/tiles/a b.tif", "https://host/tiles/me@home/a.tif", "s3://bucket/tiles/a b.tif"})
    EXPECT_NE(check_address(allowing(), address).problem().detail.find("a blank is %20 and an @ is %40"), std::string::npos)
        << address;
  EXPECT_EQ(check_address(allowing(), "https://other/a b.tif").problem().detail,
            "the operator does not allow fetching from https://other/a b.tif");
}

TEST(Fetch, ARefusalKeepsTheSignature) {
  EXPECT_EQ(check_address(allowing(), "https://other/a.tif?sig=SECRET").problem().line().find("SECRET"), std::string::npos);
  // It stands with the dataset, for everybody who may read that.
  EXPECT_EQ(check_address(allowing(), "https://other/a.tif").problem().line().find("https://host/tiles/"), std::string::npos);
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

/// Of a signature each escape counts. What stands in no address gets escapes.
TEST(Fetch, EscapesOfARedirectStayAndBlanksGetSome) {
  const std::string from = "https://host/tiles/a.tif";
  EXPECT_EQ(resolved(from, "a%20b.tif?sig=a%2Fb%26c%3D+d&x=100%25"), "https://host/tiles/a%20b.tif?sig=a%2Fb%26c%3D+d&x=100%25");
  EXPECT_EQ(resolved(from, "a b%26c.tif?x= "), "https://host/tiles/a%20b%26c.tif?x=%20");
  EXPECT_EQ(resolved(from, "h\xc3\xb6he.tif"), "https://host/tiles/h%C3%B6he.tif");
  EXPECT_EQ(resolved(from, "a.tif?x=100%"), "https://host/tiles/a.tif?x=100%");
}

class Fetched : public testing::Test {
 protected:
  /// What came of it: the raster's bytes, or the problem's name.
  std::string fetch(const std::string& address, const std::vector<std::string>& prefixes) {
    ServeSettings settings;
    settings.source_allow = prefixes;
    limits::Space space([] { return std::nullopt; }, 5);
    const std::filesystem::path file = folder_.path() / "raster";
    std::filesystem::remove(file);
    const auto fetched = fetcher(settings, space).whole(address, file, stop_);
    EXPECT_EQ(std::filesystem::exists(file), fetched.ok());
    EXPECT_FALSE(std::filesystem::exists(file.string() + ".part"));
    said_ = fetched ? "" : fetched.problem().detail;
    return fetched ? file_text(file) : fetched.problem().type;
  }
  std::string fetch(const std::string& address, const std::string& prefix) {
    return fetch(address, std::vector<std::string>{prefix});
  }
  std::string fetch(const RasterHost& host, const std::string& target) {
    return fetch(host.address() + target, host.address() + "/dems/");
  }

  const TempFolder folder_;
  std::atomic<bool> stop_{false};
  std::string said_;
};

TEST_F(Fetched, ARedirectIsAskedForAsItWasSent) {
  RasterHost host;
  const std::string signed_one = "/dems/b%20c.tif?sig=a%2Fb%26c%3D%2B&x=1+2&y=100%25",
                    last = "/dems/d;v=%26.tif?X-Amz-Credential=K%2F20261125%2Fs3";
  host.leads("/dems/a.tif", signed_one);
  host.leads(signed_one, "d;v=%26.tif?X-Amz-Credential=K%2F20261125%2Fs3");
  host.has(last, "the raster");
  EXPECT_EQ(fetch(host, "/dems/a.tif#part"), "the raster") << said_;
  EXPECT_EQ(host.asked(), (std::vector<std::string>{"/dems/a.tif", signed_one, last}));
}

TEST_F(Fetched, EachHopIsHeldAgainstTheList) {
  RasterHost host;
  host.leads("/dems/out.tif", "/private/a.tif");
  host.leads("/dems/hidden.tif", "%2e%2e/private/a.tif");
  host.leads("/dems/slash.tif", "..%2Fprivate/a.tif");
  host.leads("/dems/host.tif", "http://127.0.0.1:1/dems/a.tif");
  host.has("/private/a.tif", "a secret");
  for (const char* name : {"out", "hidden", "slash", "host"})
    EXPECT_EQ(fetch(host, "/dems/" + std::string(name) + ".tif"), "option-forbidden") << name;
  EXPECT_EQ(said_.find("127.0.0.1:1"), std::string::npos) << "where it leads is the host's secret: " << said_;
  for (const std::string& target : host.asked()) EXPECT_TRUE(target.starts_with("/dems/")) << target;
}

TEST_F(Fetched, ARedirectToAnObjectIsNotFollowed) {
  RasterHost host;
  host.leads("/dems/object.tif", "s3://127.0.0.1/a.tif");
  EXPECT_EQ(fetch(host, "/dems/object.tif"), "option-forbidden");
  EXPECT_EQ(fetch(host.address() + "/dems/object.tif", {host.address() + "/dems/", "s3://127.0.0.1/"}), "source-unreachable");
  EXPECT_NE(said_.find("neither http nor https"), std::string::npos) << said_;
}

TEST_F(Fetched, ACircleEnds) {
  RasterHost host;
  host.leads("/dems/a.tif", "b.tif");
  host.leads("/dems/b.tif", "a.tif");
  EXPECT_EQ(fetch(host, "/dems/a.tif"), "source-unreachable");
  EXPECT_EQ(host.asked().size(), 6u) << "the address, and five redirects";
}

TEST_F(Fetched, WhatIsNotWholeIsSaid) {
  RasterHost host;
  host.breaks_off("/dems/short.tif", "half of");
  host.has("/dems/empty.tif", "");
  EXPECT_EQ(fetch(host, "/dems/short.tif"), "source-unreachable");
  EXPECT_NE(said_.find("it broke off after 7 bytes"), std::string::npos) << said_;
  EXPECT_EQ(fetch(host, "/dems/empty.tif"), "source-unreachable");
  EXPECT_EQ(fetch(host, "/dems/none.tif"), "source-unreachable");
  EXPECT_NE(said_.find("it answers 404"), std::string::npos) << said_;
  EXPECT_EQ(fetch("http://127.0.0.1:1/a.tif", "http://127.0.0.1:1/"), "source-unreachable");
  EXPECT_NE(said_.find("no connection could be made"), std::string::npos) << said_;
  EXPECT_EQ(fetch("http://127.0.0.1:http/a.tif", "http://127.0.0.1:"), "source-unreachable") << "a port is a number";
}

TEST_F(Fetched, WhoCancelsNeedsNoMore) {
  RasterHost host;
  host.has("/dems/a.tif", "the raster");
  stop_ = true;
  EXPECT_EQ(fetch(host, "/dems/a.tif"), "cancelled");
}

TEST_F(Fetched, WhoCancelsDoesNotWaitForAHostThatSendsNothing) {
  RasterHost host;
  host.hangs("/dems/a.tif");
  ServeSettings settings;
  settings.source_allow = {host.address() + "/dems/"};
  limits::Space space([] { return std::nullopt; }, 5);
  const Fetch fetch = fetcher(settings, space);
  for (const auto& into : {fetch.whole, fetch.beginning}) {
    stop_ = false;
    const auto before = host.asked().size();
    std::atomic<bool> over = false;
    std::thread ends([&] {
      while (host.asked().size() == before && !over) std::this_thread::yield();
      stop_ = true;
    });
    const auto fetched = into(host.address() + "/dems/a.tif", folder_.path() / "raster", stop_);
    over = true;
    ends.join();
    ASSERT_FALSE(fetched);
    EXPECT_EQ(fetched.problem().type, "cancelled");
  }
}

/// Else it would hold the place of other builds as long as it likes.
TEST_F(Fetched, AHostThatDripsIsLeft) {
  RasterHost host;
  host.drips("/dems/a.tif");
  host.has("/dems/small.tif", "the raster");
  ServeSettings settings;
  settings.source_allow = {host.address() + "/dems/"};
  settings.limits.min_rate = 1'000'000'000;  // byte by byte nobody is so fast
  settings.limits.build_seconds = 20;        // else it would come to no end here
  limits::Space space([] { return std::nullopt; }, 5);
  const Fetch fetch = fetcher(settings, space, std::chrono::milliseconds(100));
  for (const auto& into : {fetch.whole, fetch.beginning}) {
    const auto fetched = into(host.address() + "/dems/a.tif", folder_.path() / "raster", stop_);
    ASSERT_FALSE(fetched);
    EXPECT_EQ(fetched.problem().type, "source-unreachable");
    EXPECT_NE(fetched.problem().detail.find("less than 1000000000 bytes a second"), std::string::npos);
    EXPECT_TRUE(into(host.address() + "/dems/small.tif", folder_.path() / "raster", stop_)) << "it need not wait at all";
  }
}

TEST_F(Fetched, AnAnswerHasAnEndHoweverOftenAByteComes) {
  RasterHost host;
  host.drips("/dems/a.tif");
  Terms terms;
  std::size_t came = 0;
  const auto take = [&](std::string_view piece) {
    terms.until = std::chrono::steady_clock::now();  // the time is over while bytes come
    came += piece.size();
    return true;
  };
  const Got got = http_get(host.address() + "/dems/a.tif", take, terms);
  EXPECT_NE(got.trouble, "");
  EXPECT_GT(came, 0u);
}

TEST(Apart, WhatNobodyWantsAnyMoreIsLeftBehind) {
  EXPECT_EQ(apart<int>([] { return 7; }, [] { return false; }), 7);
  EXPECT_THROW(apart<int>([]() -> int { throw std::runtime_error("none"); }, [] { return false; }), std::runtime_error);
  std::promise<void> end, ended;
  const auto work = [wait = std::make_shared<std::future<void>>(end.get_future()), &ended] {
    wait->wait();
    ended.set_value_at_thread_exit();
    return 7;
  };
  EXPECT_EQ(apart<int>(work, [] { return true; }), std::nullopt) << "it is under way still";
  end.set_value();
  ended.get_future().wait();
}

TEST_F(Fetched, ACertificateHasToBeTrustedAndOfThisName) {
  const OwnCertificate certificate(folder_.path(), "DNS:localhost");
  RasterHost host(certificate);
  const std::string redirect = "/dems/b.tif?sig=%2F%26";
  host.leads("/dems/a.tif", redirect);
  host.has(redirect, std::string(3'000'000, 'r'));
  EXPECT_EQ(fetch(host, "/dems/a.tif"), "source-unreachable");
  EXPECT_NE(said_.find("no TLS could be agreed on"), std::string::npos) << said_;
  {
    const TrustedFile trust(certificate.file());
    EXPECT_TRUE(fetch(host, "/dems/a.tif") == std::string(3'000'000, 'r')) << said_;
    const std::string number = "https://127.0.0.1" + host.address().substr(host.address().rfind(':'));
    EXPECT_EQ(fetch(number + "/dems/a.tif", number + "/dems/"), "source-unreachable") << "the certificate is of another name";
  }
  EXPECT_EQ(host.asked(), (std::vector<std::string>{"/dems/a.tif", redirect}));
}

}  // namespace
}  // namespace cordillera::server::updates
