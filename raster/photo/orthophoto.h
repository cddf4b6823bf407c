#pragma once
// A picture of the ground from above, and its colours at the vertices of a lattice.
#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/lattice.h"
#include "proto/result.h"
#include "raster/place/area.h"

namespace cordillera::raster {

/// A rectangle of vertices of a lattice. Columns are taken modulo the circle.
struct VertexWindow {
  std::int64_t west = 0, south = 0;
  std::int32_t columns = 0, rows = 0;
};

/// Thread-safe: whoever comes second waits.
class Orthophoto {
 public:
  virtual ~Orthophoto() = default;
  /// Where pixels may lie, degrees. As everywhere, east may exceed 180.
  virtual const Area& area() const = 0;
  /// What the user calls it, without folders.
  virtual const std::string& name() const = 0;

  /// Four bytes a vertex (red, green, blue, alpha), by row from the NORTH, then column. Alpha is how much of the colour's
  /// surroundings the photo shows, 0 beside it. A vertex has the same bytes whichever window asks: a mean as wide as the
  /// lattice's cells where the photo is finer, else interpolated. Nothing where the photo shows none of the window. Problem:
  /// "raster-unreadable".
  virtual proto::Result<std::optional<std::vector<std::uint8_t>>> colours(const proto::Lattice& lattice,
                                                                          const VertexWindow& window) = 0;
};

/// path: the operator's own file. It has bands of bytes that are red, green and blue, in any CRS; an alpha band, a mask or a
/// nodata value says where it has none. Problems: "raster-not-found", "raster-format-unsupported", "raster-bands", "raster-type",
/// "raster-truncated", and those of a raster's place. Each names the file and what would be accepted.
proto::Result<std::shared_ptr<Orthophoto>> open_orthophoto(const std::string& path);

}  // namespace cordillera::raster
