#pragma once
// What is said of several rasters as of one.
#include <vector>

#include "cordillera.pb.h"
#include "raster/mosaic/mosaic.h"

namespace cordillera::raster {

/// What is said of several rasters where each has a word of its own.
inline constexpr const char* kMixed = "mixed";

/// Of at least one member; whole: the window of kMemberLattice that holds them all. The finest raster stands for all where one
/// number has to; a text in which they differ is kMixed.
proto::Source describe_mosaic(const std::vector<MosaicMember>& members, const Source::Window& whole);

}  // namespace cordillera::raster
