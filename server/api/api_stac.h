#pragma once
// GET /stac and what is below it.
#include "server/api/requests/routes.h"
#include "server/http/message.h"
#include "server/service/service.h"

namespace cordillera::server::stac {

/// Of the route's path below /stac. A private dataset is in no list, and unknown, for who may not read it.
Response answer(Service& service, const Request& request, const Route& route);

}  // namespace cordillera::server::stac
