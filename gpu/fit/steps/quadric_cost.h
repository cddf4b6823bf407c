#pragma once
// Costs taken from the planes around an edge.
#include "gpu/fit/steps/edge_rules.h"
#include "gpu/fit/steps/wave_view.h"

namespace cordillera::gpu::fit {

/// A vertex' cheapest edge by the quadric.
template <class Samples>
struct EvaluateByQuadric {
  FitMesh mesh;
  WaveView wave;
  Samples samples;
  EdgeChoice choice = EdgeChoice::all;
  ErrorLimit limit;

  CORDILLERA_HD void operator()(std::uint32_t u) const {
    Candidate best;
    std::uint32_t best_slot = 0;
    bool done = false;
    for (Edge tried = first_edge(u); !done && tried.cost < best.cost; tried = done ? tried : cheapest_edge(u, tried)) {
      const Candidate candidate = what_is_possible(u, tried, done);
      if (candidate.cost >= best.cost) continue;
      best = candidate;
      best_slot = tried.slot;
    }
    wave.mark[u] &= static_cast<std::uint8_t>(~kStale);
    wave.cost[u] = best.cost;
    wave.intent[u] = {best.at, best.z, best_slot};
  }

 private:
  struct Edge {
    std::uint32_t slot;
    float x, y, cost;
    CORDILLERA_HD bool comes_after(const Edge& other) const {
      return cost > other.cost || (cost == other.cost && slot > other.slot);
    }
  };
  CORDILLERA_HD Edge first_edge(std::uint32_t u) const { return cheapest_edge(u, {0, 0, 0, -1}); }

  /// The cheapest edge that comes after another: mostly the first will do, and only that is looked at closely.
  CORDILLERA_HD Edge cheapest_edge(std::uint32_t u, const Edge& after) const {
    Edge cheapest{0, 0, 0, kNever};
    const std::uint32_t* const row = mesh.row(u);
    const std::uint32_t valence = mesh.vertex[u].valence;
    for (std::uint32_t slot = 0; slot < valence; ++slot) {
      if (row[slot] < u) continue;
      const Leeway place = place_of_edge(mesh, u, slot, choice);
      if (place == Leeway::nowhere) continue;
      const auto optimum = EdgeQuadric(mesh, wave.planes, u, row[slot]).best(place);
      const Edge edge{slot, optimum.x, optimum.y, optimum.cost};
      if (edge.cost < cheapest.cost && edge.comes_after(after)) cheapest = edge;
    }
    return cheapest;
  }

  /// as_wished: at the optimum itself; no other edge is cheaper.
  CORDILLERA_HD Candidate what_is_possible(std::uint32_t u, const Edge& edge, bool& as_wished) const {
    if (!valences_allow(mesh, u, edge.slot)) return {};
    const std::uint32_t v = mesh.row(u)[edge.slot];
    const EdgeQuadric quadric(mesh, wave.planes, u, v);
    const Candidate candidate = quadric.rounded(EdgeQuadric::Optimum{edge.x, edge.y, edge.cost});
    as_wished = possible(u, v, candidate);
    return as_wished ? candidate : fallback(quadric, u, v, place_of_edge(mesh, u, edge.slot, choice));
  }

  CORDILLERA_HD bool possible(std::uint32_t u, std::uint32_t v, const Candidate& candidate) const {
    return link_sees(mesh, u, v, candidate.at) && link_rises(mesh, u, v, candidate) &&
           (!limit.set() || link_within(mesh, samples, u, v, candidate, limit));
  }

  CORDILLERA_HD Candidate fallback(const EdgeQuadric& quadric, std::uint32_t u, std::uint32_t v, Leeway place) const {
    Candidate best;
    if (place == Leeway::at_u || place == Leeway::at_v) return best;
    const Point places[3] = {mesh.vertex[u].at(), mesh.vertex[v].at(), quadric.middle()};
    for (int k = 0; k < (place == Leeway::anywhere ? 3 : 2); ++k) {
      const Candidate candidate = quadric.at(places[k]);
      if (candidate.cost < best.cost && possible(u, v, candidate)) best = candidate;
    }
    return best;
  }
};

}  // namespace cordillera::gpu::fit
