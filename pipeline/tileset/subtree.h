#pragma once
// Binary subtree files of the implicit tilesets: availability in Morton order, a region and a geometric error for every tile.
#include <optional>
#include <string>

#include "pipeline/store/store.h"

namespace cordillera::pipeline {

/// The subtree whose root stands at (level, x, y) of the implicit tileset; hemisphere is 'W' or 'E'. None when the place is no
/// subtree root (level is not a multiple of kSubtreeLevels) or there is nothing at or below it.
std::optional<std::string> subtree(const StoreReader& store, char hemisphere, int level, std::int32_t x, std::int32_t y);

}  // namespace cordillera::pipeline
