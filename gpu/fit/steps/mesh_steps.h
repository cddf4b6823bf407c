#pragma once
// What is done to every vertex when a mesh is taken in, closed up and given back.
#include "gpu/fit/steps/lanes.h"
#include "gpu/fit/steps/wave_view.h"
#include "gpu/mesh/wedges.h"

namespace cordillera::gpu::fit {

using Triangle = std::array<std::uint32_t, 3>;

struct RingFacts {
  std::uint32_t broken = 0;  ///< 1: some vertex has no single fan
  std::uint32_t widest = 0;  ///< most triangles at a vertex
};

struct WidestFan {
  const std::uint32_t* count;
  RingFacts* facts;
  CORDILLERA_HD void operator()(std::size_t v) const { raise_to(&facts->widest, count[v]); }
};

/// The ring of a vertex from its wedges, put end to end; whatever order they come in, the row is the same.
struct ChainFan {
  FitMesh mesh;
  const std::uint32_t* end;  ///< indexed by vertex, of its wedges
  Wedge* wedges;
  RingFacts* facts;

  CORDILLERA_HD void operator()(std::size_t v) const {
    const std::uint32_t begin = v == 0 ? 0 : end[v - 1], count = end[v] - begin;
    Vertex& at = mesh.vertex[v];
    std::uint32_t* const row = mesh.row(static_cast<std::uint32_t>(v));
    if (count == 0 || !chain(wedges + begin, count, row)) {
      at.flags = kGone;
      set_shared(&facts->broken, std::uint32_t{1});
      return;
    }
    const Wedge& last = wedges[end[v] - 1];
    const bool open = last.to != row[0];
    if (open) row[count] = last.to;
    at.valence = static_cast<std::uint16_t>(count + std::uint32_t{open});
    at.flags = static_cast<std::uint8_t>(open ? kOpen : 0);
    if (!open && count < 3) set_shared(&facts->broken, std::uint32_t{1});
  }

 private:
  CORDILLERA_HD bool chain(Wedge* fan, std::uint32_t count, std::uint32_t* row) const {
    if (has_duplicates(fan, count)) return false;
    swap_wedges(fan[0], fan[first_wedge(fan, count)]);
    row[0] = fan[0].from;
    for (std::uint32_t i = 1; i < count; ++i) {
      std::uint32_t next = i;
      while (next < count && fan[next].from != fan[i - 1].to) ++next;
      if (next == count) return false;
      swap_wedges(fan[i], fan[next]);
      row[i] = fan[i].from;
    }
    return true;
  }
};

/// Samples of border vertices lean into the mesh. Where no way leads inside, as in a very narrow corner, the vertex stays as it
/// is.
template <class Samples>
struct LeanInwards {
  FitMesh mesh;
  Samples samples;
  std::uint8_t* lean;  ///< indexed by sample, zeroed

  CORDILLERA_HD void operator()(std::size_t v) const {
    Vertex& at = mesh.vertex[v];
    if (!at.open()) return;
    for (std::uint8_t way = 0; way < 8; ++way) {
      if (!leads_inside(static_cast<std::uint32_t>(v), way)) continue;
      lean[samples.of_vertex(static_cast<std::uint32_t>(v), at.at())] = way;
      return;
    }
    at.flags |= kFixed;
  }

 private:
  CORDILLERA_HD bool leads_inside(std::uint32_t v, std::uint8_t way) const {
    const Vertex& at = mesh.vertex[v];
    const std::uint32_t* const row = mesh.row(v);
    for (std::uint32_t i = 0; i < at.triangles(); ++i) {
      const Vertex &a = mesh.vertex[row[i]], &b = mesh.vertex[row[mesh.next(at, i)]];
      if (leans_left(a.x - at.x, a.y - at.y, way) && leans_left(at.x - b.x, at.y - b.y, way)) return true;
    }
    return false;
  }
};

/// Triangles of v whose lowest vertex it is: visit(i, a, b).
template <class Visit>
CORDILLERA_HD void each_own_triangle(const FitMesh& mesh, std::uint32_t v, const Visit& visit) {
  const Vertex& at = mesh.vertex[v];
  const std::uint32_t* const row = mesh.row(v);
  for (std::uint32_t i = 0; i < at.triangles(); ++i) {
    const std::uint32_t a = row[i], b = row[mesh.next(at, i)];
    if (v < a && v < b) visit(i, a, b);
  }
}

/// Vertices of the input that lie in or on a triangle of which they are no corner, and triangles that rounding has turned.
template <class Samples>
struct FindOverlap {
  FitMesh mesh;
  Samples samples;
  std::uint32_t* found;  ///< zeroed; ~ of the lowest sample where it is so

  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto v = static_cast<std::uint32_t>(i);
    each_own_triangle(mesh, v, [&](std::uint32_t, std::uint32_t a, std::uint32_t b) {
      const Point p = mesh.vertex[v].at(), q = mesh.vertex[a].at(), r = mesh.vertex[b].at();
      if (turn(p, q, r) <= 0) return raise_to(found, ~samples.of_vertex(v, p));
      if (samples.has_only_corners(p, q, r)) return;
      samples.in_triangle(p, q, r, [&](std::uint32_t sample, auto e0, auto e1, auto e2) {
        if ((e0 == 0) + (e1 == 0) + (e2 == 0) < 2) raise_to(found, ~sample);
      });
    });
  }
};

