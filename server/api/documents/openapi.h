#pragma once
// The API's description, OpenAPI 3.1: made from the tables that requests are answered by, so that it cannot say something else.
#include <cstdint>

#include "server/http/json.h"
#include "server/http/message.h"

namespace cordillera::server {

/// Whether the service has tokens: then what writes takes one.
enum class Tokens : std::uint8_t { none, asked_for };

/// GET /api. Its server is its own folder, so a path prefix or a proxy changes nothing.
Response api_description(Tokens tokens);

// The parts, a file each.
namespace openapi {

/// Every path with its operations.
Json all_paths(Tokens tokens);
/// Schemas, parameters and answers that the paths name.
Json components();

}  // namespace openapi
}  // namespace cordillera::server
