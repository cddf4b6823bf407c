#pragma once
// GETs of rasters, by http:// or https://. Redirects are not followed: where to, is told byte for byte, and looked at by who
// called.
#include <chrono>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <string_view>

namespace cordillera::server::updates {

struct Got {
  int status = 0;              ///< 0: no answer came
  std::string location;        ///< where a redirect leads, as it was sent: in a signature each escape counts
  std::string trouble;         ///< why there is no answer, or why its body is not whole; empty: all came
  std::string etag, modified;  ///< ETag and Last-Modified as they were sent; empty: they were not
  std::uint64_t length = 0;    ///< Content-Length; 0: none was sent
  std::string range;           ///< Content-Range; empty: none was sent
};

/// What else is said in a request, and how long its answer may take.
struct Terms {
  std::string etag;                   ///< for If-None-Match; empty: none
  std::chrono::seconds patience{60};  ///< without a byte
  std::string range{}, if_range{};    ///< "bytes=0-99", and the tag or date without which all is to come; empty: neither is sent
  std::optional<std::chrono::steady_clock::time_point> until{};  ///< none: however long it takes, while bytes come
  std::function<bool()> stopped{};                               ///< asked a few times a second; true: it ends as if nothing came
  std::function<bool(const Got&)> wanted{};                      ///< of a head, whether its body is taken; none: that of a 200
};

/// Gets the wanted body as it comes; false: no more.
using Take = std::function<bool(std::string_view)>;

/// address: of HTTP, with a host, and without a user's name; a "#" and what stands behind it are not sent. A certificate has to
/// be one that the system trusts.
Got http_get(const std::string& address, const Take& take, const Terms& terms = {});

/// The same one after the other: a connection is kept for the next request to its host. One thread's.
class HttpTalk {
 public:
  HttpTalk();
  ~HttpTalk();
  Got get(const std::string& address, const Take& take, const Terms& terms);

 private:
  std::string host_;
  std::unique_ptr<class HttpWire> wire_;  ///< null: there is no connection
};

}  // namespace cordillera::server::updates
