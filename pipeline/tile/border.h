#pragma once
// The sides of a tile mesh, and how a chain is put on one.
#include <cstdint>
#include <vector>

#include "pipeline/tile/chain.h"
#include "proto/mesh.h"
#include "proto/result.h"

namespace cordillera::pipeline {

/// Vertices of mesh on one of its sides, corners included, from the western or southern end.
std::vector<std::uint32_t> side_vertices(const proto::TileMesh& mesh, Side side);

/// The vertices of one side as a chain: what the level above chooses from.
Chain border_chain(const proto::TileMesh& mesh, Side side);

/// Marks the vertices of one side: kKeep where they are in the chain, kRemove where they are not.
/// Fails with "chain-not-in-mesh" when a chain vertex is not in the mesh, or has another height or label there.
proto::Result<void> apply_chain(proto::TileMesh& mesh, Side side, const Chain& chain);

}  // namespace cordillera::pipeline
