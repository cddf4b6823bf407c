#pragma once
// A window: the candidates that are tried at the same time (sections 4.3 and 5), and what becomes of each.
#include <type_traits>

#include "gpu/cleap/half_edge.h"
#include "gpu/cleap/metrics.h"
#include "gpu/cleap/structure.h"

namespace cordillera::gpu::cleap {

/// What became of a candidate. The order is that of the tally.
enum class Fate : std::uint8_t {
  collapsed,         ///< passed everything; so far, or for good
  collapsed_border,  ///< likewise, an edge with one triangle
  gone,              ///< an earlier collapse took the edge away
  locked,            ///< another candidate has a triangle of the vicinity
  inverted,          ///< a triangle would turn over
  border,            ///< an end is on the border
  crowded,           ///< the new vertex would have too many triangles
  surplus,           ///< passed everything, but the target is reached without it
};
inline constexpr std::size_t kFates = 8;

CORDILLERA_HD inline bool goes(Fate fate) { return fate <= Fate::collapsed_border; }

/// What may happen on the border (section 4.5.2, and its future work).
enum class Border : std::uint8_t {
  keep,      ///< as published: no edge goes that has an end on it
  collapse,  ///< half-edge collapses onto it, and along it where it is straight in the plan
};

/// What counts as turned over (section 4.5.1).
enum class Inversion : std::uint8_t {
  sign,     ///< the sign of an area, as the text says
  normals,  ///< any other normal, as Algorithm 7 says: nothing collapses but on flat ground
};

struct Window {
  std::uint32_t count = 0;
  const std::uint32_t* pool = nullptr;   ///< edges, in the order in which they are tried
  const std::uint32_t* queue = nullptr;  ///< places in the pool of those that came back, tried first
  std::uint32_t queued = 0;
  std::uint32_t next = 0;  ///< the place in the pool after them
  Fate* fate = nullptr;    ///< indexed by candidate, like the others
  std::int32_t* edge = nullptr;
  Position* to = nullptr;        ///< where the new vertex goes
  std::int32_t* left = nullptr;  ///< three a candidate: the triangles that go (-1: none), the vertex that stays
  Tag* tag = nullptr;            ///< of tiles: what the vertex that stays will be

  CORDILLERA_HD std::uint32_t place(std::uint32_t i) const { return i < queued ? queue[i] : next + (i - queued); }
};

/// In the plan, three points on a line, as far as doubles can say.
CORDILLERA_HD inline bool in_line(const Position& p, const Position& q, const Position& r) {
  const double ux = q.x - p.x, uy = q.y - p.y, vx = r.x - q.x, vy = r.y - q.y;
  const double one = ux * vy, other = uy * vx, turn = one - other, size = ux * ux + uy * uy + vx * vx + vy * vy;
  constexpr double kAngle = 1e-12;
  return (turn < 0 ? -turn : turn) <= kAngle * size && ux * vx + uy * vy > 0;
}

/// Whether the border runs straight through a vertex on it: those two neighbours with which it shares one triangle only.
CORDILLERA_HD inline bool is_straight(const Arrays& mesh, std::int32_t v) {
  std::int32_t end[2] = {-1, -1}, found = 0;
  all_triangles_at(mesh, v, [&](std::int32_t triangle) {
    for (std::int32_t k = 0; k < 3; ++k) {
      const std::int32_t w = mesh.corner[3 * triangle + k];
      if (w == v) continue;
      std::int32_t shared = 0;
      all_triangles_at(mesh, v, [&](std::int32_t other) {
        for (std::int32_t i = 0; i < 3; ++i) shared += mesh.corner[3 * other + i] == w;
        return true;
      });
      if (shared != 1) continue;
      if (found < 2) end[found] = w;
      ++found;
    }
    return true;
  });
  return found == 2 && in_line(mesh.vertex[end[0]], mesh.vertex[v], mesh.vertex[end[1]]);
}

/// By candidate, the first step of a window: which edge, whether it is still there, where its end goes.
template <class Metric>
struct LoadCandidate {
  Arrays mesh;
  Window window;
  Border border;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t e = window.pool[window.place(static_cast<std::uint32_t>(i))];
    window.edge[i] = static_cast<std::int32_t>(e);
    const Edge& edge = mesh.edge[e];
    if (edge.n[0] < 0) {
      window.fate[i] = Fate::gone;
      return;
    }
    window.fate[i] = edge.b[0] < 0 ? Fate::collapsed_border : Fate::collapsed;
    if constexpr (std::is_same_v<Metric, QuadricOnTile>) return place_on_tile(i, edge);
    window.to[i] = Metric::place(mesh, edge);
    if (border == Border::collapse) place_on_border(i, edge);
  }

 private:
  CORDILLERA_HD void place_on_tile(std::size_t i, const Edge& edge) const {
    const HalfEdge half = best_half_edge(mesh, edge);
    if (half.stays < 0) {
      window.fate[i] = Fate::border;
      return;
    }
    window.to[i] = mesh.vertex[half.stays];
    window.tag[i] = mesh.tag[half.stays];
    if (half.spent > window.tag[i].spent) window.tag[i].spent = half.spent;
  }
  /// An inner vertex goes to the one on the border; along the border, the one goes through which it runs straight.
  CORDILLERA_HD void place_on_border(std::size_t i, const Edge& edge) const {
    const std::int32_t v1 = edge.n[0], v2 = edge.n[1];
    const bool first = mesh.border[v1] != 0, second = mesh.border[v2] != 0;
    if (!first && !second) return;
    if (first != second) {
      window.to[i] = mesh.vertex[first ? v1 : v2];
    } else if (edge.b[0] < 0 && is_straight(mesh, v1)) {
      window.to[i] = mesh.vertex[v2];
    } else if (edge.b[0] < 0 && is_straight(mesh, v2)) {
      window.to[i] = mesh.vertex[v1];
    } else {
      window.fate[i] = Fate::border;
    }
  }
};

struct FateOf {
  const Fate* fate;
  CORDILLERA_HD std::uint32_t operator()(std::size_t i) const { return static_cast<std::uint32_t>(fate[i]); }
};
/// For lists of candidates that come back.
struct WasLocked {
  const Fate* fate;
  CORDILLERA_HD bool operator()(std::uint32_t i) const { return fate[i] == Fate::locked; }
};
struct PlaceInPool {
  Window window;
  const std::uint32_t* candidate;
  std::uint32_t* place;
  CORDILLERA_HD void operator()(std::size_t i) const { place[i] = window.place(candidate[i]); }
};

/// Of those that could go, only the first so many do.
struct MarkGoing {
  const Fate* fate;
  std::uint32_t* going;
  CORDILLERA_HD void operator()(std::size_t i) const { going[i] = goes(fate[i]) ? 1 : 0; }
};
struct CutSurplus {
  Fate* fate;
  const std::uint32_t* before;
  std::uint32_t most;
  CORDILLERA_HD void operator()(std::size_t i) const {
    if (goes(fate[i]) && before[i] >= most) fate[i] = Fate::surplus;
  }
};

}  // namespace cordillera::gpu::cleap
