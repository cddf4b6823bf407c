#pragma once
// What browsers ask for beside the viewer.
#include "server/http/message.h"

namespace cordillera::server {

/// /docs: the API's description for people, made of the same document as /api.
Response docs_page();
/// /favicon.ico: a mountain.
Response icon();
/// /version: what runs here.
Response version_document();

}  // namespace cordillera::server
