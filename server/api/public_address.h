#pragma once
// Where a client sees the service: for the few documents whose readers take addresses as they stand.
#include <string>

#include "server/http/message.h"

namespace cordillera::server {

/// The absolute address of the folder that the request's path is in, with the slash at its end; empty where the client named no
/// host. What a proxy says (X-Forwarded-Proto, -Host and -Prefix) goes before what reached this server. Headers that hold
/// anything but a scheme, a host or a path count as absent.
std::string public_folder(const Request& request);

/// The path below which a client sees the service, as a proxy that removes it says (X-Forwarded-Prefix): "/terrain", or empty.
std::string public_prefix(const Request& request);
/// The path of a dataset as a client sees it: "/terrain/v1/datasets/ID".
std::string public_path(const Request& request, const std::string& id);

/// Headers that public_folder reads, for Vary.
inline constexpr const char* kAddressHeaders = "X-Forwarded-Proto, X-Forwarded-Host, X-Forwarded-Prefix";

}  // namespace cordillera::server
