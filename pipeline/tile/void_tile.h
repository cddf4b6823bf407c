#pragma once
// The mesh of a tile without data, fitted to what its neighbours have on the common borders.
#include <array>
#include <cstdint>

#include "pipeline/tile/border.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// A triangulation of the rectangle whose border vertices are exactly those of the four chains (indexed by Side), with their
/// heights and labels; all inner vertices are void and no triangle is without a void corner. Nested squares, each with half the
/// vertices of the one around it: valence <= 9 inside, 5 on the sides, 4 at the corners, and twice as many vertices as the border
/// has. side >= 8; the chains agree at the corners. Corners are kKeep.
proto::TileMesh void_tile(std::int32_t side, const std::array<Chain, 4>& border);

}  // namespace cordillera::pipeline
