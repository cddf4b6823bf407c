#pragma once
#include "pipeline/faces/face.h"
#include "pipeline/faces/web_mercator.h"

namespace cordillera::pipeline::faces {

/// Draco meshes of the tiles of WebMercatorQuad.
const Face& mercator_draco();

/// Zooms that it has; none (first above last) where Web Mercator has nothing of the dataset.
Zooms mercator_draco_zooms(const proto::Manifest& manifest);

/// From the integers of a tile to places; in its documents as drc_formula.
inline constexpr const char* kMercatorDrcFormula =
    "lon = -180 + (x + u / side) * 360 / 2^z, lat = atan(sinh(pi * (1 - 2 * (y + 1 - v / side) / 2^z))) * 180 / pi, height = h * "
    "height_step";

}  // namespace cordillera::pipeline::faces
