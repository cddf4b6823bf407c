#pragma once
// The heights that a tile's contours run between: those of its pixels and of some around it.
#include <cstdint>
#include <optional>

#include "pipeline/faces/face.h"
#include "proto/result.h"
#include "raster/gdal/height_lines.h"

namespace cordillera::pipeline::contours {

/// Pixels beyond each side of the tile. Their centres lie farther out than the lines that a tile holds.
inline constexpr std::int32_t kReach = 5;

/// Millimetres above the geoid at pixel centres, none outside the data's outline; holes are filled as in every picture. The
/// tile's first pixel stands in column and row kReach. A pixel's height depends on the pixel alone and not on which tile asks:
/// each row of tiles keeps the level of meshes that it is drawn from. Heights within a quarter of a metre of the geoid are a
/// millimetre below it, so that the sea has no lines but its shore. Nothing where the tile is beyond the dataset's zooms or does
/// not touch its extent. A problem without a geoid.
proto::Result<std::optional<raster::HeightSteps>> contour_grid(const faces::Terrain& terrain, const faces::Place& place);

}  // namespace cordillera::pipeline::contours
