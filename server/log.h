#pragma once
// Lines to stderr.
#include <string>

namespace cordillera::server {

/// level: debug, info, warn or error.
void start_log(const std::string& level);
void log_debug(const std::string& line);
void log_info(const std::string& line);
void log_warning(const std::string& line);

}  // namespace cordillera::server
