#pragma once
// One GET of a raster, by http:// or https://. Redirects are not followed: where to, is told byte for byte, and looked at by who called.
#include <chrono>
#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace cordillera::server::updates {

struct Got {
  int status = 0;        ///< 0: no answer came
  std::string location;  ///< where a redirect leads, as it was sent: in a signature each escape counts
  std::string trouble;   ///< why there is no answer, or why its body is not whole; empty: all came
  std::string etag, modified;  ///< ETag and Last-Modified as they were sent; empty: they were not
  std::uint64_t length = 0;    ///< Content-Length; 0: none was sent
};

/// Of a request that only asks whether something has changed.
struct Terms {
  std::string etag;  ///< for If-None-Match; empty: none
  std::chrono::seconds patience{60};  ///< without a byte
};

/// address: of HTTP, with a host, and without a user's name; a "#" and what stands behind it are not sent. take: gets the body of a 200 as it
/// comes; false: no more. A certificate has to be one that the system trusts.
Got http_get(const std::string& address, const std::function<bool(std::string_view)>& take, const Terms& terms = {});

}  // namespace cordillera::server::updates
