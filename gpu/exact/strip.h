#pragma once
// What lies between a block's own mesh and its shared sides: rows 0 to 3, made anew at each level from the sides' chains and the
// vertices on the hem (row 4), where the block's own mesh ends. Nothing of it goes to the next level.
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "gpu/exact/side_chain.h"
#include "gpu/exact/simplify_block.h"

namespace cordillera::gpu::exact {

/// A vertex of a block's mesh, as it goes between host and device. Its ring has numbers within the block.
struct RingedVertex {
  std::uint32_t vertex = 0;
  std::uint32_t position = 0;
  float height = 0;
  std::uint8_t mark = 0, valence = 0;
  Depth depth = 0;  ///< of the sample there; 0 in blocks without voids
  std::uint32_t ring[kRingWidth] = {};
};

/// Vertices of all blocks' hems, block by block.
struct Hems {
  std::vector<RingedVertex> vertices;
  std::vector<std::size_t> first;  ///< indexed by block; one more at the end
  std::span<const RingedVertex> of(std::size_t block) const {
    return std::span(vertices).subspan(first[block], first[block + 1] - first[block]);
  }
};

/// The shared sides of a block, as far as a strip needs them.
struct StripSides {
  std::int32_t columns = 0, rows = 0;
  std::array<bool, 4> shared{};        ///< by Side
  std::array<SideSamples, 4> samples;  ///< of shared sides
  std::array<SideChain, 4> chain;      ///< of shared sides, of the level
  std::int32_t lattice_x = 0, lattice_y = 0;
};

/// Which vertices of the hem have to stay while the block's own mesh is simplified: one for every few of the chain's, that the
/// strip may hang on, and where a rim is within what it may move on any level, 2^rim_reach samples. hem: of the whole block.
std::vector<std::uint32_t> held_on_hem(const StripSides& sides, std::span<const RingedVertex> hem, int rim_reach);

struct Strip {
  std::vector<RingedVertex> added;  ///< numbered on from the vertices of the block's own mesh
  std::vector<RingedVertex> hem;    ///< with the rings that they have now
};
/// own: vertices of the block's own mesh.
Strip make_strip(const StripSides& sides, std::span<const RingedVertex> hem, std::uint32_t own, const LevelRules& rules);

}  // namespace cordillera::gpu::exact
