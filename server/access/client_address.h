#pragma once
// Whose request it is where a proxy stands before the service.
#include <string>
#include <string_view>
#include <vector>

#include "server/message.h"

namespace cordillera::server::access {

/// The address that the request came from. Where that is a trusted proxy's, the last one in X-Forwarded-For that is none: what
/// stands left of it was written by strangers.
std::string client_address(const Request& request, const std::vector<std::string>& trusted_proxies);

/// 127.0.0.0/8, ::1 or localhost; brackets do not matter.
bool is_loopback(std::string_view host);
/// HOST of HOST:PORT, without the brackets of an IPv6 address.
std::string host_of(std::string_view authority);
/// Digits, dots, colons and hex letters as an address has them.
bool looks_like_address(std::string_view text);

}  // namespace cordillera::server::access
