#include "server/access/client_address.h"

#include <arpa/inet.h>

#include <algorithm>
#include <array>

#include "proto/letters.h"

namespace cordillera::server::access {

bool is_trusted(const std::string& address, const std::vector<std::string>& trusted_proxies) {
  return std::find(trusted_proxies.begin(), trusted_proxies.end(), plain_address(address).value_or(address)) !=
         trusted_proxies.end();
}

std::string client_address(const Request& request, const std::vector<std::string>& trusted_proxies) {
  const auto forwarded = request.header("x-forwarded-for");
  if (!forwarded || !is_trusted(request.client, trusted_proxies)) return request.client;
  std::string_view rest = *forwarded;
  std::string client = request.client;
  while (!rest.empty()) {
    const auto comma = rest.rfind(',');
    // Some proxies write the port too.
    const auto last = plain_address(host_of(proto::trimmed(comma == rest.npos ? rest : rest.substr(comma + 1))));
    if (!last) return client;
    client = *last;
    if (!is_trusted(client, trusted_proxies) || comma == rest.npos) return client;
    rest = rest.substr(0, comma);
  }
  return client;
}

std::string share_of(const std::string& address) {
  if (address.find(':') == address.npos) return address;  // most are IPv4, and this is asked for every request
  const auto plain = plain_address(address);
  in6_addr six{};
  if (!plain || inet_pton(AF_INET6, plain->c_str(), &six) != 1) return plain.value_or(address);
  std::fill(six.s6_addr + 8, six.s6_addr + 16, std::uint8_t{0});
  std::array<char, INET6_ADDRSTRLEN> out{};
  return std::string(inet_ntop(AF_INET6, &six, out.data(), out.size())) + "/64";
}

bool is_loopback(std::string_view host) {
  if (const auto address = plain_address(host)) return address->starts_with("127.") || *address == "::1";
  if (host.ends_with('.')) host.remove_suffix(1);
  return proto::same_letters(host, "localhost");
}

std::string host_of(std::string_view authority) {
  if (authority.starts_with('[')) {
    const auto end = authority.find(']');
    const bool plain = end != authority.npos && (end + 1 == authority.size() || authority[end + 1] == ':');
    return std::string(plain ? authority.substr(1, end - 1) : authority);
  }
  const auto colon = authority.rfind(':');
  return std::string(authority.substr(0, authority.find(':') == colon ? colon : authority.npos));
}

std::optional<std::string> plain_address(std::string_view text) {
  const std::string whole(text);  // inet_pton wants an end
  if (whole.find('\0') != whole.npos) return std::nullopt;
  std::array<char, INET6_ADDRSTRLEN> out{};
  in_addr four{};
  in6_addr six{};
  if (inet_pton(AF_INET, whole.c_str(), &four) == 1) return inet_ntop(AF_INET, &four, out.data(), out.size());
  if (inet_pton(AF_INET6, whole.c_str(), &six) != 1) return std::nullopt;
  if (IN6_IS_ADDR_V4MAPPED(&six)) return inet_ntop(AF_INET, &six.s6_addr[12], out.data(), out.size());
  return inet_ntop(AF_INET6, &six, out.data(), out.size());
}

}  // namespace cordillera::server::access
