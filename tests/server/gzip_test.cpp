#include "server/http/gzip.h"

#include <gtest/gtest.h>

namespace cordillera::server {
namespace {

bool accepted(const std::string& header) {
  Request request;
  request.headers["accept-encoding"] = header;
  return accepts_gzip(request);
}

TEST(Gzip, IsGivenToWhoAcceptsIt) {
  for (const char* header : {"gzip", "GZIP", "deflate, gzip", "br;q=1.0, gzip;q=0.8, *;q=0.1", "x-gzip", "*", "gzip ; q=0.001",
                             "gzip, identity;q=0"}) {
    EXPECT_TRUE(accepted(header)) << header;
  }
}

TEST(Gzip, TheCodingThatIsPreferredIsGiven) {
  const std::pair<const char*, const char*> rows[] = {{"gzip, br", "br"},
                                                      {"br;q=0.5, gzip;q=0.5", "br"},
                                                      {"gzip;q=0.5, br;q=0.1", "gzip"},
                                                      {"br;q=0.5, *;q=0.8", "gzip"},
                                                      {"*", "br"},
                                                      {"*;q=0.1", "br"},
                                                      {"identity, gzip;q=0.5", ""},
                                                      {"identity;q=0.5, gzip;q=0.5, br;q=0", "gzip"},
                                                      {"identity;q=0.5, br;q=0.4, *;q=0", ""},
                                                      {"br;q=0.001", "br"},
                                                      {"identity;q=0, gzip;q=0.1", "gzip"},
                                                      {"identity;q=0", ""},
                                                      {"br;q=0, gzip;q=0", ""}};
  for (const auto& [header, coding] : rows) {
    Request request;
    request.headers["accept-encoding"] = header;
    EXPECT_EQ(preferred_coding(request, {"br", "gzip"}), coding) << header;
  }
  EXPECT_EQ(preferred_coding(Request{}, {"br", "gzip"}), "");
}

TEST(Gzip, IsNotGivenToOthers) {
  EXPECT_FALSE(accepts_gzip(Request{}));
  for (const char* header : {"", "identity", "br", "gzip;q=0", "gzip; q=0.0, *", "*;q=0", "gzipped", "identity, gzip;q=0.5"})
    EXPECT_FALSE(accepted(header)) << header;
}

}  // namespace
}  // namespace cordillera::server
