#pragma once
// How high the terrain rises within a dataset, from a few places: enough to choose a default by.
#include "pipeline/plan/plan.h"

namespace cordillera::pipeline {

/// Greatest less least height of the finest samples in up to kMostSamplePlaces tiles spread evenly, in metres; 0 where they hold no data. Needs
/// levels and window of the plan only. The same places every time; what cannot be read is left out, for the build to tell.
double relief_m(const proto::Plan& plan, raster::Source& source);

}  // namespace cordillera::pipeline
