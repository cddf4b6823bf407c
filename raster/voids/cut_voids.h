#pragma once
// Voids that a bbox cuts: they stay open, also where the raster beyond it would close them.
#include <span>

#include "raster/source.h"

namespace cordillera::raster {

/// Whether voids lie on the sides of the bbox with data at both ends. Sides on which the data end before the bbox are left out.
/// bbox: west, south, east, north. Not looked at, and so false, where the sides have more than 2^16 vertices.
proto::Result<bool> cuts_voids(Source& source, const proto::Lattice& lattice, std::span<const double> bbox);

}  // namespace cordillera::raster
