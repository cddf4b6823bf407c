#pragma once
// A window: some hundreds of neighbouring vertices of one tile, small enough for a multiprocessor's shared memory (or a core's
// first cache), simplified on its own. Seams stay locked in one pass and lie inside a window in the next.
//
// The mesh is ring-only: a vertex's row lists its neighbours counter-clockwise and triangles are implied, (u, r[i], r[i+1]). A
// vertex on the tile's border has an open fan from one border neighbour to the other. No triangle array, nothing to repair: after
// a collapse every touched vertex gathers its own new row.
#include <bit>
#include <cstdint>

#include "gpu/device/bits.h"
#include "gpu/mesh/rings.h"
#include "proto/host_device.h"
#include "proto/mesh.h"

namespace cordillera::gpu {

inline constexpr std::uint32_t kNever = 0xffffffffu;    ///< key of a vertex that may not collapse
inline constexpr std::uint32_t kBlocked = 0xfffffffeu;  ///< key of a vertex that found no target; asked again when touched
inline constexpr int kKeyShift = 19;  ///< a key is 13 bits of cost over 19 bits of hash: unique enough to order by
inline constexpr std::uint16_t kOutside =
    0x8000;  ///< row entry: slot (low bits) of the vertex's own global row, outside the window
/// Rules::cost = this x tolerance_m^2 (cells). Measured: so that the root mean square error is about an eighth of the tolerance;
/// with a guard, which decides then, so that tiles of a promise get fewest triangles.
inline constexpr float kCostPerTolerance = 6, kGuardedCostPerTolerance = 150;
inline constexpr float kFreeShare = 0.2f;     ///< of the guard: moves by less are never too costly
inline constexpr int kExactUnits = 4096;      ///< products of two numbers up to this are exact in float
inline constexpr int kWindowVertices = 1092;  ///< 33 x 33 samples fit; the shared-memory capacity of a window

/// Vertex marks inside a window, beyond proto::VertexMark.
enum WindowMark : std::uint8_t {
  kOnSide = 8,     ///< on the tile's border: open fan
  kOnCorner = 16,  ///< a corner of the tile
  kLocked = 32,    ///< a neighbour lies outside the window: may be a target, may not collapse
};

/// What happened to a vertex: kDead, or kTouched + wave of the last change of its ring, or kStale from the start.
enum WindowState : std::uint8_t { kClean = 0, kDead = 1, kTouched = 2, kStale = 255 };

/// Valence, marks and the hash of the position, in one word.
class VertexInfo {
 public:
  VertexInfo() = default;
  CORDILLERA_HD VertexInfo(int valence, int mark, std::uint32_t hash)
      : bits_(static_cast<std::uint32_t>(valence) | static_cast<std::uint32_t>(mark) << kValenceBits | hash << kHashAt) {}
  CORDILLERA_HD int valence() const { return static_cast<int>(bits_ & ((1u << kValenceBits) - 1)); }
  CORDILLERA_HD std::uint8_t mark() const { return static_cast<std::uint8_t>(bits_ >> kValenceBits); }
  CORDILLERA_HD std::uint32_t hash() const { return bits_ >> kHashAt; }
  CORDILLERA_HD bool has(std::uint8_t mark) const { return (bits_ & (static_cast<std::uint32_t>(mark) << kValenceBits)) != 0; }

 private:
  static constexpr int kValenceBits = 5, kHashAt = 32 - kKeyShift;
  static_assert(kRowWidth < 1u << kValenceBits && kValenceBits + 8 <= kHashAt);
  std::uint32_t bits_;
};

/// What neighbours look at: 16 bytes, read at once. Coordinates are std::int32_t units or, in a small window, the same in cells
/// as float: a cell is a power of two of units, so both give the same signs of areas and the same rounded sums.
struct alignas(16) WindowVertex {
  std::uint32_t x_bits, y_bits;
  float elevation;
  VertexInfo info;

