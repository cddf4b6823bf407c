#pragma once
// Triangles along a slanted rim for which no sample speaks.
#include <cstdint>
#include <vector>

#include "proto/mesh.h"

namespace cordillera::pipeline {

/// Indexed by triangle, 1: leave it out. Empty: none is. A rim that runs aslant goes from a row of samples to the next one, or
/// from a column to the next; between these lies no sample, so whatever the error of a triangle there is, no measure sees it. One
/// that leans by more than limit_m there is left out: the rim moves by less than a cell, and no sample loses its triangle. What
/// touches a side of the tile with an edge stays, for the neighbour has that edge too.
std::vector<std::uint8_t> rim_slivers(const proto::TileMesh& mesh, double limit_m);

}  // namespace cordillera::pipeline
