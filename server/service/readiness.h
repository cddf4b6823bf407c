#pragma once
// Whether the service can take work, and why not. Alive it is even where it cannot.
#include <string>
#include <vector>

#include "server/service/service.h"

namespace cordillera::server {

struct Reason {
  std::string name;    ///< stopping, disk-full, data-not-writable, queue-full, datasets-full
  std::string detail;  ///< a sentence without paths: strangers may read it
};

/// Tries to write into the data folder, so it costs a little.
std::vector<Reason> why_not_ready(Service& service);

}  // namespace cordillera::server
