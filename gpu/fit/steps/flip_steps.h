#pragma once
// Edges turned where that lessens the squared error of their two triangles.
#include "gpu/fit/steps/claims.h"

namespace cordillera::gpu::fit {

/// The edge from u to v, and the far corners of its triangles, left and right.
struct Quad {
  std::uint32_t u, v, left, right;
};
CORDILLERA_HD inline Quad quad_of(const FitMesh& mesh, std::uint32_t u, std::uint32_t slot) {
  const Vertex& at = mesh.vertex[u];
  const std::uint32_t* const row = mesh.row(u);
  return {u, row[slot], row[mesh.next(at, slot)], row[slot == 0 ? at.valence - 1u : slot - 1]};
}

CORDILLERA_HD inline bool valences_allow_flip(const FitMesh& mesh, const Quad& quad) {
  return mesh.vertex[quad.left].valence < kMostNeighbours && mesh.vertex[quad.right].valence < kMostNeighbours &&
         may_lose_neighbour(mesh.vertex[quad.u]) && may_lose_neighbour(mesh.vertex[quad.v]);
}

/// The best turn of a vertex' edges; as a cost, the gain counts below zero.
template <class Samples>
struct EvaluateFlips {
  FitMesh mesh;
  WaveView wave;
  Samples samples;
  ErrorLimit limit;

  template <class Lanes>
  CORDILLERA_HD void operator()(const Lanes& lanes, std::uint32_t u) const {
    const Vertex& at = mesh.vertex[u];
    Choice best;
    for (std::uint32_t slot = lanes.part(); slot < at.valence; slot += lanes.parts()) {
      if (mesh.row(u)[slot] < u || (at.open() && (slot == 0 || slot + 1 == at.valence))) continue;
      best.take({gain_of(lanes, quad_of(mesh, u, slot)), slot});
    }
    lanes.each_part(best, [&](const Choice& other) { best.take(other); });
    if (!lanes.leads()) return;
    wave.mark[u] = 0;
    wave.cost[u] = best.gain > 0 ? -best.gain : kNever;
    wave.intent[u].slot = best.slot;
  }

 private:
  /// The greatest gain, the first of several.
  struct Choice {
    float gain = 0;
    std::uint32_t slot = 0;
    CORDILLERA_HD void take(const Choice& other) {
      if (other.gain > gain || (other.gain == gain && gain > 0 && other.slot < slot)) *this = other;
    }
  };

  template <class Lanes>
  CORDILLERA_HD float gain_of(const Lanes& lanes, const Quad& quad) const {
    const Vertex &u = mesh.vertex[quad.u], &v = mesh.vertex[quad.v], &left = mesh.vertex[quad.left],
                 &right = mesh.vertex[quad.right];
    if (!valences_allow_flip(mesh, quad)) return 0;
    if (turn(u.at(), right.at(), left.at()) <= 0 || turn(v.at(), left.at(), right.at()) <= 0) return 0;
    if (!may_see(left, right)) return 0;
    const float before = error_of(lanes, {&u, &v}, {&v, &u}, {&left, &right});
    if (before <= kNothing) return 0;
    const float after = error_of(lanes, {&u, &v}, {&right, &left}, {&left, &right});
    if (before - after <= kGain * before) return 0;
    if (limit.set() && !(is_within(samples, u, right, left, limit) && is_within(samples, v, left, right, limit))) return 0;
    return before - after;
  }

  /// Squared, of two triangles.
  struct Both {
    const Vertex *one, *other;
  };
  template <class Lanes>
  CORDILLERA_HD float error_of(const Lanes& lanes, Both a, Both b, Both c) const {
    float sum = 0;
    lanes.template sum<HeightFit>(
        samples, 2,
        [&](std::uint32_t i) {
          const Vertex& first = i == 0 ? *a.one : *a.other;
          return FitTriangle(samples.z, first.at(), i == 0 ? *b.one : *b.other, i == 0 ? *c.one : *c.other, first.z);
        },
        [&](std::uint32_t, const HeightFit& fit) { sum += fit.rr; });
    return sum;
  }

  static constexpr float kNothing = 1e-6f, kGain = 1e-3f;
};

struct Flip {
  FitMesh mesh;
  WaveView wave;

  CORDILLERA_HD Claimed claimed(std::uint32_t u) const {
    const Quad quad = quad_of(mesh, u, wave.intent[u].slot);
    return {{quad.u, quad.v, quad.left, quad.right}, 4};
  }
  CORDILLERA_HD void operator()(std::uint32_t vertex) const {
    const Quad quad = quad_of(mesh, vertex, wave.intent[vertex].slot);
    drop_from_row(mesh, quad.u, quad.v);
    drop_from_row(mesh, quad.v, quad.u);
    put_into_row(mesh, quad.left, quad.u, quad.right);
    put_into_row(mesh, quad.right, quad.v, quad.left);
    wave.mark[quad.u] = wave.mark[quad.v] = wave.mark[quad.left] = wave.mark[quad.right] = kStale;
  }
};

/// Far corners may have filled up since the gain was found.
struct WantsFlip {
  FitMesh mesh;
  WaveView wave;
  CORDILLERA_HD bool operator()(std::uint32_t v) const {
    return wave.cost[v] < 0 && !(wave.mark[v] & kStale) && valences_allow_flip(mesh, quad_of(mesh, v, wave.intent[v].slot));
  }
};

}  // namespace cordillera::gpu::fit
