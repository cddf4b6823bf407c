#pragma once
// What browsers ask for beside the viewer.
#include <optional>
#include <string>

#include "server/http/message.h"

namespace cordillera::server {

/// /docs: the API's description for people, made of the same document as /api. /favicon.ico: a mountain. /version: what runs
/// here. None: another path.
std::optional<Response> browser_page(const std::string& path);

}  // namespace cordillera::server
