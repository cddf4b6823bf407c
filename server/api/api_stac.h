#pragma once
// GET /stac and what is below it.
#include "server/api/requests/routes.h"
#include "server/http/message.h"
#include "server/service/service.h"

namespace cordillera::server::stac {

/// The answer at a path below /stac. To who may not read it, a private dataset is unknown, and it is in no list.
Response answer(Service& service, const Request& request, const Route& route);

}  // namespace cordillera::server::stac
