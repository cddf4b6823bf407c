#pragma once
// Stated errors, and what is covered, held against the raster itself.
#include <memory>

#include "pipeline/check/check.h"
#include "pipeline/check/known_samples.h"
#include "pipeline/check/tile_laws.h"
#include "pipeline/store/pixel_error_sum.h"
#include "raster/source.h"

namespace cordillera::pipeline::check {

/// Measures decoded tiles anew. The error of a tile over more samples than a block has is left out and counted.
class ErrorLaws {
 public:
  /// plan: finest_level and levels.
  static proto::Result<std::unique_ptr<ErrorLaws>> open(const OpenRasters& rasters, const proto::Manifest& manifest,
                                                        const proto::Plan& plan);
  void add(const CheckedTile& tile, double stated_m, Report& report);
  /// After all tiles: what the manifest states at the raster's pixels, held against the finest level's.
  void finish(const proto::Source& stated, Report& report) const;

 private:
  ErrorLaws(std::unique_ptr<raster::Source> source, proto::Plan plan);
  std::unique_ptr<raster::Source> source_;
  KnownSamples samples_;  ///< its own
  PixelErrorSum pixels_;  ///< of the finest level's tiles so far
  proto::Plan plan_;
};

}  // namespace cordillera::pipeline::check
