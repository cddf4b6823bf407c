#pragma once
// Whose request it is where a proxy stands before the service.
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "server/http/message.h"

namespace cordillera::server::access {

/// The address that the request came from. Where that is a trusted proxy's, the last one in X-Forwarded-For that is none: what
/// stands left of it was written by strangers.
std::string client_address(const Request& request, const std::vector<std::string>& trusted_proxies);

/// Whose share of the limits it is: an IPv4 address, and of IPv6 the network of 64 bits ("2001:db8:0:7::/64"), all of whose
/// addresses one machine may have. What is no address stays as it is.
std::string share_of(const std::string& address);

/// Whether it is one of these addresses, however it is spelt.
bool is_trusted(const std::string& address, const std::vector<std::string>& trusted_proxies);

/// 127.0.0.0/8, ::1 or localhost, in any case and with or without the dot of a full name. Any other name may be pointed at
/// 127.0.0.1 by whoever registers it.
bool is_loopback(std::string_view host);
/// HOST of HOST:PORT, without the brackets of an IPv6 address.
std::string host_of(std::string_view authority);
/// An IPv4 or IPv6 address, read by inet_pton and written as inet_ntop has it, so that two spellings are one address; IPv4 within
/// IPv6 (::ffff:127.0.0.1) as IPv4. Nothing: the text is no address.
std::optional<std::string> plain_address(std::string_view text);

}  // namespace cordillera::server::access
