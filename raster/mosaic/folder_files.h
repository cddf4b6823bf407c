#pragma once
// What a folder and those below it hold.
#include <string>
#include <vector>

#include "proto/result.h"

namespace cordillera::raster {

/// Paths of all files in a folder and below it, by name. Links are followed; a folder that is reached more than once counts
/// once, by its own name if it has one here. A link that leads nowhere is a file, whose reader will say that it is not there;
/// not one with a hidden name, as editors leave them. Problems: "file-unreadable", naming the folder that cannot be read.
proto::Result<std::vector<std::string>> files_below(const std::string& folder);

}  // namespace cordillera::raster
