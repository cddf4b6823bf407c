#pragma once
// Where simplification could not do what was asked: vertices of its input that it must keep the next time.
#include <cstddef>
#include <cstdint>

#include "proto/mesh.h"

namespace cordillera::pipeline {

/// Marks inner vertices of the simplification's input kKeep, some way in from each border vertex that the chain dropped and that
/// is still in the result. Returns how many are still there; 0: nothing is marked.
std::uint32_t keep_support(proto::TileMesh& input, const proto::TileMesh& simplified, std::int32_t cell_units, int attempt);

/// Marks the `count` removable vertices of input that are nearest to the middle of a triangle of the result kKeep.
void keep_around(proto::TileMesh& input, const proto::TileMesh& simplified, std::uint32_t triangle, std::size_t count);

/// The same around a place.
void keep_near(proto::TileMesh& input, std::int64_t x, std::int64_t y, std::size_t count);

}  // namespace cordillera::pipeline
