#pragma once
// How high the terrain rises within a dataset, from a few places: enough to choose a default by.
#include "pipeline/plan/plan.h"

namespace cordillera::pipeline {

/// Greatest less least height of the samples of places, see sample_places.h, in metres; 0 where they hold no data.
double relief_m(const std::vector<proto::Samples>& places);

}  // namespace cordillera::pipeline
