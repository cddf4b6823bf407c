#include "server/access/client_address.h"

#include <algorithm>

namespace cordillera::server::access {
namespace {

std::string_view trimmed(std::string_view text) {
  const auto first = text.find_first_not_of(" \t");
  if (first == text.npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

}  // namespace

std::string client_address(const Request& request, const std::vector<std::string>& trusted_proxies) {
  const auto trusted = [&](std::string_view address) {
    return std::find(trusted_proxies.begin(), trusted_proxies.end(), address) != trusted_proxies.end();
  };
  const auto forwarded = request.header("x-forwarded-for");
  if (!forwarded || !trusted(request.client)) return request.client;
  std::string_view rest = *forwarded;
  std::string client = request.client;
  while (!rest.empty()) {
    const auto comma = rest.rfind(',');
    const std::string_view last = trimmed(comma == rest.npos ? rest : rest.substr(comma + 1));
    if (!looks_like_address(last)) return client;
    client = std::string(last);
    if (!trusted(last) || comma == rest.npos) return client;
    rest = rest.substr(0, comma);
  }
  return client;
}

bool is_loopback(std::string_view host) {
  if (host.size() > 2 && host.front() == '[' && host.back() == ']') host = host.substr(1, host.size() - 2);
  return host == "localhost" || host == "::1" || (host.starts_with("127.") && looks_like_address(host));
}

std::string host_of(std::string_view authority) {
  if (authority.starts_with('[')) return std::string(authority.substr(1, authority.find(']') - 1));
  const auto colon = authority.rfind(':');
  return std::string(authority.substr(0, authority.find(':') == colon ? colon : authority.npos));
}

bool looks_like_address(std::string_view text) {
  return !text.empty() && text.size() <= 45 && text.find_first_not_of("0123456789abcdefABCDEF.:") == text.npos;
}

}  // namespace cordillera::server::access
