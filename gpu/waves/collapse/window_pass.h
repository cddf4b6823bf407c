#pragma once
// A window's life: carved out of raw storage, loaded from the tile's mesh, simplified, stored back.
#include "gpu/device/atomic.h"
#include "gpu/waves/collapse/wave_loop.h"

namespace cordillera::gpu {

enum MeshMark : std::uint8_t { kGone = 64 };  ///< collapsed; beyond proto::VertexMark and WindowMark

/// The mesh of a batch of tiles while it is simplified; indexed by vertex of the batch, rows vertex-major.
struct MeshView {
  const std::int32_t* x = nullptr;
  const std::int32_t* y = nullptr;
  const float* elevation = nullptr;
  float* carried = nullptr;
  float* spent = nullptr;
  std::uint32_t* key = nullptr;  ///< 0: not known; kBlocked: not to be asked until the ring changes
  std::uint32_t* row = nullptr;  ///< row[v * kRowWidth + slot], a vertex of the batch
  std::uint8_t* valence = nullptr;
  std::uint8_t* mark = nullptr;
  std::uint32_t* window = nullptr;  ///< window of the vertex in this pass
  std::uint16_t* local = nullptr;   ///< its number there; up to date inside a window that is being simplified
};

inline constexpr std::size_t kBytesPerWindowVertex = sizeof(WindowVertex) + 4 + 3 * 2 + 2;  // and its row
/// The counts of the lists, and what marks there are.
inline constexpr std::size_t kWindowHead = 32;
/// What is seldom looked at lies outside the window's storage, so that more windows fit a multiprocessor.
inline constexpr std::size_t kOuterFloats = 3;
/// Room for a window, a multiple of 16. width: of the rows. The waves raise no valence above the caps, so max(kInnerValence,
/// greatest at the start) is enough.
CORDILLERA_HD constexpr std::size_t window_bytes(std::size_t capacity, std::size_t width) {
  return (kWindowHead + capacity * (kBytesPerWindowVertex + 2 * width) + 15) / 16 * 16;
}

/// Lays a window's arrays into storage of window_bytes(capacity, width), and outer of kOuterFloats * count; capacity is a
/// multiple of 4.
CORDILLERA_HD inline WindowView carve(unsigned char* storage, int capacity, float* outer, int count, WaveLists& lists) {
  WindowView w;
  unsigned char* at = storage;
  const auto take = [&](int bytes) {
    unsigned char* from = at;
    at += static_cast<std::size_t>(bytes) * static_cast<std::size_t>(capacity);
    return static_cast<void*>(from);
  };
  w.stride = capacity;
  lists.counts = reinterpret_cast<std::uint64_t*>(at);
  at += kWindowHead;
  w.vertex = static_cast<WindowVertex*>(take(sizeof(WindowVertex)));
  w.carried = outer;
  w.spent = outer + count;
  w.spent_after = outer + 2 * count;
  w.key = static_cast<std::uint32_t*>(take(4));
  w.target = static_cast<std::uint16_t*>(take(2));
  lists.touched = static_cast<std::uint16_t*>(take(2));
  lists.candidates = static_cast<std::uint16_t*>(take(2));
  lists.capacity = capacity;
  w.state = static_cast<std::uint8_t*>(take(1));
  take(1);
  w.row = reinterpret_cast<std::uint16_t*>(at);  // last: only its length depends on the width
  return w;
}

struct ClearCount {
  std::uint64_t* counts;
  CORDILLERA_HD void operator()(int i) const { counts[i] = 0; }
};

struct NumberVertex {
  MeshView mesh;
  const std::uint32_t* order;
  CORDILLERA_HD void operator()(int i) const { mesh.local[order[i]] = static_cast<std::uint16_t>(i); }
};

struct LoadVertex {
  MeshView mesh;
  WindowView w;
  const std::uint32_t* order;
  std::uint32_t window;
  float cells_per_unit;
  std::uint32_t* special;  ///< counts vertices that WindowView::inside speaks of

