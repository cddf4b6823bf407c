#pragma once
// What a dry run found, as a document.
#include "cordillera.pb.h"
#include "server/http/json.h"

namespace cordillera::server {

/// Without what only a build can know.
Json estimate_json(const proto::Manifest& estimated, double seconds);

}  // namespace cordillera::server
