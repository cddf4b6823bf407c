#pragma once
// The target of a request line.
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace cordillera::server::front {

struct Target {
  std::string path;                                         ///< percent-decoded
  std::vector<std::pair<std::string, std::string>> query;  ///< decoded, in the order sent: problems name the first bad one
  std::string authority;                                    ///< of an absolute target; goes before Host
};

/// /path?query, http://host/path?query, or * . Nothing: it is none of them, or hides a NUL.
std::optional<Target> read_target(std::string_view text);

}  // namespace cordillera::server::front
