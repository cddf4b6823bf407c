#pragma once
// PMTiles numbers the tiles of all zooms along Hilbert curves, one zoom after the other.
#include <cstdint>

#include "pipeline/exports/tile_places.h"

namespace cordillera::pipeline::exports {

std::uint64_t hilbert_id(const SquareAddress& address);
SquareAddress hilbert_address(std::uint64_t id);

}  // namespace cordillera::pipeline::exports
