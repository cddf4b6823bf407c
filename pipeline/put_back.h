#pragma once
// Keeping an error promise: vertices of the input that the next simplification must keep.
#include <cstdint>
#include <vector>

#include "gpu/surface_error.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// Marks kKeep the removable vertices of input nearest to each sample whose error was too large; more of them with every attempt.
/// Returns how many were marked; 0: there is nothing left to put back near any of them.
std::uint32_t put_back(proto::TileMesh& input, const std::vector<gpu::SurfaceError::Worst>& samples, int attempt);

/// Where the simplified mesh still has a border vertex that must go, its surroundings had become too sparse to close the gap within the
/// valences: marks kKeep some inner vertices of input at doubling distances, more with every attempt. Returns how many border
/// vertices are left in simplified.
std::uint32_t keep_support(proto::TileMesh& input, const proto::TileMesh& simplified, std::int32_t cell_units, int attempt);

}  // namespace cordillera::pipeline
