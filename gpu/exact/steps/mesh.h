#pragma once
// The meshes of all blocks that are simplified together. Ring-only: a vertex lists its neighbours counter-clockwise, and
// triangles are implied. A vertex on the side of its block has an open fan, from one neighbour on the side to the other.
#include "gpu/exact/steps/field.h"
#include "gpu/mesh/valence_limits.h"

namespace cordillera::gpu::exact {

enum MeshMark : std::uint8_t {
  kVoidVertex = 1,
  kSettled = 2,  ///< evaluated with the ring that it has: no collapse is to be had
  kHeld = 4,     ///< stays as it is
};

CORDILLERA_HD inline std::uint32_t pack_position(int x, int y) {
  return static_cast<std::uint32_t>(x) | static_cast<std::uint32_t>(y) << 16;
}
CORDILLERA_HD inline int position_x(std::uint32_t position) { return static_cast<int>(position & 0xffffu); }
CORDILLERA_HD inline int position_y(std::uint32_t position) { return static_cast<int>(position >> 16); }

/// Indexed by vertex; those of a block follow each other.
struct MeshView {
  std::uint32_t* position = nullptr;  ///< in samples of its block
  float* height = nullptr;            ///< 2^-10 m, a whole number; void: 0
  std::uint8_t* valence = nullptr;    ///< 0: gone
  std::uint8_t* mark = nullptr;       ///< MeshMark
  std::uint32_t* ring = nullptr;      ///< ring[v * kRingWidth + k]: a vertex

  CORDILLERA_HD std::uint32_t* ring_of(std::uint32_t v) const { return ring + std::size_t{v} * kRingWidth; }
};

/// What does not change from level to level of a block.
struct BlockView {
  Field field;
  /// Of the rectangle that the mesh covers, in samples; the whole block, or what is left of it between hems.
  std::int32_t west = 0, east = 0, south = 0, north = 0;
  std::int32_t lattice_x = 0, lattice_y = 0;  ///< of sample (0, 0), modulo the largest tile side
  double sample_m = 1;                        ///< see Block
  std::uint32_t third = 0;                    ///< of the square of its bins, a way: windows of a pass are shifted by that
  std::uint32_t sides_held = 0;         ///< bit per side of the rectangle (south, east, north, west): valence caps for two blocks
  bool keeps_sides = false;             ///< those vertices stay where they are, too, see Ground
  std::int32_t cut_x = -1, cut_y = -1;  ///< lines on which another call will be cut, see Ground

  CORDILLERA_HD std::uint32_t sides_at(int x, int y) const {
    return (y == south ? 1u : 0u) | (x == east ? 2u : 0u) | (y == north ? 4u : 0u) | (x == west ? 8u : 0u);
  }
  CORDILLERA_HD bool is_on_side(int x, int y) const { return sides_at(x, y) != 0; }
  CORDILLERA_HD bool is_on_held_side(int x, int y) const { return (sides_at(x, y) & sides_held) != 0; }
  /// On a line where the mesh is cut, in this call or in another.
  CORDILLERA_HD bool is_on_cut(int x, int y) const { return is_on_held_side(x, y) || x == cut_x || y == cut_y; }
  /// Four meshes meet there, in this call or in another; of a corner and of where both lines cross others say so.
  CORDILLERA_HD bool is_where_cuts_meet(int x, int y) const { return is_on_held_side(x, y) && (x == cut_x || y == cut_y); }
};

/// A level, for all blocks.
struct LevelRules {
  float tolerance = 0;         ///< 2^-10 m
  float height_step = 1;       ///< of vertices, a power of two
  std::int32_t tile_side = 1;  ///< samples, a power of two
  std::int32_t rim_reach = 0;  ///< see BlockLevel
  double rounding_m = 0;       ///< likewise
  float least_width = 0;       ///< the same in samples, once it is known of which block

  CORDILLERA_HD LevelRules of(const BlockView& block) const {
    LevelRules rules = *this;
    rules.least_width = static_cast<float>(rounding_m / block.sample_m);
    return rules;
  }
};

}  // namespace cordillera::gpu::exact
