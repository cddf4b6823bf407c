#pragma once
// Headings of help.
#include <string>

#include "server/options/options.h"

namespace cordillera::server {

/// Under which heading help has an option; never empty.
std::string group_of(const OptionSpec& option);

}  // namespace cordillera::server
