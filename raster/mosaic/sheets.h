#pragma once
// Rasters that are sheets of one map: where one ends the next goes on, and what is blended with others is all of them together.
#include <cstddef>
#include <vector>

#include "raster/mosaic/mosaic.h"

namespace cordillera::raster {

/// Indexed by member: the first member of its map. Members that follow each other are of one if their pixels are of one grid and
/// no two of them share more than their outermost pixels. One that lies on another is a raster of its own: a survey of one
/// valley, say, on a model whose grid it was made for.
std::vector<std::size_t> sheets_of(const std::vector<MosaicMember>& members);

}  // namespace cordillera::raster
