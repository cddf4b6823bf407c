#pragma once
// The last way to empty a tile's border: a vertex that no collapse can take away steps inside.
#include <cstdint>

#include "gpu/mesh/rings.h"
#include "proto/mesh.h"

namespace cordillera::gpu {

/// amid_data: a vertex with data beside a void stays, for it might step to where there is none.
enum class Steps { amid_data, anywhere };

/// Moves each vertex that is still marked kRemove straight inwards, by the fewest units (1, 2, 4, ...) that keep every triangle's
/// area positive; its border neighbours are joined behind it and it becomes an inner vertex without marks but kVoid. Needs it
/// where a hole has so few vertices left that their valences cannot close the gap. Returns how many are left on the border.
std::uint32_t nudge_inwards(Rings& rings, proto::TileMesh& mesh, Steps steps);

}  // namespace cordillera::gpu
