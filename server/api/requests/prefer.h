#pragma once
// What a client would rather have (RFC 7240).
#include <chrono>
#include <optional>

#include "proto/result.h"
#include "server/http/message.h"

namespace cordillera::server {

/// Prefer: wait=SECONDS. Without a number as long as may be: seconds::max(). None: it says nothing of waiting. A problem,
/// "option-invalid": something else than a number. Other preferences are not looked at.
proto::Result<std::optional<std::chrono::seconds>> preferred_wait(const Request& request);

}  // namespace cordillera::server
