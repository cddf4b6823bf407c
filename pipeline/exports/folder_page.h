#pragma once
// index.html of a folder of tiles: whoever opens the folder's address in a browser sees the terrain.
#include <string>

#include "pipeline/faces/terrain.h"

namespace cordillera::pipeline {

inline constexpr const char* kFolderPage = "index.html";

/// A page that shows tileset.json beside it with CesiumJS, which it takes from a public host and holds against a hash. It asks
/// for nothing else, and needs a web server: browsers do not let a page read files of their own disk.
std::string folder_page(const faces::Terrain& terrain);

}  // namespace cordillera::pipeline
