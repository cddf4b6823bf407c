#pragma once
// Contours as a Mapbox Vector Tile 2.1 (github.com/mapbox/vector-tile-spec).
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/contours/interval.h"
#include "pipeline/contours/tile_lines.h"

namespace cordillera::pipeline::contours {

inline constexpr std::string_view kLayer = "contours";

/// One layer; a feature is all lines of a height, with `ele` in metres, whole where it is, and `index` (see interval.h). Contours
/// by height, one at least; heights are multiples of the interval.
std::string vector_tile(const std::vector<Contour>& contours, Interval interval);

}  // namespace cordillera::pipeline::contours
