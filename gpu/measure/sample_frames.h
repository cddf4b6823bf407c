#pragma once
// Sines and cosines of the rows and columns of a window of samples, made once for all the tiles that are measured against it.
#include <vector>

#include "proto/ellipsoid.h"
#include "proto/mesh.h"

namespace cordillera::gpu {

struct SampleFrames {
  std::vector<proto::RowFrame> rows;     ///< indexed by the samples' row
  std::vector<double> sin_lon, cos_lon;  ///< indexed by their column; apart, so that a row's loop reads them in order

  SampleFrames(const proto::Lattice& lattice, const proto::Samples& samples)
      : rows(proto::row_frames(lattice, samples.south, static_cast<std::size_t>(samples.rows))) {
    sin_lon.reserve(static_cast<std::size_t>(samples.columns));
    cos_lon.reserve(static_cast<std::size_t>(samples.columns));
    for (const proto::ColumnFrame& c : proto::column_frames(lattice, samples.west, static_cast<std::size_t>(samples.columns))) {
      sin_lon.push_back(c.sin_lon);
      cos_lon.push_back(c.cos_lon);
    }
  }
  /// A part of them.
  SampleFrames(const SampleFrames& of, std::size_t first_row, std::size_t row_count, std::size_t first_column,
               std::size_t column_count)
      : rows(&of.rows[first_row], &of.rows[first_row] + row_count),
        sin_lon(&of.sin_lon[first_column], &of.sin_lon[first_column] + column_count),
        cos_lon(&of.cos_lon[first_column], &of.cos_lon[first_column] + column_count) {}
  proto::ColumnFrame column(std::size_t k) const { return {sin_lon[k], cos_lon[k]}; }
};

}  // namespace cordillera::gpu
