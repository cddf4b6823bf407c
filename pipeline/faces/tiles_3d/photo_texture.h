#pragma once
// An orthophoto over a tile as a picture.
#include <optional>
#include <string>

#include "pipeline/faces/terrain.h"
#include "proto/lattice.h"
#include "raster/place/area.h"

namespace cordillera::pipeline::faces {

/// The photo of terrain.look() as WebP, look().photo_side() pixels a side, as a normal map lies: a pixel is at a vertex of a
/// lattice, so two tiles have the same pixels on their common side, but for what a lossy picture makes of them. Beside the photo
/// it has the colour of tiles without one. Nothing where the photo shows none of the tile.
proto::Result<std::optional<std::string>> photo_texture(const Terrain& terrain, const proto::TileAddress& tile);

/// A problem where the photo shows no part of the area. Nothing is wrong with terrain that has no photo.
proto::Result<void> check_photo(const raster::Orthophoto& photo, const raster::Area& data);
proto::Result<void> check_photo(const Terrain& terrain);

}  // namespace cordillera::pipeline::faces
