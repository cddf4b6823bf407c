#pragma once
// How high the terrain of a dataset is, from a few places: enough to choose defaults by.
#include <optional>
#include <utility>

#include "pipeline/plan/plan.h"

namespace cordillera::pipeline {

/// Sets seen_heights, from the samples of places; see sample_places.h. They stay empty where those hold no data.
void see_heights(raster::Source& source, proto::Plan& plan);
/// The lowest and the highest of them, metres; none: nothing was seen.
std::optional<std::pair<double, double>> seen_heights_m(const proto::Plan& plan);

}  // namespace cordillera::pipeline
