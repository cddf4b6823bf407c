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

TEST(Gzip, IsNotGivenToOthers) {
  EXPECT_FALSE(accepts_gzip(Request{}));
  for (const char* header : {"", "identity", "br", "gzip;q=0", "gzip; q=0.0, *", "*;q=0", "gzipped"})
    EXPECT_FALSE(accepted(header)) << header;
}

}  // namespace
}  // namespace cordillera::server
