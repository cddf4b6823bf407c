#pragma once
// dry-run: what a build would make, from a few places that are built for real and thrown away.
#include <optional>

#include "cordillera.pb.h"
#include "pipeline/build/build.h"
#include "raster/pixels/value_look.h"

namespace cordillera::pipeline {

struct Estimate {
  proto::Manifest manifest;  ///< levels[].tiles, triangles and bytes are estimates
  double seconds = 0;
  std::optional<raster::ValueLook> values;  ///< unless too much would have to be read, or heights are above several datums
};

/// Opens the source, plans, builds sample tiles: at most kEstimateTiles of the finest level (twice for keep=), the same ones
/// every time. All but the seconds is a function of source and plan. A second or two of two threads, however large the raster.
/// Writes nothing.
proto::Result<Estimate> estimate(const BuildRequest& request);

inline constexpr int kEstimateTiles = 20;

}  // namespace cordillera::pipeline
