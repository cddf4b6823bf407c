#pragma once
// A raster among others that has nothing to add to them.
#include "raster/source/raster_source.h"

namespace cordillera::raster {

/// Whether none of its pixels has data. Where one has, that is seldom more than a block to read. False, too, where so many had to
/// be read that it takes seconds, or where they cannot be: who builds of it will hear of that.
bool is_all_void(RasterSource& raster);

}  // namespace cordillera::raster
