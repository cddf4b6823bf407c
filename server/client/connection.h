#pragma once
// A connection to a service, kept open between calls. The only file of the commands that knows the HTTP library.
#include <chrono>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "server/client/service_address.h"

namespace cordillera::server::client {

struct Call {
  std::string method = "GET";  ///< GET, HEAD, POST, PATCH or DELETE
  std::string path;            ///< below the service's address, encoded: "/v1/datasets?name=a.tif"
  std::vector<std::pair<std::string, std::string>> headers = {};
  std::uint64_t length = 0;                       ///< of the body of a POST or PATCH
  std::string type = "application/octet-stream";  ///< of the body
  /// Bytes of the body from an offset on, at most so many; none: they cannot be read, and the call is given up.
  std::function<std::optional<std::string_view>(std::uint64_t from, std::size_t most)> body = {};
  /// Takes the body of a 200 to a GET as it comes; false: no more of it. Without it the body is in Answer::body. A GET with
  /// conditions cannot be sent: the library waits for a body behind a 304 without a length. A HEAD can.
  std::function<bool(std::string_view piece)> take = {};
  std::chrono::seconds patience{60};  ///< without a byte
};

struct Answer {
  int status = 0;                              ///< 0: none came
  std::string trouble;                         ///< why what came is not whole, or nothing came
  bool reached = true;                         ///< false: no connection could be made
  std::map<std::string, std::string> headers;  ///< names in lower case
  std::string body;

  bool whole(int wanted) const { return status == wanted && trouble.empty(); }
  std::string header(const std::string& lower_case_name) const {
    const auto found = headers.find(lower_case_name);
    return found == headers.end() ? "" : found->second;
  }
};

/// For one thread. Redirects are not followed: a token is shown to nobody else.
class Connection {
 public:
  explicit Connection(const ServiceAddress& place);
  ~Connection();
  Answer send(const Call& call);

 private:
  struct State;
  std::unique_ptr<State> state_;
};

}  // namespace cordillera::server::client
