#pragma once
// Where pixel centres lie on the lattice: LatticePlaces the other way round. Exact where longitudes and latitudes are columns and
// rows, and at the nodes of fixed patches of 64 x 64 pixels elsewhere; interpolated between them where that is within a
// thousandth of a cell.
#include <cstdint>
#include <vector>

#include "proto/lattice.h"
#include "raster/place/patch.h"
#include "raster/place/placement.h"

namespace cordillera::raster {

class PixelPlaces {
 public:
  /// For `columns` pixels of a row, from `first` on. All references must outlive it; known: of this placement's pixels alone.
  PixelPlaces(const Placement& placement, const proto::Lattice& lattice, std::int64_t first, std::int32_t columns,
              patch::KnownPatches& known);

  /// Lattice columns x, in any turn, and rows y of the centres of pixel row j; NaN where they have no place on the earth. A
  /// pixel's place does not depend on first and columns. Rows are best asked for in order: one row of patches is kept.
  void row(std::int64_t j, double* x, double* y);

 private:
  patch::Patch make(std::int64_t column, std::int64_t row) const;
  void exact(std::int64_t i, std::int64_t j, std::int32_t count, double* x, double* y) const;
  void to_lattice(double* x, double* y, std::size_t count) const;

  const Placement& placement_;
  const proto::Lattice& lattice_;
  std::int64_t first_;
  std::int32_t columns_;
  patch::KnownPatches& known_;
  std::int64_t band_row_ = -1;      ///< of the patches that are kept
  std::vector<patch::Patch> band_;  ///< eastward from the patch that holds first_
  std::vector<double> line_x_;      ///< of every row, where columns are longitudes
};

}  // namespace cordillera::raster
