#pragma once
// Rasters that overlap and count their heights from different surfaces.
#include <string>
#include <vector>

#include "raster/mosaic/mosaic.h"

namespace cordillera::raster {

/// A sentence for each two of them, which says how far apart they are in the middle of their overlap; the first twenty. Rasters
/// are opened for it.
std::vector<std::string> notes_on_datums(const std::vector<MosaicMember>& members);

}  // namespace cordillera::raster
