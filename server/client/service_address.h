#pragma once
// Which service a command talks to, and as whom.
#include <string>

#include "proto/result.h"

namespace cordillera::server::client {

/// As the command line has them; empty: not given.
struct ServiceWords {
  std::string server;
  std::string token;  ///< others see it in the list of processes, so the command warns
  std::string token_file;
};

struct ServiceAddress {
  std::string host;    ///< "https://example.org:8443", never with a slash at its end
  std::string prefix;  ///< of every path: "/terrain", or empty
  std::string token;   ///< empty: none is shown
  std::string address() const { return host + prefix; }
};

/// --server, else CORDILLERA_SERVER, else this machine's port 8080; --token, --token-file, CORDILLERA_TOKEN,
/// CORDILLERA_TOKEN_FILE, the first that is there. Warnings go to stderr.
proto::Result<ServiceAddress> find_service(const ServiceWords& words);

}  // namespace cordillera::server::client
