#pragma once
// HTTP as values: the service is a function from Request to Response, and the socket is an adapter (http.h).
#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cordillera::server {

struct Request {
  std::string method = "GET";
  std::string path;                                         ///< percent-decoded, without the query
  std::vector<std::pair<std::string, std::string>> query;  ///< decoded, in the order sent
  std::map<std::string, std::string> headers;               ///< names in lower case
  /// Hands the body to the sink in pieces, until its end or until the sink says false. True if the body came to its end.
  using Sink = std::function<bool(std::string_view piece)>;
  std::function<bool(const Sink& sink)> read_body;

  std::optional<std::string> header(const std::string& lower_case_name) const {
    const auto found = headers.find(lower_case_name);
    return found == headers.end() ? std::nullopt : std::optional(found->second);
  }
};

struct Response {
  int status = 200;
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;
  /// Instead of a body: the next piece, or nothing at the end. May wait; is called from one thread.
  std::function<std::optional<std::string>()> next_piece;

  void set(const std::string& name, const std::string& value) { headers.emplace_back(name, value); }
  std::string header(std::string_view name) const {
    for (const auto& [key, value] : headers) {
      if (key == name) return value;
    }
    return "";
  }
};

/// An entity tag as it stands in a header.
inline std::string quoted(const std::string& tag) { return std::string(1, '"').append(tag).append(1, '"'); }

}  // namespace cordillera::server
