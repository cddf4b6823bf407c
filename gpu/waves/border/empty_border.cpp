#include "gpu/waves/border/empty_border.h"

#include "gpu/mesh/rings.h"
#include "gpu/waves/border/mend.h"
#include "gpu/waves/border/nudge.h"

namespace cordillera::gpu {
namespace {

// What a weld leaves above the contract inside is brought down by flips.
constexpr ValenceCaps kMendCaps{kInnerValence, kMendedSide, kMendedCorner};
// Where nothing else empties a border: what void vertices may have. Too tight for all, for then no weld had room.
constexpr ValenceCaps kLastCaps{kMostValence, kVoidSide, kVoidCorner};

}  // namespace

proto::TileMesh with_border_emptied(Rings& rings, proto::TileMesh& mesh, float rim_units) {
  const bool must_step = mend(rings, mesh, kMendCaps, rim_units) > 0;
  if (must_step && nudge_inwards(rings, mesh, Steps::amid_data) > 0 && mend(rings, mesh, kMendCaps) > 0 &&
      nudge_inwards(rings, mesh, Steps::anywhere) > 0)
    mend(rings, mesh, kLastCaps);
  return mesh_from_rings(mesh, rings);
}

}  // namespace cordillera::gpu
