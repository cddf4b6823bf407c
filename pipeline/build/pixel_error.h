#pragma once
// How far a tile of the finest level is from the source's own pixels.
#include <vector>

#include "cordillera.pb.h"
#include "pipeline/tile/tile_mesh.h"
#include "proto/lattice.h"
#include "proto/mesh.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// The distance, along the ellipsoid's normal, from each pixel's centre to the flat triangle above or below it, as .drc tiles are
/// decoded. mesh: of a tile of the finest level. pixels: Source::pixels of the tile's cells.
proto::PixelErrors pixel_errors(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::TileMesh& mesh,
                                const std::vector<raster::PixelPoint>& pixels);

/// Those of a tile of the finest level. Where they cannot be read there are none: the build reads them, too, and says so.
std::vector<raster::PixelPoint> pixels_of(const proto::Lattice& lattice, const proto::TileAddress& tile, raster::Source& source);

struct MetPixels {
  std::uint32_t inserted = 0;  ///< vertices
  std::vector<gpu::MeshPoint>
      on_sides;  ///< samples on the tile's sides that would have to be vertices, where pixels are still too far off
};

/// Puts samples into a tile of the finest level until its triangles are within the level's target of all pixels, as they are of
/// all samples; as far as vertices can, which do not go onto the tile's sides (see put_on_sides). What was measured of the tile
/// is no longer true if any went in. Where pixels are finer than samples, as of a raster that was added to an older plan, nothing
/// goes in.
MetPixels meet_pixels(const LevelContext& context, BuiltTile& built, const std::vector<raster::PixelPoint>& pixels);

}  // namespace cordillera::pipeline
