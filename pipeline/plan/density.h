#pragma once
// How much of a raster strategy exact holds as vertices at first, from a few places: what its memory depends on.
#include "pipeline/plan/plan.h"

namespace cordillera::pipeline {

/// Of the samples of places, see sample_places.h, the share that gpu/exact starts from where the finest level may be error_m off; 0 where they hold
/// no data.
double start_share(const std::vector<proto::Samples>& places, double error_m);

/// What a build of one piece takes at its peak beside the program, about. share: of start_share.
inline double exact_bytes(double samples, double share) {
  constexpr double kSample = 24, kVertex = 210;  // measured of the engine: 57 a sample at 0.30, 190 at 0.82; tiles come on top
  return samples * (kSample + kVertex * share);
}

}  // namespace cordillera::pipeline
