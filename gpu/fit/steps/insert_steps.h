#pragma once
// New vertices where the surface is farthest from a sample: at the sample, with its height.
#include "gpu/fit/steps/claims.h"
#include "gpu/fit/steps/mesh_steps.h"

namespace cordillera::gpu::fit {

/// The sample that is farthest off, the first of several.
struct WorstSample {
  static constexpr float kNone = -1;
  float size = kNone;
  std::uint32_t sample = 0;
  CORDILLERA_HD void add(const WorstSample& other) {
    if (other.size > size) *this = other;
  }
};
struct WorstTriangle {
  const float* z;  ///< of samples
  Point a, b, c;
  float base, at_b, at_c;

  CORDILLERA_HD WorstTriangle(const float* samples, const Vertex& p, const Vertex& q, const Vertex& r)
      : z(samples), a(p.at()), b(q.at()), c(r.at()), base(p.z) {
    const float inverse = 1 / static_cast<float>(turn(a, b, c));
    at_b = (q.z - base) * inverse;
    at_c = (r.z - base) * inverse;
  }
  template <class Int>
  CORDILLERA_HD void add(WorstSample& worst, std::uint32_t sample, Int e0, Int e1, Int e2) const {
    if ((e0 == 0) + (e1 == 0) + (e2 == 0) > 1) return;  // the sample is a corner
    const float error = static_cast<float>(e1) * at_b + static_cast<float>(e2) * at_c - (z[sample] - base);
    worst.add({error < 0 ? -error : error, sample});
  }
};

/// The worst sample of a vertex' own triangles; as a cost, its error counts below zero.
template <class Samples>
struct FindWorst {
  FitMesh mesh;
  WaveView wave;
  Samples samples;

  template <class Lanes>
  CORDILLERA_HD void operator()(const Lanes& lanes, std::uint32_t u) const {
    const Vertex at = mesh.vertex[u];
    const std::uint32_t* const row = mesh.row(u);
    WorstSample worst;
    std::uint32_t slot = 0;
    lanes.template sum<WorstSample>(
        samples, at.triangles(),
        [&](std::uint32_t i) {
          const std::uint32_t a = row[i], b = row[mesh.next(at, i)];
          const bool own = u < a && u < b;
          return WorstTriangle(samples.z, at, own ? mesh.vertex[a] : at, own ? mesh.vertex[b] : at);
        },
        [&](std::uint32_t i, const WorstSample& one) {
          if (one.size <= worst.size) return;
          worst = one;
          slot = i;
        });
    if (!lanes.leads()) return;
    const bool found = worst.size > WorstSample::kNone;
    wave.mark[u] = 0;
    wave.cost[u] = found ? -(worst.size + kLeast) : kNever;
    if (found) wave.intent[u] = {samples.at(worst.sample), samples.z[worst.sample], slot};
  }

 private:
  static constexpr float kLeast = 1e-30f;
};

/// A vertex put into a triangle, or into one of its edges.
struct Insert {
  FitMesh mesh;
  WaveView wave;
  const std::uint32_t* list;
  const std::uint32_t* ids;  ///< numbers that are free

  /// The triangle, turned so that the edge that the sample lies on, if it lies on one, comes first; and the corner beyond that
  /// edge.
  struct Place {
    std::uint32_t a, b, c, beyond;
    bool on_edge, on_border;
  };
  CORDILLERA_HD Place place(std::uint32_t u) const {
    const Intent& intent = wave.intent[u];
    const std::uint32_t v = mesh.row(u)[intent.slot], w = mesh.row(u)[mesh.next(mesh.vertex[u], intent.slot)];
    if (turn(mesh.vertex[v].at(), mesh.vertex[w].at(), intent.at) == 0) return edge(v, w, u);
    if (turn(mesh.vertex[w].at(), mesh.vertex[u].at(), intent.at) == 0) return edge(w, u, v);
    if (turn(mesh.vertex[u].at(), mesh.vertex[v].at(), intent.at) == 0) return edge(u, v, w);
    return {u, v, w, 0, false, false};
  }
  CORDILLERA_HD Claimed claimed(std::uint32_t u) const {
    const Place at = place(u);
    return {{at.a, at.b, at.c, at.beyond}, at.on_edge && !at.on_border ? 4 : 3};
  }
  /// Is there room in the rows?
  CORDILLERA_HD bool possible(std::uint32_t u) const {
    const Place at = place(u);
    if (mesh.vertex[at.c].valence >= kMostNeighbours) return false;
    if (at.on_edge) return at.on_border || mesh.vertex[at.beyond].valence < kMostNeighbours;
    return mesh.vertex[at.a].valence < kMostNeighbours && mesh.vertex[at.b].valence < kMostNeighbours;
  }

  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t u = list[i], id = ids[i];
    const Place at = place(u);
    const Intent intent = wave.intent[u];
    std::uint32_t* const row = mesh.row(id);
    std::uint16_t valence = 3;
    if (!at.on_edge) {
      put_into_row(mesh, at.a, at.b, id);
      put_into_row(mesh, at.b, at.c, id);
      put_into_row(mesh, at.c, at.a, id);
      row[0] = at.a, row[1] = at.b, row[2] = at.c;
    } else {
      mesh.row(at.a)[place_in_row(mesh, at.a, at.b)] = id;
      mesh.row(at.b)[place_in_row(mesh, at.b, at.a)] = id;
      put_into_row(mesh, at.c, at.a, id);
      if (at.on_border) {
        row[0] = at.b, row[1] = at.c, row[2] = at.a;
      } else {
        put_into_row(mesh, at.beyond, at.b, id);
        row[0] = at.a, row[1] = at.beyond, row[2] = at.b, row[3] = at.c;
        valence = 4;
        wave.mark[at.beyond] = kStale;
      }
    }
    mesh.vertex[id] = {intent.at.x,
                       intent.at.y,
                       intent.z,
                       valence,
                       static_cast<std::uint8_t>(at.on_border ? kOpen : 0),
                       mesh.vertex[at.a].steep};
    wave.mark[at.a] = wave.mark[at.b] = wave.mark[at.c] = wave.mark[id] = kStale;
    wave.cost[id] = kNever;
  }

 private:
  CORDILLERA_HD Place edge(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    const Vertex& at = mesh.vertex[a];
    const std::uint32_t slot = place_in_row(mesh, a, b);
    if (at.open() && slot == 0) return {a, b, c, c, true, true};
    return {a, b, c, mesh.row(a)[slot == 0 ? at.valence - 1u : slot - 1], true, false};
  }
};

struct WantsInsert {
  Insert insert;
  Count most_class;
  CORDILLERA_HD bool operator()(std::uint32_t v) const {
    return insert.wave.cost[v] < 0 && cost_class(insert.wave.cost[v]) <= most_class.value() && insert.possible(v);
  }
};

/// Into a border edge: that adds one triangle, not two.
struct IsIntoBorder {
  Insert insert;
  CORDILLERA_HD bool operator()(std::uint32_t u) const { return insert.place(u).on_border; }
};

}  // namespace cordillera::gpu::fit
