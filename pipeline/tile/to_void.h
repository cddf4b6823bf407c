#pragma once
// How near rims come to a line: what an edge's chain must keep for the triangles beside it.
#include <cstdint>
#include <vector>

#include "pipeline/tile/chain.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// Of positions first, first + 1, ... of an edge: how far it is straight across, on either side, to a place without data. 0:
/// there is none at the position itself; reach + 1: nowhere within reach. Outside of the window there is none; but beyond a pole
/// is nothing that could have any.
std::vector<std::int32_t> distances_to_void(const proto::Samples& samples, const Edge& edge, std::int64_t first,
                                            std::int64_t count, std::int64_t reach);

}  // namespace cordillera::pipeline
