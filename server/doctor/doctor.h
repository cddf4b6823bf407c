#pragma once
// Is this machine fit to run the service? A list of checks; each looks, leaves nothing behind, and says what would help.
#include <string>
#include <vector>

#include "server/options/options.h"

namespace cordillera::server::doctor {

enum class Health {
  good,
  warning,  ///< the service runs, with less
  bad,      ///< the service would not start, or could not build
};

struct Finding {
  std::string name;
  Health health = Health::good;
  std::string what;    ///< what was found
  std::string advice;  ///< where something is wrong
};

using Findings = std::vector<Finding>;

// The checks, a few a file. settings: as `serve` would have them.
void check_folders(const Settings& settings, Findings& findings);    ///< disk, data folder, viewer
void check_network(const Settings& settings, Findings& findings);    ///< port, who may write, descriptors
void check_libraries(const Settings& settings, Findings& findings);  ///< GDAL, PROJ, geoids
void check_gpu(const Settings& settings, Findings& findings);
void check_build(const Settings& settings, Findings& findings);  ///< the sandbox; builds a small raster, as a posted one is built

const char* to_string(Health health);

/// cordillera doctor. 0: nothing is bad; 1: something is.
enum class Output { lines, json };
int doctor_command(const Settings& settings, Output output);

}  // namespace cordillera::server::doctor