struct CountOwnTriangles {
  FitMesh mesh;
  const std::uint32_t* list;
  std::uint32_t* count;
  CORDILLERA_HD void operator()(std::size_t i) const {
    std::uint32_t own = 0;
    each_own_triangle(mesh, list[i], [&](std::uint32_t, std::uint32_t, std::uint32_t) { ++own; });
    count[i] = own;
  }
};

/// Survivors and their triangles, numbered anew.
struct PackVertex {
  FitMesh mesh;
  const std::uint32_t* list;
  const std::uint32_t* number;  ///< indexed by vertex
  const std::uint32_t* first;   ///< indexed by survivor: its first triangle
  Point* at;
  float* z;
  Triangle* triangles;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t v = list[i];
    at[i] = mesh.vertex[v].at();
    z[i] = mesh.vertex[v].z;
    std::uint32_t to = first[i];
    each_own_triangle(mesh, v, [&](std::uint32_t, std::uint32_t a, std::uint32_t b) {
      triangles[to++] = {number[v], number[a], number[b]};
    });
  }
};

struct NumberSurvivor {
  const std::uint32_t* list;
  std::uint32_t* number;
  CORDILLERA_HD void operator()(std::size_t i) const { number[list[i]] = static_cast<std::uint32_t>(i); }
};

struct EmptyVertex {
  FitMesh mesh;
  WaveView wave;
  std::uint32_t first;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto v = static_cast<std::uint32_t>(first + i);
    mesh.vertex[v] = {0, 0, 0, 0, kGone, 0};
    wave.mark[v] = 0;
    wave.cost[v] = kNever;
    wave.spent[v] = 0;
    wave.lock[v] = ~std::uint64_t{0};
  }
};

/// Survivors side by side, in their order.
struct MoveSurvivor {
  FitMesh from, to;
  const std::uint32_t* list;
  const std::uint32_t* number;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t v = list[i];
    to.vertex[i] = from.vertex[v];
    std::uint32_t* const row = to.row(static_cast<std::uint32_t>(i));
    for (std::uint32_t k = 0; k < from.vertex[v].valence; ++k) row[k] = number[from.row(v)[k]];
  }
};

struct MoveWave {
  WaveView from, to;
  const std::uint32_t* list;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t v = list[i];
    to.cost[i] = from.cost[v];
    to.intent[i] = from.intent[v];
    to.mark[i] = from.mark[v];
    to.planes[i] = from.planes[v];
  }
};

/// The surface minus the samples of a triangle.
struct ErrorTriangle {
  const float* z;  ///< of samples
  float* error;    ///< likewise
  Point a, b, c;
  float base, at_b, at_c;

  CORDILLERA_HD ErrorTriangle(const float* samples, float* errors, const Vertex& p, const Vertex& q, const Vertex& r)
      : z(samples), error(errors), a(p.at()), b(q.at()), c(r.at()), base(p.z) {
    const float inverse = 1 / static_cast<float>(turn(a, b, c));
    at_b = (q.z - base) * inverse;
    at_c = (r.z - base) * inverse;
  }
  template <class Int>
  CORDILLERA_HD void visit(std::uint32_t sample, Int, Int e1, Int e2) const {
    error[sample] = static_cast<float>(e1) * at_b + static_cast<float>(e2) * at_c - (z[sample] - base);
  }
};

template <class Samples>
struct MeasureErrors {
  FitMesh mesh;
  Samples samples;
  float* error;  ///< indexed by sample

  template <class Lanes>
  CORDILLERA_HD void operator()(const Lanes& lanes, std::uint32_t v) const {
    const Vertex at = mesh.vertex[v];
    if (at.gone()) return;
    const std::uint32_t* const row = mesh.row(v);
    lanes.each(samples, at.triangles(), [&](std::uint32_t i) {
      const std::uint32_t a = row[i], b = row[mesh.next(at, i)];
      const bool own = v < a && v < b;
      return ErrorTriangle{samples.z, error, at, own ? mesh.vertex[a] : at, own ? mesh.vertex[b] : at};
    });
  }
};

}  // namespace cordillera::gpu::fit
