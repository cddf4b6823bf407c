#pragma once
// One GET of a raster, by http:// or https://. Redirects are not followed: where to, is told byte for byte, and looked at by who called.
#include <functional>
#include <string>
#include <string_view>

namespace cordillera::server::updates {

struct Got {
  int status = 0;        ///< 0: no answer came
  std::string location;  ///< where a redirect leads, as it was sent: in a signature each escape counts
  std::string trouble;   ///< why there is no answer, or why its body is not whole; empty: all came
};

/// address: of HTTP, with a host, and without a user's name; a "#" and what stands behind it are not sent. take: gets the body of a 200 as it
/// comes; false: no more. A certificate has to be one that the system trusts. Gives up after 60 s without a byte.
Got http_get(const std::string& address, const std::function<bool(std::string_view)>& take);

}  // namespace cordillera::server::updates
