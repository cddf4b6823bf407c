#pragma once
// The surface over one void: a spline in tension through the heights around it (Smith & Wessel 1990, doi:10.1190/1.1442837).
#include <cstdint>
#include <vector>

namespace cordillera::raster {

/// A rectangle of cells around one void.
struct VoidGrid {
  enum Cell : std::uint8_t {
    outside,  ///< no height, and none is wanted: another void, or beyond the data
    known,
    wanted,
  };
  int columns = 0, rows = 0;
  double stretch = 1;              ///< height of a cell over its width on the ground, above 0
  std::vector<std::uint8_t> cell;  ///< columns*rows, Cell; row-major
  std::vector<double> height_m;    ///< likewise; read where known, written where wanted

  VoidGrid(int wide, int high)
      : columns(wide),
        rows(high),
        cell(static_cast<std::size_t>(wide) * static_cast<std::size_t>(high), outside),
        height_m(cell.size(), 0) {}
  std::size_t at(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x);
  }
};

/// Gives the wanted cells heights of least bending and stretching: the sum of squared second differences, plus kTension times
/// that of first ones, over all neighbours that are not outside. The order of all sums is fixed: equal grids give equal bits.
/// Something has to be known beside what is wanted. Memory: some 60 bytes a cell.
void fill_spline(VoidGrid& grid);

}  // namespace cordillera::raster
