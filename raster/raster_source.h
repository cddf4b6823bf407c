#pragma once
// The Source of this floor: a dataset, its place, its kernel and its geoid.
#include <memory>
#include <optional>
#include <vector>

#include "raster/dataset.h"
#include "raster/footprint.h"
#include "raster/kernel.h"
#include "raster/options.h"
#include "raster/pixels.h"
#include "raster/placement.h"
#include "raster/vertical.h"

namespace cordillera::raster {

/// What open_source found out; each part checked.
struct SourceParts {
  Dataset dataset;
  std::optional<Placement> placement;
  HeightRule height_rule;
  VerticalDatum datum;
  SourceOptions options;
  Area area;                ///< safe footprint, clipped to the bbox
  bool full_circle = false;
  bool point = false;       ///< data reaches from centre to centre only
  double pole_longitude_deg = 0;  ///< where a pole row is sampled: it is one point
  proto::Source description;
};

class RasterSource : public Source {
 public:
  explicit RasterSource(SourceParts parts);

  const proto::Source& description() const override { return parts_.description; }
  Window window(const proto::Lattice& lattice) const override;
  bool empty(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int64_t columns, std::int64_t rows) const override;
  proto::Result<proto::Samples> sample(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int32_t columns,
                                       std::int32_t rows) override;
  double resampling_error_m(const proto::Lattice& lattice) override;

 private:
  /// A rectangle of the samples asked for.
  struct Rect {
    std::int32_t c0, r0, columns, rows;
  };
  struct Job;  ///< one call of sample()
  /// sample() without asking first whether anything is there.
  proto::Result<proto::Samples> sample_present(const proto::Lattice& lattice, std::int64_t west, std::int64_t south, std::int32_t columns,
                                               std::int32_t rows);
  double undulation_m(double latitude_deg, double longitude_deg) const;
  PixelWindow pixels_in_area() const;
  double deviation_m(const proto::Lattice& lattice, std::int64_t column, std::int64_t row);
  const KernelFrame& frame_for(const proto::Lattice& lattice);
  void place_samples(Job& job) const;
  proto::Result<void> resample(Job& job, const Rect& rect);
  proto::Result<void> resample_wide(Job& job, std::size_t at);
  void store(Job& job, std::size_t at, double height_m, bool flat) const;

  SourceParts parts_;
  Pixels pixels_;
  PixelBlock block_;                   ///< scratch
  std::optional<KernelFrame> frame_;   ///< of frame_level_
  int frame_level_ = -1;
};

}  // namespace cordillera::raster
