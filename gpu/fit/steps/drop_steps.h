#pragma once
// Vertices dropped onto a neighbour that stays where it is. Nothing moves, so the polygons that dropped vertices leave are filled
// each on its own: vertices without an edge between them may all go in one wave, and no triangle need be locked.
#include "gpu/fit/steps/collapse_steps.h"
#include "gpu/fit/steps/lock_steps.h"
#include "gpu/fit/steps/wave_view.h"

namespace cordillera::gpu::fit {

/// Most neighbours that a drop may leave a vertex with; later waves want room, too.
inline constexpr std::uint32_t kMostAfterDrop = 12;
/// Times this, numbers are still all different, and those of neighbours come in no order.
inline constexpr std::uint32_t kOddlyMixed = 0x9e3779b1u;

CORDILLERA_HD inline bool takes_in(const Vertex& to, const Vertex& gone) {
  return std::uint32_t{to.valence} + gone.valence <= kMostAfterDrop + 4;
}

/// The neighbour that an inner vertex would become: where its planes are left by the least.
struct EvaluateDrop {
  FitMesh mesh;
  WaveView wave;

  CORDILLERA_HD void operator()(std::uint32_t u) const {
    const Vertex at = mesh.vertex[u];
    wave.mark[u] = 0;
    wave.cost[u] = kNever;
    if ((at.flags & (kOpen | kFixed | kGone)) != 0 || at.valence > kMostNeighbours) return;
    Vertex ring[kMostNeighbours];
    const std::uint32_t* const row = mesh.row(u);
    for (std::uint32_t i = 0; i < at.valence; ++i) ring[i] = mesh.vertex[row[i]];
    float tried = -1;
    for (int k = 0; k < kTries; ++k) {
      const Target target = cheapest(at, ring, wave.planes[u], tried);
      if (target.cost >= kNever) return;
      if (sees_ring(ring, at.valence, target.slot)) {
        wave.cost[u] = target.cost;
        wave.intent[u].slot = target.slot;
        return;
      }
      tried = target.cost;
    }
  }

 private:
  static constexpr int kTries = 2;
  struct Target {
    std::uint32_t slot = 0;
    float cost = kNever;
  };

  /// Of those that cost more than what was tried.
  CORDILLERA_HD Target cheapest(const Vertex& at, const Vertex* ring, const Planes& planes, float tried) const {
    constexpr float kShape = 1e-7f;  // where costs are equal, short edges go first
    Target best;
    for (std::uint32_t i = 0; i < at.valence; ++i) {
      const Vertex& to = ring[i];
      const float dx = static_cast<float>(to.x - at.x) * mesh.cells_per_unit,
                  dy = static_cast<float>(to.y - at.y) * mesh.cells_per_unit;
      const float off = planes.height(dx, dy) - (to.z - at.z), square = dx * dx + dy * dy, scatter = planes.scatter(dx, dy);
      const float cost = planes.weight * off * off + (scatter > 0 ? scatter : 0) + kShape * square * (1 + square);
      if (cost >= best.cost || cost <= tried || !takes_in(to, at)) continue;
      best = {i, cost};
    }
    return best;
  }
  /// Is the ring seen from one of its own vertices, every triangle of the fan positive?
  CORDILLERA_HD static bool sees_ring(const Vertex* ring, std::uint32_t count, std::uint32_t from) {
    const auto around = [count](std::uint32_t i) { return i < count ? i : i - count; };
    for (std::uint32_t k = 1; k + 1 < count; ++k) {
      if (turn(ring[from].at(), ring[around(from + k)].at(), ring[around(from + k + 1)].at()) <= 0) return false;
    }
    return true;
  }
};

/// Its own planes are all that a vertex needs to know: one look around for both.
struct StartDrops {
  FitMesh mesh;
  WaveView wave;
  CORDILLERA_HD void operator()(std::size_t v) const {
    StartVertex{mesh, wave}(v);
    EvaluateDrop{mesh, wave}(static_cast<std::uint32_t>(v));
  }
};

/// Does u go before w? Classes are coarse, so that on a slope of costs neighbours do not wait for each other in a row.
CORDILLERA_HD inline bool drops_before(const WaveView& wave, std::uint32_t u, std::uint32_t w) {
  const std::uint32_t at_u = cost_class(wave.cost[u]) >> 2, at_w = cost_class(wave.cost[w]) >> 2;
  return at_u != at_w ? at_u < at_w : u * kOddlyMixed < w * kOddlyMixed;
}

/// A candidate that is the least among the candidates around it. All under the threshold are evaluated: the cost says who is one.
struct IsLeast {
  FitMesh mesh;
  WaveView wave;
  Count most_class;
  CORDILLERA_HD bool operator()(std::uint32_t u) const {
    const std::uint32_t* const row = mesh.row(u);
    const std::uint32_t most = most_class.value();
    for (std::uint32_t k = 0; k < mesh.vertex[u].valence; ++k) {
      if (drops_before(wave, row[k], u) && cost_class(wave.cost[row[k]]) <= most) return false;
    }
    return true;
  }
};

/// Costs last longer than what they were allowed by: that is asked again.
struct MarkPossible {
  FitMesh mesh;
  WaveView wave;
  CORDILLERA_HD void operator()(std::uint32_t u) const {
    const Vertex& at = mesh.vertex[u];
    const std::uint32_t slot = wave.intent[u].slot;
    const std::uint32_t* const row = mesh.row(u);
    bool possible = takes_in(mesh.vertex[row[slot]], at);
    const auto place = [&](std::uint32_t i) { return mesh.vertex[row[i < at.valence ? i : i - at.valence]].at(); };
    for (std::uint32_t k = 1; possible && k + 1 < at.valence; ++k) {
      possible = turn(place(slot), place(slot + k), place(slot + k + 1)) > 0;
    }
    wave.mark[u] = possible ? std::uint8_t{kWinner} : std::uint8_t{kStale};
  }
};

/// A neighbour takes in one vertex a wave: its valence was looked at for one.
struct IsFirstSuitor {
  FitMesh mesh;
  WaveView wave;
  std::uint32_t begin = 0, end = ~std::uint32_t{0};  ///< nobody outside may go
  CORDILLERA_HD bool operator()(std::uint32_t u) const {
    if (!(wave.mark[u] & kWinner)) return false;
    const std::uint32_t to = mesh.row(u)[wave.intent[u].slot];
    const std::uint32_t* const row = mesh.row(to);
    for (std::uint32_t k = 0; k < mesh.vertex[to].valence; ++k) {
      const std::uint32_t other = row[k];
      if (other == u || other < begin || other >= end || !(wave.mark[other] & kWinner)) continue;
      if (mesh.row(other)[wave.intent[other].slot] == to && drops_before(wave, other, u)) return false;
    }
    return true;
  }
};

struct ForgetPossible {
  WaveView wave;
  CORDILLERA_HD void operator()(std::uint32_t u) const { wave.mark[u] &= static_cast<std::uint8_t>(~kWinner); }
};

/// A wave goes ahead whole, or the series ends.
struct CommitDrops {
  Progress* progress;
  Count winners;
  CORDILLERA_HD void operator()(std::size_t) const {
    Progress& at = *progress;
    at.going = 0;
    if (at.halt != Halt::none) return;
    const std::uint32_t count = winners.value();
    if (count == 0 || at.triangles < at.least + 2 * count)
      at.halt = Halt::stuck;
    else
      at.go(count, 2 * count);
  }
};

/// The neighbour takes over the planes; those around are touched.
struct Drop {
  FitMesh mesh;
  WaveView wave;
  std::uint32_t wave_number;