  template <class Coordinate>
  CORDILLERA_HD Coordinate x() const {
    return as(x_bits, Coordinate{});
  }
  template <class Coordinate>
  CORDILLERA_HD Coordinate y() const {
    return as(y_bits, Coordinate{});
  }

 private:
  CORDILLERA_HD static float as(std::uint32_t bits, float) { return bits_float(bits); }
  CORDILLERA_HD static std::int32_t as(std::uint32_t bits, std::int32_t) { return static_cast<std::int32_t>(bits); }
};

/// Pointers into a window's arrays; all indexed by local vertex.
struct WindowView {
  int stride = 0;
  std::uint16_t* row = nullptr;
  WindowVertex* vertex = nullptr;
  float* carried = nullptr;      ///< costs of what already collapsed into the vertex
  float* spent = nullptr;        ///< share of the error and rim budgets used around the vertex, 0..1
  float* spent_after = nullptr;  ///< what the target's share would become
  std::uint32_t* key = nullptr;
  std::uint16_t* target = nullptr;
  std::uint8_t* state = nullptr;
  bool small = false;   ///< coordinates are floats: no two vertices are more than kExactUnits apart in x or y
  bool inside = false;  ///< no vertex is void, on the tile's border, or to be removed: most questions need not be asked

  /// Rows are slot-major on a device, where neighbouring lanes look at neighbouring vertices; a host core has a row at a time in
  /// its cache.
  CORDILLERA_HD std::uint16_t& entry(int u, int slot) const {
#ifdef __CUDA_ARCH__
    return row[slot * stride + u];
#else
    return row[u * static_cast<int>(kRowWidth) + slot];
#endif
  }
  CORDILLERA_HD int neighbour(int u, int slot) const { return entry(u, slot); }
};

/// What is allowed, for all windows of a tile.
struct Rules {
  float cells_per_unit = 1;   ///< power of two
  float inverse_guard = 0;    ///< 1 / metres a removed vertex may lie off the surface; 0: no guard
  float inverse_rim = 1e30f;  ///< 1 / units a rim may move
  float cost = 0;  ///< metres^2 x cells; what costs more stays, unless it must go or hardly moves the surface (kFreeShare)
};

CORDILLERA_HD inline int valence_cap(std::uint8_t mark) {
  if (mark & kOnSide) return (mark & kOnCorner) ? kCornerValence : kSideValence;
  return (mark & proto::kVoid) ? kVoidValence : kInnerValence;
}
/// May a vertex gain so many neighbours? One that is above its cap already, as the mend may leave it, may not grow.
CORDILLERA_HD inline bool has_room(VertexInfo v, int gain) { return gain <= 0 || v.valence() + gain <= valence_cap(v.mark()); }
CORDILLERA_HD inline std::uint32_t cost_key(float cost) { return (float_bits(cost) >> kKeyShift) << kKeyShift; }
/// Keys below this have at most this cost (to the key's precision).
CORDILLERA_HD inline std::uint32_t key_limit(float cost) { return (((float_bits(cost) >> kKeyShift) + 1) << kKeyShift); }
/// Keys order by cost, rounded down to 4 bits of mantissa, then by a hash of the position, so that neighbours of like cost do not
/// queue.
CORDILLERA_HD inline std::uint32_t position_hash(std::int32_t x, std::int32_t y) {
  const std::uint32_t h = hash32(static_cast<std::uint32_t>(x) * 0x9e3779b1u ^ hash32(static_cast<std::uint32_t>(y)));
  return h & ((1u << kKeyShift) - 1);
}

/// Position of the highest bit of bits, which are not 0.
CORDILLERA_HD inline int highest_bit(std::uint32_t bits) {
#ifdef __CUDA_ARCH__
  return 31 - __clz(static_cast<int>(bits));
#else
  return std::bit_width(bits) - 1;
#endif
}

}  // namespace cordillera::gpu
