#pragma once
// HTTP/1.1 on one side, the API function on the other: the socket.
#include <cstddef>
#include <memory>
#include <string>

#include "proto/result.h"
#include "server/api/api.h"
#include "server/front/message/limits.h"
#include "server/front/served.h"

namespace cordillera::server::front {

class HttpServer {
 public:
  /// listen: HOST:PORT; port 0 takes any free one. The API must outlive the server.
  static proto::Result<std::unique_ptr<HttpServer>> bind(Api& api, const std::string& listen, const HttpLimits& limits = {},
                                                         OnServed on_served = {});
  virtual ~HttpServer() = default;
  virtual int port() const = 0;
  /// Open now.
  virtual std::size_t connections() const = 0;
  /// Bytes of large answers that clients have yet to read.
  virtual std::size_t unsent_bytes() const = 0;
  /// Serves until stop().
  virtual void run() = 0;
  /// From any thread, before run() too. Requests under way are answered, within HttpLimits::drain; streams end.
  virtual void stop() = 0;
};

}  // namespace cordillera::server::front
