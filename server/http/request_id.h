#pragma once
// The name of a request, in the answer, in problems, in the log and in the jobs that it starts.
#include <string>

#include "server/http/message.h"

namespace cordillera::server {

/// The client's X-Request-Id where it is 1 to 64 letters, digits, dots, dashes, underscores and colons; else one of our own.
std::string request_id_of(const Request& request);

}  // namespace cordillera::server
