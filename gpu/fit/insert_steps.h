#pragma once
// New vertices where the surface is farthest from a sample: at the sample, with its height.
#include "gpu/fit/claims.h"
#include "gpu/fit/mesh_steps.h"

namespace cordillera::gpu::fit {

/// The worst sample of a vertex' own triangles; as a cost, its error counts below zero.
template <class Samples>
struct FindWorst {
  MeshView mesh;
  WaveView wave;
  Samples samples;
  const std::uint32_t* list;
  float least_error = 0;  ///< only greater ones count; below zero: all

  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t u = list[i];
    float worst = least_error;
    wave.cost[u] = kNever;
    wave.mark[u] = 0;
    each_own_triangle(mesh, u, [&](std::uint32_t slot, std::uint32_t a, std::uint32_t b) { look(u, slot, a, b, worst); });
  }

 private:
  static constexpr float kLeast = 1e-30f;

  CORDILLERA_HD void look(std::uint32_t u, std::uint32_t slot, std::uint32_t v, std::uint32_t w, float& worst) const {
    const Vertex &a = mesh.vertex[u], &b = mesh.vertex[v], &c = mesh.vertex[w];
    const float inverse = 1 / static_cast<float>(turn(a.at(), b.at(), c.at()));
    const float at_b = (b.z - a.z) * inverse, at_c = (c.z - a.z) * inverse;
    samples.in_triangle(a.at(), b.at(), c.at(), [&](std::uint32_t sample, auto e0, auto e1, auto e2) {
      const float error = static_cast<float>(e1) * at_b + static_cast<float>(e2) * at_c - (samples.z[sample] - a.z);
      const float size = error < 0 ? -error : error;
      if (size <= worst || (e0 == 0) + (e1 == 0) + (e2 == 0) > 1) return;  // the sample is a corner
      worst = size;
      wave.cost[u] = -(size + kLeast);
      wave.intent[u] = {samples.at(sample), samples.z[sample], slot};
    });
  }
};

/// A vertex put into a triangle, or into one of its edges.
struct Insert {
  MeshView mesh;
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
    mesh.vertex[id] = {intent.at.x, intent.at.y, intent.z, valence, static_cast<std::uint8_t>(at.on_border ? kOpen : 0), 0};
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
  std::uint32_t most_class;
  CORDILLERA_HD bool operator()(std::uint32_t v) const {
    return insert.wave.cost[v] < 0 && cost_class(insert.wave.cost[v]) <= most_class && insert.possible(v);
  }
};

/// Insertions into a border edge: they add one triangle, not two.
struct DescribeInsert {
  Insert insert;
  const std::uint32_t* list;
  std::uint64_t* keys;
  std::uint32_t* added;
  CORDILLERA_HD void operator()(std::size_t i) const {
    keys[i] = claim_key(insert.mesh, insert.wave, list[i], 0);
    added[i] = insert.place(list[i]).on_border ? 1 : 2;
  }
};

}  // namespace cordillera::gpu::fit
