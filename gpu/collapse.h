#pragma once
// One wave: who collapses, and how every touched vertex finds its new ring. No locks and no float atomics: a vertex wins by being the
// local minimum of a unique key over its ring and the best suitor of its target, and every vertex writes its own row only.
#include "gpu/window.h"

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
    if (!has_room(w.mark[v], w.valence[v], w.valence[u] - ((w.mark[u] & kOnSide) ? 3 : 4))) {
      w.state[u] = touched;  // the target has filled up since: look for another
      return;
    }
    if (!best_suitor(u, v, key)) return;
    const int n = w.valence[u];
    for (int i = 0; i < n; ++i) w.state[w.neighbour(u, i)] = touched;
    w.state[u] = kDead;
  }

 private:
  CORDILLERA_HD bool least_of_ring(int u, std::uint32_t key) const {
    const int n = w.valence[u];
    for (int i = 0; i < n; ++i) {
      const int v = w.neighbour(u, i);
      const std::uint32_t other = w.key[v];
      if (other < key || (other == key && v < u)) return false;
    }
    return true;
  }
  CORDILLERA_HD bool best_suitor(int u, int v, std::uint32_t key) const {
    const int n = w.valence[v];
    for (int i = 0; i < n; ++i) {
      const int suitor = w.neighbour(v, i);
      if ((suitor & kOutside) || suitor == u || w.target[suitor] != v) continue;
      const std::uint32_t other = w.key[suitor];
      if (other < threshold && (other < key || (other == key && suitor < u))) return false;
    }
    return true;
  }
};

/// Rewrites v's row after its dead neighbours collapsed: the target takes over the dead star, side vertices drop the dead one, all
/// others see the target in its place. In place: rows of dead vertices are read only, nobody else reads v's.
struct Gather {
  WindowView w;

  CORDILLERA_HD void operator()(int v) const {
    int n = w.valence[v];
    // From last to first, so that slots still to be visited stay where they are. Two dead neighbours are never adjacent.
    for (int i = n - 1; i >= 0; --i) {
      const int u = w.neighbour(v, i);
      if ((u & kOutside) || w.state[u] != kDead) continue;
      const int t = w.target[u];
      if (t == v) {
        n = splice(v, n, i, u);
        absorb(v, u);
      } else {
        const int before = w.neighbour(v, i ? i - 1 : n - 1), after = w.neighbour(v, i + 1 < n ? i + 1 : 0);
        if (t == before || t == after) n = erase(v, n, i);
        else put(v, i, t);
      }
    }
    w.valence[v] = static_cast<std::uint8_t>(n);
  }

 private:
  CORDILLERA_HD void put(int v, int slot, int neighbour) const { w.row[slot * w.stride + v] = static_cast<std::uint16_t>(neighbour); }
  CORDILLERA_HD int erase(int v, int n, int i) const {
    for (int k = i; k + 1 < n; ++k) put(v, k, w.neighbour(v, k + 1));
    return n - 1;
  }
  /// Slot i of v held dead u: u's neighbours beyond the two shared ones take its place.
  CORDILLERA_HD int splice(int v, int n, int i, int u) const {
    const int m = w.valence[u];
    int at = 0;
    while (w.neighbour(u, at) != v) ++at;
    const bool open = (w.mark[u] & kOnSide) != 0;
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