  CORDILLERA_HD void operator()(std::uint32_t u) const {
    Vertex& at = mesh.vertex[u];
    const std::uint32_t* const row = mesh.row(u);
    const std::uint32_t to = row[wave.intent[u].slot];
    const Vertex& kept = mesh.vertex[to];
    const Planes seen = wave.planes[u].seen_from(static_cast<float>(kept.x - at.x) * mesh.cells_per_unit,
                                                 static_cast<float>(kept.y - at.y) * mesh.cells_per_unit, kept.z - at.z);
    wave.planes[to] = together(wave.planes[to], seen);
    for (std::uint32_t i = 0; i < at.valence; ++i) set_shared(wave.spent + row[i], wave_number);
    wave.into[u] = to;
    wave.cost[u] = kNever;
    at.flags |= kGone;
  }
};

struct WasTouched {
  WaveView wave;
  std::uint32_t wave_number;
  CORDILLERA_HD bool operator()(std::uint32_t v) const { return wave.spent[v] == wave_number; }
};

/// The row of one that is touched, of the rows of those that are gone: these nobody changes any more. It looks anew for a
/// neighbour only if the one that it would have become is gone, or its planes are others.
struct CloseRing {
  FitMesh mesh;
  WaveView wave;

  CORDILLERA_HD void operator()(std::uint32_t v) const {
    Vertex& at = mesh.vertex[v];
    std::uint32_t* const row = mesh.row(v);
    const std::uint32_t valence = at.valence, wanted = wave.intent[v].slot;
    constexpr std::uint32_t kLongest = 256;
    std::uint32_t ring[kLongest];
    std::uint32_t count = 0;
    bool stale = (wave.mark[v] & kStale) != 0;
    for (std::uint32_t i = 0; i < valence; ++i) {
      const std::uint32_t w = row[i];
      if (!mesh.vertex[w].gone()) {
        if (i == wanted) wave.intent[v].slot = count;
        ring[count++] = w;
        continue;
      }
      const std::uint32_t to = wave.into[w];
      stale |= i == wanted || to == v;
      if (to == v) {
        count = take_over(w, ring, count);
      } else if (row[i == 0 ? valence - 1 : i - 1] != to && row[i + 1 == valence ? 0 : i + 1] != to) {
        ring[count++] = to;
      }
    }
    for (std::uint32_t i = 0; i < count; ++i) row[i] = ring[i];
    at.valence = static_cast<std::uint16_t>(count);
    if (wave.cost[v] == kNever) {  // had no way out; may have one now
      wave.cost[v] = -kNever;
      stale = true;
    }
    wave.mark[v] = stale ? std::uint8_t{kStale} : std::uint8_t{0};
  }

 private:
  /// What the ring of one that is gone has, but for the vertex that took it in and the two beside that.
  CORDILLERA_HD std::uint32_t take_over(std::uint32_t gone, std::uint32_t* ring, std::uint32_t count) const {
    const std::uint32_t* const row = mesh.row(gone);
    const std::uint32_t valence = mesh.vertex[gone].valence, place = wave.intent[gone].slot;
    for (std::uint32_t k = 2; k + 1 < valence; ++k) {
      const std::uint32_t i = place + k;
      ring[count++] = row[i < valence ? i : i - valence];
    }
    return count;
  }
};

}  // namespace cordillera::gpu::fit
