#pragma once
// HTTP as values: the service is a function from Request to Response, and the socket is an adapter (http.h).
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

#include "server/http/role.h"

namespace cordillera::server {

namespace metrics {
struct KeptCounts;
}

struct Request {
  std::string method = "GET";
  std::string path;                                        ///< percent-decoded, without the query
  std::vector<std::pair<std::string, std::string>> query;  ///< decoded, in the order sent
  std::map<std::string, std::string> headers;              ///< names in lower case
  /// Hands the body to the sink in pieces, until its end or until the sink says false. True if the body came to its end.
  using Sink = std::function<bool(std::string_view piece)>;
  std::function<bool(const Sink& sink)> read_body;
  /// Bytes of the body so far as they came; null: as it is handed on.
  std::shared_ptr<std::uint64_t> sent;
  /// Becomes true where the body is not what its Content-Encoding says; null: it has none.
  std::shared_ptr<bool> misread;
  std::string client;    ///< whose request it is: the other end of the connection, or whom a trusted proxy names
  std::string id;        ///< names the request in answers and logs; the API gives it
  access::Identity who;  ///< filled in by the API, as id is
  bool waited = false;   ///< for what it asks for: it is answered with what there is
  /// Of one that waited for an archive: when it waits no longer.
  std::optional<std::chrono::steady_clock::time_point> wait_ends;

  std::optional<std::string> header(const std::string& lower_case_name) const {
    const auto found = headers.find(lower_case_name);
    return found == headers.end() ? std::nullopt : std::optional(found->second);
  }
};

/// Whether who waits for an answer waits on. none: the answer is to come now, whatever there is to say.
enum class Patience : std::uint8_t { none, more };

struct Response {
  int status = 200;
  std::vector<std::pair<std::string, std::string>> headers;
  std::string body;
  std::shared_ptr<const std::string> shared;  ///< instead of body: what other answers send too
  /// Where what is made of these bytes may be kept, under a name: beside what they are of, with which it goes. Null: nowhere.
  using Keep =
      std::function<std::shared_ptr<const std::string>(const std::string& name, const std::function<std::string()>& make)>;
  Keep keep;
  /// Everybody who asks for this path without a token gets the same, as long as Api::state() is this.
  std::optional<std::uint64_t> same_while;
  std::shared_ptr<const metrics::KeptCounts> counts;  ///< of such an answer
  std::shared_ptr<const std::string> lines;           ///< headers as they stand on the wire, before the others
  std::string problem;                                ///< slug of what went wrong; empty: nothing
  bool counted = false;                               ///< the API has told the metrics of it
  /// Instead of a body: the next piece, or nothing at the end. An empty piece: none yet, to be asked again when something has
  /// changed (Api::on_change) or a second later. Never waits.
  std::function<std::optional<std::string>()> next_piece;
  std::optional<std::uint64_t> length;  ///< bytes of all pieces; then none of them is empty
  /// Instead of all else: an answer that is still to come, asked for in the same way.
  using Later = std::function<std::optional<Response>(Patience patience)>;
  Later later;
  /// Instead of all else but headers: what was waited for may be there, and the API is asked once more. It then gives `rest`.
  bool anew = false;
  std::optional<std::chrono::steady_clock::time_point> wait_ends;  ///< what the request that is asked anew is told
  /// Instead of all else: makes the answer. It may take as long as any request, so not on the thread that asked `later`.
  std::function<Response()> rest;

  const std::string& bytes() const { return shared ? *shared : body; }
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
