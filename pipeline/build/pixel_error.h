#pragma once
// How far a tile of the finest level is from the source's own pixels.
#include <vector>

#include "cordillera.pb.h"
#include "proto/lattice.h"
#include "proto/mesh.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// The distance, along the ellipsoid's normal, from each pixel's centre to the flat triangle above or below it, as .drc tiles are decoded.
/// mesh: of a tile of the finest level. pixels: Source::pixels of the tile's cells.
proto::PixelErrors pixel_errors(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::TileMesh& mesh,
                                const std::vector<raster::PixelPoint>& pixels);

/// Reads the tile's pixels and measures them. Those that cannot be read count for nothing: the build reads them, too, and says so.
proto::PixelErrors pixel_errors(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::TileMesh& mesh, raster::Source& source);

}  // namespace cordillera::pipeline
