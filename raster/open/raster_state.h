#pragma once
// Whether a raster is what it was: its file, and what else a reader takes for a part of it.
#include <string>

#include "raster/source.h"

namespace cordillera::raster {

/// state_of(path); of an operator's own raster also of the files beside it that say where it lies or what is valid (world file,
/// .prj, .hdr, .msk), of what an .aux.xml says of its place and heights (nodata value, scale, offset, unit, names of bands)
/// that the raster does not say itself, and of all rasters that a VRT names. Overviews change no tile, and an .aux.xml that GDAL
/// writes for statistics neither, though it repeats there what the raster says.
/// Empty: it is not there.
std::string state_of_raster(const std::string& path, Trust trust);

}  // namespace cordillera::raster
