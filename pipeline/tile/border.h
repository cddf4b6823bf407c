#pragma once
// The sides of a tile mesh.
#include <cstdint>
#include <vector>

#include "proto/mesh.h"

namespace cordillera::pipeline {

/// The four sides of a tile.
enum class Side : std::uint8_t { west, east, south, north };

/// The vertices that a side has, both ends included.
struct Chain {
  std::vector<std::int32_t> position;  ///< from the western or southern end: strictly ascending, first 0, last the side's units
  std::vector<std::int32_t> height;    ///< indexed as position: kHeightStep_m, kNoHeight where void
  friend bool operator==(const Chain& a, const Chain& b) { return a.position == b.position && a.height == b.height; }
};

/// Of a side without any data: its two ends, and vertices at multiples of gap; 0: no others.
Chain void_chain(std::int32_t units, std::int32_t gap = 0);

/// Vertices of mesh on one of its sides, corners included, from the western or southern end.
std::vector<std::uint32_t> side_vertices(const proto::TileMesh& mesh, Side side);

/// The vertices of one side as a chain.
Chain border_chain(const proto::TileMesh& mesh, Side side);

}  // namespace cordillera::pipeline
