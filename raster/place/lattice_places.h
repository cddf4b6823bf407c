#pragma once
// Where lattice vertices lie in a projected raster: exact at the nodes of fixed patches of the lattice, interpolated between
// them.
//
// PROJ takes about a microsecond a vertex, and nearly all projections are smooth over a few kilometres. So the lattice is cut
// into patches of 64 x 64 cells, the same ones whatever window asks. In a patch both pixel coordinates are polynomials of degree
// four in column and row (Lagrange's form, a tensor product) through 5 x 5 exact nodes. They are used only if 4 x 4 further exact
// points, half way between nodes, agree with them to a sixteenth of kPlaceError_px; else every vertex of the patch is transformed
// by itself.
//
// Why that bounds the error. Where the projection is smooth, the error along an axis is its fifth derivative, nearly constant in
// so small a patch, times (t)(t-1)(t-2)(t-3)(t-4)/120 for nodes at t = 0 .. 4. At t = 1/2 that is 0.90 of its greatest value. Its
// sign alternates from interval to interval, so at one of the points the errors of both axes add up. The greatest error is
// then 1.11 times the greatest that was seen; the other factor of fourteen is for derivatives that are not constant (the grids of
// a datum shift have kinks). A jump (the edge of a map, the cut of an interrupted projection) parts some corner of the patch from
// the others, and then nothing agrees.
#include <cstdint>
#include <vector>

#include "proto/lattice.h"
#include "raster/place/patch.h"
#include "raster/place/placement.h"

namespace cordillera::raster {

/// No interpolated place is farther than this from the exact one, along either axis, in pixels.
inline constexpr double kPlaceError_px = 1e-3;

class LatticePlaces {
 public:
  /// For `columns` vertices of a row, from column `west` eastward, modulo the circle. All references must outlive it; known: of
  /// this placement's lattice places alone.
  LatticePlaces(const Placement& placement, const proto::Lattice& lattice, std::int64_t west, std::int32_t columns,
                patch::KnownPatches& known);

  /// Pixel columns x and rows y, as Placement::to_pixels has them, of the vertices of row j, which is no pole. A vertex's place
  /// does not depend on west and columns. Rows are best asked for in order: one row of patches is kept.
  void row(std::int64_t j, double* x, double* y);

 private:
  using Patch = patch::Patch;

  Patch make(std::int64_t column, std::int64_t row) const;
  void exact(std::int64_t i, std::int64_t j, std::int32_t count, double* x, double* y) const;

  const Placement& placement_;
  const proto::Lattice& lattice_;
  std::int64_t west_;
  std::int32_t columns_;
  patch::KnownPatches& known_;
  std::int64_t band_row_ = -1;  ///< of the patches that are kept
  std::vector<Patch> band_;     ///< eastward from the patch that holds west_
  std::vector<double> line_x_;  ///< of every row, where columns are longitudes
};

}  // namespace cordillera::raster
