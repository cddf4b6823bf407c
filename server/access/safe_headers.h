#pragma once
// What browsers are told about an answer, so that it is taken for nothing else than it is.
#include "server/http/message.h"

namespace cordillera::server::access {

void add_safe_headers(Response& response);

}  // namespace cordillera::server::access
