#pragma once
// A window's life: carved out of raw storage, loaded from the tile's mesh, simplified, stored back.
#include "gpu/wave_loop.h"

namespace cordillera::gpu {

enum MeshMark : std::uint8_t { kGone = 64 };  ///< collapsed; beyond proto::VertexMark and WindowMark

/// The mesh of a batch of tiles while it is simplified; indexed by vertex of the batch, rows vertex-major.
struct MeshView {
  const std::int32_t* x = nullptr;
  const std::int32_t* y = nullptr;
  const float* elevation = nullptr;
  float* carried = nullptr;
  float* spent = nullptr;
  std::uint32_t* key = nullptr;     ///< 0: not known
  std::uint32_t* row = nullptr;     ///< row[v * kRowWidth + slot], a vertex of the batch
  std::uint8_t* valence = nullptr;
  std::uint8_t* mark = nullptr;
  std::uint32_t* window = nullptr;  ///< window of the vertex in this pass
  std::uint16_t* local = nullptr;   ///< its number there; up to date inside a window that is being simplified
};

inline constexpr std::size_t kBytesPerWindowVertex = kRowWidth * 2 + 2 * 4 + 5 * 4 + 4 * 2 + 3;
inline constexpr std::size_t window_bytes(std::size_t capacity) { return 16 + capacity * (kBytesPerWindowVertex + 1); }

/// Lays a window's arrays into storage of window_bytes(capacity); capacity is a multiple of 4.
CORDILLERA_HD inline WindowView carve(unsigned char* storage, int capacity, WaveLists& lists) {
  WindowView w;
  unsigned char* at = storage;
  const auto take = [&](int bytes) {
    unsigned char* from = at;
    at += static_cast<std::size_t>(bytes) * static_cast<std::size_t>(capacity);
    return static_cast<void*>(from);
  };
  w.stride = capacity;
  lists.counts = reinterpret_cast<int*>(at);
  at += 16;
  w.x = static_cast<std::int32_t*>(take(4));
  w.y = static_cast<std::int32_t*>(take(4));
  w.elevation = static_cast<float*>(take(4));
  w.carried = static_cast<float*>(take(4));
  w.spent = static_cast<float*>(take(4));
  w.spent_after = static_cast<float*>(take(4));
  w.key = static_cast<std::uint32_t*>(take(4));
  w.row = static_cast<std::uint16_t*>(take(2 * kRowWidth));
  w.target = static_cast<std::uint16_t*>(take(2));
  lists.touched = static_cast<std::uint16_t*>(take(2));
  lists.candidates = static_cast<std::uint16_t*>(take(2));
  lists.stale = static_cast<std::uint16_t*>(take(2));
  w.valence = static_cast<std::uint8_t*>(take(1));
  w.mark = static_cast<std::uint8_t*>(take(1));
  w.state = static_cast<std::uint8_t*>(take(1));
  return w;
}

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

  CORDILLERA_HD void operator()(int i) const {
    const std::uint32_t v = order[i];
    const int n = mesh.valence[v];
    bool locked = (mesh.mark[v] & proto::kKeep) != 0;
    for (int k = 0; k < n; ++k) {
      const std::uint32_t other = mesh.row[v * kRowWidth + k];
      const bool inside = mesh.window[other] == window;
      w.row[k * w.stride + i] = inside ? mesh.local[other] : static_cast<std::uint16_t>(kOutside | k);
      locked = locked || !inside;
    }
    w.x[i] = mesh.x[v];
    w.y[i] = mesh.y[v];
    w.elevation[i] = mesh.elevation[v];
    w.carried[i] = mesh.carried[v];
    w.spent[i] = mesh.spent[v];
    w.spent_after[i] = 0;
    w.valence[i] = static_cast<std::uint8_t>(n);
    w.mark[i] = static_cast<std::uint8_t>(mesh.mark[v] | (locked ? kLocked : 0));
    w.target[i] = static_cast<std::uint16_t>(i);  // nobody's suitor
    w.key[i] = locked ? kNever : mesh.key[v];
    w.state[i] = locked ? kClean : kStale;
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
    std::uint32_t before[kRowWidth];
    CORDILLERA_FOR_ROW(k, static_cast<int>(mesh.valence[v])) before[k] = mesh.row[v * kRowWidth + k];
    const int n = w.valence[i];
    for (int k = 0; k < n; ++k) {
      const int other = w.neighbour(i, k);
      mesh.row[v * kRowWidth + k] = (other & kOutside) ? before[other & ~kOutside] : order[other];
    }
    mesh.valence[v] = static_cast<std::uint8_t>(n);
    mesh.carried[v] = w.carried[i];
    mesh.spent[v] = w.spent[i];
    if (!(w.mark[i] & kLocked)) mesh.key[v] = w.key[i] >= kBlocked ? 0 : w.key[i];
  }
};

/// A window of a pass: `count` vertices of the batch, ascending.
struct WindowRange {
  const std::uint32_t* order = nullptr;
  std::uint32_t count = 0;
  std::uint32_t window = 0;  ///< its number
};

template <class Team>
CORDILLERA_HD void simplify_window(Team& team, const MeshView& mesh, const WindowRange& range, const Rules& rules, const WaveSchedule& schedule,
                                   unsigned char* storage, int capacity) {
  WaveLists lists;
  const WindowView w = carve(storage, capacity, lists);
  const int count = static_cast<int>(range.count);
  team.each(count, NumberVertex{mesh, range.order});
  team.barrier();
  team.each(count, LoadVertex{mesh, w, range.order, range.window});
  team.barrier();
  run_waves(team, w, lists, count, rules, schedule);
  team.barrier();
  team.each(count, StoreVertex{mesh, w, range.order});
}

}  // namespace cordillera::gpu
