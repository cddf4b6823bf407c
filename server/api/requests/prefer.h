#pragma once
// What a client would rather have (RFC 7240).
#include <chrono>
#include <optional>

#include "server/http/message.h"

namespace cordillera::server {

/// Prefer: wait=SECONDS. Without a number as long as may be: seconds::max(). None: it says nothing of waiting, or something else
/// than a number, which is ignored like every preference that is not understood. Other preferences are not looked at.
std::optional<std::chrono::seconds> preferred_wait(const Request& request);

}  // namespace cordillera::server
