#pragma once
// One wave: who collapses, and how every touched vertex finds its new ring. No locks and no float atomics: a vertex wins by being
// the local minimum of a unique key over its ring and the best suitor of its target, and every vertex writes its own row only.
#include "gpu/waves/collapse/window.h"

namespace cordillera::gpu {

/// Decides whether u collapses in this wave; marks its ring as touched.
struct Decide {
  WindowView w;
  std::uint32_t threshold;  ///< keys below it take part
  int wave;

  CORDILLERA_HD void operator()(int u) const {
    const std::uint32_t key = w.key[u];
    if (key >= threshold || !least_of_ring(u, key)) return;
    const std::uint8_t touched = static_cast<std::uint8_t>(kTouched + wave);
    const int v = w.target[u];
    const VertexInfo own = w.vertex[u].info, target = w.vertex[v].info;
    if (!has_room(target, own.valence() - (own.has(kOnSide) ? 3 : 4))) {
      w.state[u] = touched;  // the target has filled up since: look for another
      return;
    }
    if (!best_suitor(u, v, key)) return;
    const int n = own.valence();
    for (int i = 0; i < n; ++i) w.state[w.neighbour(u, i)] = touched;
    w.state[u] = kDead;
  }

 private:
  // Rings are looked at four neighbours at a time, the last one repeated: what four need is under way together, and most answers
  // are no.
  static constexpr int kAtOnce = 4;
  CORDILLERA_HD int neighbour(int u, int slot, int n) const { return w.neighbour(u, slot < n ? slot : n - 1); }

  CORDILLERA_HD bool least_of_ring(int u, std::uint32_t key) const {
    const int n = w.vertex[u].info.valence();
    for (int i = 0; i < n; i += kAtOnce) {
      bool less = false;
      for (int k = i; k < i + kAtOnce; ++k) {
        const int v = neighbour(u, k, n);
        const std::uint32_t other = w.key[v];
        less |= other < key || (other == key && v < u);
      }
      if (less) return false;
    }
    return true;
  }
  CORDILLERA_HD bool best_suitor(int u, int v, std::uint32_t key) const {
    const int n = w.vertex[v].info.valence();
    for (int i = 0; i < n; i += kAtOnce) {
      bool better = false;
      for (int k = i; k < i + kAtOnce; ++k) {
        const int seen = neighbour(v, k, n), suitor = (seen & kOutside) ? u : seen;
        const std::uint32_t other = w.key[suitor];
        better |= w.target[suitor] == v && (other < key || (other == key && suitor < u));
      }
      if (better) return false;
    }
    return true;
  }
};

/// Rewrites v's row after its dead neighbours collapsed: the target takes over the dead star, side vertices drop the dead one,
/// all others see the target in its place. In place: rows of dead vertices are read only, nobody else reads v's.
struct Gather {
  WindowView w;

  CORDILLERA_HD void operator()(int v) const {
    const VertexInfo info = w.vertex[v].info;
    int n = info.valence();
    std::uint32_t dead = 0;
    for (int i = 0; i < n; ++i) {
      const int u = w.neighbour(v, i);
      if (!(u & kOutside) && w.state[u] == kDead) dead |= 1u << i;
    }
    // From last to first, so that slots still to be visited stay where they are. Two dead neighbours are never adjacent.
    for (; dead; dead ^= 1u << highest_bit(dead)) {
      const int i = highest_bit(dead), u = w.neighbour(v, i), t = w.target[u];
      if (t == v) {
        absorb(v, u);
        n = splice(v, n, i, u);
      } else {
        const int before = w.neighbour(v, i ? i - 1 : n - 1), after = w.neighbour(v, i + 1 < n ? i + 1 : 0);
        if (t == before || t == after)
          n = erase(v, n, i);
        else
          put(v, i, t);
      }
    }
    w.vertex[v].info = {n, info.mark(), info.hash()};
  }

 private:
  CORDILLERA_HD void put(int v, int slot, int neighbour) const { w.entry(v, slot) = static_cast<std::uint16_t>(neighbour); }
  CORDILLERA_HD int erase(int v, int n, int i) const {
    for (int k = i; k + 1 < n; ++k) put(v, k, w.neighbour(v, k + 1));
    return n - 1;
  }
  /// Slot i of v held dead u: u's neighbours beyond the two shared ones take its place.
  CORDILLERA_HD int splice(int v, int n, int i, int u) const {
    const VertexInfo dead = w.vertex[u].info;
    const int m = dead.valence();
    int at = 0;
    while (w.neighbour(u, at) != v) ++at;
    const bool open = dead.has(kOnSide);
    const int count = open ? m - 2 : m - 3;
    int from = open ? (at == 0 ? 2 : 0) : at + 2;
    if (from >= m) from -= m;
    if (count == 0) return erase(v, n, i);
    for (int k = n - 1; k > i; --k) put(v, k + count - 1, w.neighbour(v, k));
    for (int k = 0; k < count; ++k) {
      put(v, i + k, w.neighbour(u, from));
      if (++from == m) from = 0;
    }
    return n + count - 1;
  }
  CORDILLERA_HD void absorb(int v, int u) const {
    w.carried[v] += bits_float(cost_key(bits_float(w.key[u])));
    if (w.spent_after[u] > w.spent[v]) w.spent[v] = w.spent_after[u];
  }
};

}  // namespace cordillera::gpu
