#pragma once
// The options that bear on the source, checked.
#include <optional>

#include "cordillera.pb.h"
#include "proto/result.h"
#include "raster/pixels/pixels.h"
#include "raster/place/area.h"

namespace cordillera::raster {

struct SourceOptions {
  double z_scale = 1, z_offset_m = 0;
  VoidRule voids = VoidRule::hole;
  double void_height_m = 0;
  std::optional<double> nodata;  ///< raw; beside the value that the file declares; may be NaN
  std::optional<Area> bbox;      ///< west in [-180, 180), east in (west, west + 360]
};

proto::Result<SourceOptions> check_options(const proto::BuildOptions& options);

}  // namespace cordillera::raster
