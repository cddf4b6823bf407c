#pragma once
// The manifest as clients read it.
#include <string>

#include "cordillera.pb.h"
#include "proto/result.h"

namespace cordillera::pipeline {

/// Field names as in the schema, defaults printed, indented.
std::string manifest_json(const proto::Manifest& manifest);
/// Unknown members are passed over: a newer program may have written it.
proto::Result<proto::Manifest> parse_manifest_json(const std::string& json);

}  // namespace cordillera::pipeline
