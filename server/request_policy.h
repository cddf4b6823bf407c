#pragma once
// What the operator lets a request from the network ask for.
#include <optional>

#include "proto/result.h"
#include "server/options.h"

namespace cordillera::server {

/// Makes a request's options safe to hand to a job: a vertical datum that is a file must be one of the operator's grids (it becomes
/// that file's path), a CRS must not name a file or an address, and threads and memory stay within what the operator set.
std::optional<proto::Problem> apply_policy(const Settings& server, proto::BuildOptions& options);

}  // namespace cordillera::server
