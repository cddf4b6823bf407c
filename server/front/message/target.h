#pragma once
// The target of a request line.
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cordillera::server::front {

struct Target {
  std::string path;                                        ///< percent-decoded
  std::vector<std::pair<std::string, std::string>> query;  ///< decoded, in the order sent: problems name the first bad one
  std::string authority;                                   ///< of an absolute target; goes before Host
};

/// /path?query, http://host/path?query, or * . Nothing: it is none of them, or hides a NUL. A slash that is escaped stays so: it
/// is no border between segments, neither here nor for a proxy with rules on paths.
std::optional<Target> read_target(std::string_view text);
/// HOST or HOST:PORT (RFC 3986, 3.2), without a user before it.
bool is_authority(std::string_view text);

}  // namespace cordillera::server::front
