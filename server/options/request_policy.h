#pragma once
// What the operator lets a request from the network ask for.
#include <optional>

#include "proto/result.h"
#include "server/options/options.h"

namespace cordillera::server {

/// Neither CRS nor vertical datum may name a path or an address.
std::optional<proto::Problem> check_names(const proto::BuildOptions& options);

/// Makes a request's options safe to hand to a job: neither CRS nor vertical datum may name a path or an address (a geoid grid
/// is named by its bare file name and looked for in the operator's folders), and threads and memory stay within what the
/// operator set.
std::optional<proto::Problem> apply_policy(const Settings& server, proto::BuildOptions& options);

}  // namespace cordillera::server