  CORDILLERA_HD void operator()(int i) const {
    const std::uint32_t v = order[i];
    const int n = mesh.valence[v];
    bool locked = (mesh.mark[v] & proto::kKeep) != 0;
    for (int k = 0; k < n; ++k) {
      const std::uint32_t other = mesh.row[v * kRowWidth + k];
      const bool inside = mesh.window[other] == window;
      w.entry(i, k) = inside ? mesh.local[other] : static_cast<std::uint16_t>(kOutside | k);
      locked = locked || !inside;
    }
    if (mesh.mark[v] & (proto::kVoid | proto::kRemove | kOnSide)) fetch_add(special, 1);
    const std::int32_t x = mesh.x[v], y = mesh.y[v];
    const VertexInfo info(n, mesh.mark[v] | (locked ? kLocked : 0), position_hash(x, y));
    w.vertex[i] = {bits_of(x - mesh.x[order[0]]), bits_of(y - mesh.y[order[0]]), mesh.elevation[v], info};
    w.carried[i] = mesh.carried[v];
    w.spent[i] = mesh.spent[v];
    w.target[i] = static_cast<std::uint16_t>(i);  // nobody's suitor
    w.key[i] = locked ? kNever : mesh.key[v];
    w.state[i] = locked ? kClean : kStale;
  }

 private:
  CORDILLERA_HD std::uint32_t bits_of(std::int32_t units) const {
    return w.small ? float_bits(cells_per_unit * static_cast<float>(units)) : static_cast<std::uint32_t>(units);
  }
};

struct StoreVertex {
  MeshView mesh;
  WindowView w;
  const std::uint32_t* order;

  CORDILLERA_HD void operator()(int i) const {
    const std::uint32_t v = order[i];
    if (w.state[i] == kDead) {
      mesh.mark[v] |= kGone;
      return;
    }
    const VertexInfo info = w.vertex[i].info;
    const int n = info.valence();
    std::uint32_t* const row = mesh.row + std::size_t{v} * kRowWidth;
    if (info.has(kLocked)) {
      std::uint32_t before[kRowWidth];
      for (int k = 0; k < mesh.valence[v]; ++k) before[k] = row[k];
      for (int k = 0; k < n; ++k) {
        const int other = w.neighbour(i, k);
        row[k] = (other & kOutside) ? before[other & ~kOutside] : order[other];
      }
    } else {
      for (int k = 0; k < n; ++k) row[k] = order[w.neighbour(i, k)];
    }
    mesh.valence[v] = static_cast<std::uint8_t>(n);
    mesh.carried[v] = w.carried[i];
    mesh.spent[v] = w.spent[i];
    // Blocked until its ring changes, in this pass or a later one.
    const std::uint32_t key = info.has(kLocked) ? mesh.key[v] : w.key[i];
    const bool changed = w.state[i] != kClean && w.state[i] != kStale;
    mesh.key[v] = key == kBlocked && changed ? 0 : key;
  }
};

/// A window of a pass: `count` vertices of the batch, ascending.
struct WindowRange {
  const std::uint32_t* order = nullptr;
  float* outer = nullptr;  ///< kOuterFloats * count
  std::uint32_t count = 0;
  std::uint32_t window = 0;  ///< its number
  bool small = false;        ///< see WindowView
};

template <class Team>
CORDILLERA_HD void simplify_window(Team& team, const MeshView& mesh, const WindowRange& range, const Rules& rules,
                                   unsigned char* storage, int capacity) {
  WaveLists lists;
  const int count = static_cast<int>(range.count);
  WindowView w = carve(storage, capacity, range.outer, count, lists);
  w.small = range.small;
  auto* const special = reinterpret_cast<std::uint32_t*>(lists.counts + 2);
  team.each(3, ClearCount{lists.counts});
  team.each(count, NumberVertex{mesh, range.order});
  team.barrier();
  team.each(count, LoadVertex{mesh, w, range.order, range.window, rules.cells_per_unit, special});
  team.barrier();
  w.inside = *special == 0;
  run_waves(team, w, lists, count, rules);
  team.barrier();
  team.each(count, StoreVertex{mesh, w, range.order});
}

}  // namespace cordillera::gpu
