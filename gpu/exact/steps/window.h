#pragma once
// A window: up to a thousand neighbouring vertices of a block, in a multiprocessor's shared memory or a core's cache. What has a
// neighbour outside does not move.
#include "gpu/device/bits.h"
#include "gpu/exact/steps/mesh.h"
#include "gpu/exact/steps/triangle.h"

namespace cordillera::gpu::exact {

inline constexpr int kWindowCapacity = 1024, kSmallestWindow = 256;
inline constexpr std::uint32_t kNever = 0xffffffffu;  ///< key of a vertex that may not collapse
inline constexpr std::uint16_t kOutside =
    0x8000;  ///< ring entry: place (low bits) in the vertex's own ring of the mesh, outside the window

enum VertexState : std::uint8_t {
  kClean,
  kStale,    ///< to be evaluated
  kTouched,  ///< its ring or a height in it has changed: to gather, then to be evaluated
  kDead,
  kReady,  ///< evaluated, and there is a collapse that it may do
};
enum VertexFlag : std::uint8_t {
  kOnUpright = 1,  ///< on a line of constant x that it must not leave: a tile's or the block's side
  kOnLevel = 2,    ///< of constant y
  kLocked = 4,     ///< has a neighbour outside, or is held
  kOpenFan = 8,
  kBlockCorner = 16,
  kVoidHere = 32,
  kHeldSide = 64,  ///< see BlockView::is_on_cut
};

/// Counters that a team shares.
enum Counter { kToEvaluate, kWinners, kToGather, kTicket, kMostTriangles, kStacked, kCounters = 8 };

inline constexpr int kStackLength = 2048;  ///< squares that wait for a closer look, on a device
/// Places of an array: what a window has room for, and a few, lest a core's cache find all arrays at the same place.
inline constexpr std::size_t kPlaces = kWindowCapacity + 16;
inline constexpr std::size_t kBytesPerVertex = 7 * 4 + 2 * kRingWidth + 4 * 2 + 4;
CORDILLERA_HD constexpr std::size_t window_bytes(int stack_length) {
  return kCounters * 4 + kBytesPerVertex * kPlaces + 8 * static_cast<std::size_t>(stack_length);
}

/// A window's arrays in window_bytes() of storage, aligned to 8; indexed by local vertex. All lie at fixed places, which costs no
/// pointers.
struct WindowView {
  unsigned char* storage = nullptr;
  LevelRules rules;
  Curve curve;  ///< of the block

  CORDILLERA_HD std::int32_t& counter(int k) const { return reinterpret_cast<std::int32_t*>(storage)[k]; }
  CORDILLERA_HD std::uint32_t& position(int u) const { return array<std::uint32_t, 0>()[u]; }
  CORDILLERA_HD float& height(int u) const { return array<float, 4>()[u]; }
  CORDILLERA_HD float& truth(int u) const { return array<float, 8>()[u]; }         ///< of the sample there, as far as it is known
  CORDILLERA_HD float& next_height(int u) const { return array<float, 12>()[u]; }  ///< while heights move
  CORDILLERA_HD std::int32_t& pull(int u) const { return array<std::int32_t, 16>()[u]; }
  CORDILLERA_HD std::int32_t& waits(int u) const { return pull(u); }  ///< before it moves: for how many neighbours, negative
  CORDILLERA_HD std::int32_t& rival(int u) const { return pull(u); }  ///< in waves: a neighbour that was to go first, or itself
  CORDILLERA_HD std::int32_t& pull_weight(int u) const { return array<std::int32_t, 20>()[u]; }
  CORDILLERA_HD std::uint32_t& key(int u) const { return array<std::uint32_t, 24>()[u]; }
  CORDILLERA_HD std::uint16_t& tried(int u) const {
    return array<std::uint16_t, 28>()[u];
  }  ///< bit a place in the ring: a target that did not fit
  CORDILLERA_HD std::uint16_t& to_evaluate(int i) const { return array<std::uint16_t, 30>()[i]; }  ///< these three: lists
  CORDILLERA_HD std::uint16_t& winner(int i) const { return array<std::uint16_t, 32>()[i]; }
  CORDILLERA_HD std::uint16_t& to_gather(int i) const { return array<std::uint16_t, 34>()[i]; }
  CORDILLERA_HD std::uint8_t& valence(int u) const { return array<std::uint8_t, 36>()[u]; }
  CORDILLERA_HD std::uint8_t& state(int u) const { return array<std::uint8_t, 37>()[u]; }
  CORDILLERA_HD std::uint8_t& target(int u) const { return array<std::uint8_t, 38>()[u]; }  ///< a place in the ring
  CORDILLERA_HD std::uint8_t& flag(int u) const { return array<std::uint8_t, 39>()[u]; }
  /// Rings are slot-major on a device, where neighbouring lanes look at neighbouring vertices; a core has a ring at a time in its
  /// cache.
  CORDILLERA_HD std::uint16_t& entry(int u, int k) const {
#ifdef __CUDA_ARCH__
    return array<std::uint16_t, 40>()[k * static_cast<int>(kPlaces) + u];
#else
    return array<std::uint16_t, 40>()[u * kRingWidth + k];
#endif
  }
  CORDILLERA_HD std::uint64_t& stacked(int i) const { return array<std::uint64_t, kBytesPerVertex>()[i]; }

  CORDILLERA_HD int x(int u) const { return position_x(position(u)); }
  CORDILLERA_HD int y(int u) const { return position_y(position(u)); }
  CORDILLERA_HD Corner corner(int u) const { return {x(u), y(u), height(u), (flag(u) & kVoidHere) != 0}; }
  CORDILLERA_HD Demand demand() const { return {rules.tolerance, rules.rim_reach, curve, true}; }
  CORDILLERA_HD int triangles(int u) const { return (flag(u) & kOpenFan) ? valence(u) - 1 : valence(u); }
  CORDILLERA_HD int after(int u, int k) const { return k + 1 == valence(u) ? 0 : k + 1; }

 private:
  template <class T, std::size_t kBytesBefore>
  CORDILLERA_HD T* array() const {
    return reinterpret_cast<T*>(storage + kCounters * 4 + kBytesBefore * kPlaces);
  }
};

CORDILLERA_HD inline int valence_cap(std::uint8_t flag) {
  if (!(flag & kHeldSide)) return kInnerValence;
  return (flag & kBlockCorner) ? kSharedCornerValence : kSharedSideValence;
}
/// Does key a of vertex u come before key b of vertex v?
CORDILLERA_HD inline bool comes_before(std::uint32_t a, int u, std::uint32_t b, int v) { return a < b || (a == b && u < v); }

}  // namespace cordillera::gpu::exact
