#pragma once
// Four child meshes become the input of their parent, by integer equality of positions.
#include <array>
#include <cstdint>

#include "pipeline/tile/chain.h"
#include "proto/mesh.h"
#include "proto/result.h"

namespace cordillera::pipeline {

struct WeldInput {
  /// Bit 0 of the index: east, bit 1: north. nullptr: a child without data; a mesh of void vertices takes its place.
  std::array<const proto::TileMesh*, 4> children{};
  std::int32_t child_side = 0;  ///< units, >= 8
  /// What neighbours of the parent have on the outer sides of a missing child, [child][Side]; nullptr: its void corners only.
  /// Not read for sides that another child shares, nor for children that are there.
  std::array<std::array<const Chain*, 4>, 4> outer{};
};

/// The mesh over the parent's rectangle: vertices of the children in their order, shared ones once; triangles in the same order;
/// all marks but kVoid cleared, the parent's four corners kKeep. Fails with "weld-mismatch" when two children differ on a common
/// border in a position, height or label.
proto::Result<proto::TileMesh> weld(const WeldInput& input);

}  // namespace cordillera::pipeline
