#pragma once
// Where a picture shows water, by the dataset's water masks.
#include <vector>

#include "pipeline/faces/map_window.h"

namespace cordillera::pipeline::faces {

/// How much of each pixel of a window is water, 0 to 1: that of the cell of the window's level under its centre. By row from the
/// north, then column. Empty where the dataset does not say where water is.
std::vector<float> water_pixels(const Terrain& terrain, const MapWindow& window);

/// draw_heights, and then pixels that are mostly water of a known height get that height: meshes keep it to within their error
/// only, and a coast would have islands that are none. Gives the window's water_pixels.
proto::Result<std::vector<float>> draw_shown_heights(const Terrain& terrain, MapWindow& window);

}  // namespace cordillera::pipeline::faces
