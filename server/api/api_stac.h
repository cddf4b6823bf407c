#pragma once
// GET /stac and what is below it.
#include "server/api/requests/routes.h"
#include "server/http/message.h"
#include "server/service/service.h"

namespace cordillera::server::stac {

Response landing(const Request& request);
Response conforms();
Response all_collections(const Request& request);
Response one_collection(const Request& request);
/// To who may not read it, a private dataset is unknown, and it is in no list.
Response items(Service& service, const Request& request);
Response one_item(Service& service, const Request& request, const Route& route);

}  // namespace cordillera::server::stac
