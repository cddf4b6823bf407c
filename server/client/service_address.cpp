#include "server/client/service_address.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iostream>

#include "proto/letters.h"
#include "server/access/client_address.h"

namespace cordillera::server::client {
namespace {

using proto::Problem;

std::string variable(const char* name) {
  const char* value = std::getenv(name);
  return value == nullptr ? "" : value;
}

void warn(const std::string& sentence) { std::cerr << "cordillera: warning: " << sentence << "\n"; }

/// Whether what is sent there stays on this machine. No name below .localhost can be registered (RFC 6761).
bool stays_here(const std::string& address) {
  const std::string host = access::host_of(std::string_view(address).substr(address.find("//") + 2));
  return access::is_loopback(host) || proto::lower(host).ends_with(".localhost");
}

proto::Result<ServiceAddress> read_address(const std::string& text) {
  const Problem wrong = {"usage", "'" + text + "' is no address of a service",
                         "http://HOST:PORT or https://HOST:PORT, with a path before /v1 if a proxy adds one", "--server"};
  const std::size_t scheme = text.starts_with("http://") ? 7 : text.starts_with("https://") ? 8 : 0;
  const bool plain = std::all_of(text.begin(), text.end(), [](unsigned char c) { return c > ' ' && c < 127; });
  if (scheme == 0 || !plain || text.find_first_of("@?#\\") != text.npos) return wrong;
  const std::size_t path = text.find('/', scheme);
  ServiceAddress place;
  place.host = text.substr(0, path);
  if (place.host.size() == scheme) return wrong;
  if (path != text.npos) place.prefix = text.substr(path);
  while (place.prefix.ends_with('/')) place.prefix.pop_back();
  return place;
}

/// The first line; what `cordillera token new` prints may be kept as it is.
proto::Result<std::string> read_token_file(const std::string& path) {
  std::ifstream file(path);
  std::string line;
  if (!file || !std::getline(file, line)) {
    return Problem{"file-unreadable", "cannot read a token from " + path, "a file whose first line is the token", "--token-file"};
  }
  if (line.starts_with("token: ")) line.erase(0, 7);
  while (!line.empty() && (line.back() == '\r' || line.back() == ' ')) line.pop_back();
  return line;
}

proto::Result<std::string> find_token(const ServiceWords& words) {
  if (!words.token.empty()) {
    warn("others on this machine can see --token in the list of processes; CORDILLERA_TOKEN and --token-file keep it from them");
    return words.token;
  }
  if (!words.token_file.empty()) return read_token_file(words.token_file);
  if (const std::string token = variable("CORDILLERA_TOKEN"); !token.empty()) return token;
  const std::string file = variable("CORDILLERA_TOKEN_FILE");
  return file.empty() ? proto::Result<std::string>(std::string()) : read_token_file(file);
}

}  // namespace

proto::Result<ServiceAddress> find_service(const ServiceWords& words) {
  std::string address = words.server.empty() ? variable("CORDILLERA_SERVER") : words.server;
  if (address.empty()) address = "http://127.0.0.1:8080";
  auto place = read_address(address);
  if (!place) return place;
  auto token = find_token(words);
  if (!token) return token.problem();
  // It becomes a header.
  if (!std::all_of(token->begin(), token->end(), [](unsigned char c) { return c > ' ' && c < 127; }))
    return Problem{"usage", "the token holds blanks or other characters that no token has", "what cordillera token new printed",
                   "--token"};
  if (!token->empty() && place->host.starts_with("http://") && !stays_here(place->host))
    warn("the token goes unencrypted to " + place->host);
  place->token = *token;
  return place;
}

}  // namespace cordillera::server::client
