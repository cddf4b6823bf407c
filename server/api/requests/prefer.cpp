#include "server/api/requests/prefer.h"

#include <algorithm>
#include <string_view>

#include "proto/letters.h"
#include "proto/numbers.h"

namespace cordillera::server {

std::optional<std::chrono::seconds> preferred_wait(const Request& request) {
  const auto prefer = request.headers.find("prefer");
  if (prefer == request.headers.end()) return std::nullopt;
  for (std::string_view rest = prefer->second; !rest.empty();) {
    const std::string_view whole = rest.substr(0, rest.find(',')), one = whole.substr(0, whole.find(';'));
    rest.remove_prefix(std::min(rest.size(), whole.size() + 1));
    const auto equals = one.find('=');
    if (!proto::same_letters(proto::trimmed(one.substr(0, equals)), "wait")) continue;
    if (equals == one.npos) return std::chrono::seconds::max();
    std::string_view digits = proto::trimmed(one.substr(equals + 1));
    if (digits.size() >= 2 && digits.front() == '"' && digits.back() == '"') digits = digits.substr(1, digits.size() - 2);
    if (digits.empty() || digits.find_first_not_of("0123456789") != digits.npos) return std::nullopt;
    const auto seconds = proto::number<int>(digits);
    return seconds ? std::chrono::seconds(*seconds) : std::chrono::seconds::max();  // more than fit into an int
  }
  return std::nullopt;
}

}  // namespace cordillera::server
