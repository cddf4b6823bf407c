#pragma once
// The socket: cpp-httplib on one side, the API function on the other. The only file behind this header knows httplib.
#include <memory>
#include <string>

#include "proto/result.h"
#include "server/api.h"

namespace cordillera::server {

class HttpServer {
 public:
  /// listen: HOST:PORT; port 0 takes any free one.
  static proto::Result<std::unique_ptr<HttpServer>> bind(Api& api, const std::string& listen);
  virtual ~HttpServer() = default;
  virtual int port() const = 0;
  /// Serves until stop().
  virtual void run() = 0;
  /// From another thread than run(); before run() it waits for it. Requests under way are answered; streams end.
  virtual void stop() = 0;
};

}  // namespace cordillera::server
