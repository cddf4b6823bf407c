#pragma once
// Which of many rasters lie where: a planet has too many to try each with each.
#include <cstdint>
#include <vector>

#include "raster/source.h"

namespace cordillera::raster {

/// Windows of one lattice, by the part of the earth that they lie in. Columns are taken modulo the circle.
class WindowIndex {
 public:
  WindowIndex(std::vector<Source::Window> windows, const proto::Lattice& lattice);

  /// Numbers of the windows that share a vertex with this one (see `touch`), ascending.
  std::vector<std::uint32_t> touching(const Source::Window& window) const;

 private:
  template <typename Visit>
  void each_cell(const Source::Window& window, Visit visit) const;
  std::int64_t cells_of(const Source::Window& window) const;

  std::vector<Source::Window> windows_;
  proto::Lattice lattice_;
  std::int64_t across_, up_, units_;               ///< cells of the index, and vertices a side of one
  std::vector<std::vector<std::uint32_t>> cells_;  ///< windows that lie in each
  std::vector<std::uint32_t> large_;               ///< windows over so many cells that they are tried every time
};

/// The shortest stretch of columns that holds all windows, one or more: the circle without the widest gap between them.
Source::Window hull(std::vector<Source::Window> windows, std::int64_t circle);

}  // namespace cordillera::raster
