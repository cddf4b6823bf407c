#pragma once
// A raster thinned out to few pixels: what a first picture of it needs while the build reads all of them.
#include <cstdint>
#include <memory>
#include <vector>

#include "cordillera.pb.h"
#include "proto/result.h"
#include "raster/pixels/value_look.h"

namespace cordillera::raster {

struct Dataset;

/// Pixels of one raster, or of an overview of it, spread evenly. Bytes are those of the band's own type.
struct Decimation {
  int columns = 0, rows = 0;  ///< of what is left
  /// Of the raster, from its first; all rows are covered. One column is left out that repeats the first.
  int covered_columns = 0;
  std::vector<std::uint8_t> values;  ///< columns * rows values, row-major
  std::vector<std::uint8_t> mask;    ///< one a value, 0: no data; empty: values alone tell
  proto::Source of;                  ///< the raster's own description
  ValueLook look;                    ///< at all of its values
  double decoded_px = 0;             ///< pixels that had to be decoded for it
};

inline constexpr double kMostDecoded_px = 256e6;  ///< a second or two

/// Reads at most about `most_pixels`. period: as Placement has it. Problems: "raster-unreadable", and "raster-too-large" for a
/// raster without overviews of which too much would have to be decoded for so few pixels.
proto::Result<Decimation> decimated(const Dataset& dataset, int period, std::int64_t most_pixels);

/// The dataset with these pixels in place of its own, and not with a copy: each thread of a build opens one, and of a large
/// raster they are hundreds of megabytes.
proto::Result<void> put_decimation(Dataset& dataset, const std::shared_ptr<const Decimation>& pixels);

}  // namespace cordillera::raster
