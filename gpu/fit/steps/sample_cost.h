#pragma once
// Costs taken from the samples themselves: the error of a collapse is the squared error of its new star less what the same
// samples had.
#include "gpu/fit/steps/edge_rules.h"
#include "gpu/fit/steps/mesh_steps.h"
#include "gpu/fit/steps/wave_view.h"

namespace cordillera::gpu::fit {

/// The fit of a new star, and what the same samples have now.
struct StarChange {
  HeightFit after;
  float before = 0;
  CORDILLERA_HD void add(const StarChange& other) {
    after.add(other.after);
    before += other.before;
  }
};
struct ChangedTriangle : FitTriangle {
  const float* error;  ///< indexed by sample

  template <class Int>
  CORDILLERA_HD void add(StarChange& to, std::uint32_t sample, Int e0, Int e1, Int e2) const {
    FitTriangle::add(to.after, sample, e0, e1, e2);
    to.before += error[sample] * error[sample];
  }
};

template <class Samples>
struct EvaluateBySamples {
  FitMesh mesh;
  WaveView wave;
  Samples samples;
  const float* error;  ///< indexed by sample
  EdgeChoice choice = EdgeChoice::all;
  ErrorLimit limit;

  template <class Lanes>
  CORDILLERA_HD void operator()(const Lanes& lanes, std::uint32_t u) const {
    const Vertex& at = mesh.vertex[u];
    const std::uint32_t* const row = mesh.row(u);
    Choice best;
    for (std::uint32_t slot = lanes.part(); slot < at.valence; slot += lanes.parts()) {
      if (row[slot] < u) continue;
      const Leeway place = place_of_edge(mesh, u, slot, choice);
      if (place == Leeway::nowhere || !valences_allow(mesh, u, slot)) continue;
      best.take({cheapest(lanes, u, row[slot], place), slot});
    }
    lanes.each_part(best, [&](const Choice& other) { best.take(other); });
    if (!lanes.leads()) return;
    wave.mark[u] &= static_cast<std::uint8_t>(~kStale);
    wave.cost[u] = best.candidate.cost;
    wave.intent[u] = {best.candidate.at, best.candidate.z, best.slot};
  }

 private:
  /// The cheapest, the first of several.
  struct Choice {
    Candidate candidate;
    std::uint32_t slot = 0;
    CORDILLERA_HD void take(const Choice& other) {
      const float mine = candidate.cost, its = other.candidate.cost;
      if (its < mine || (its == mine && its < kNever && other.slot < slot)) *this = other;
    }
  };

  /// At the optimum of the quadric; where that turns a triangle, at the best of the ends and the middle.
  template <class Lanes>
  CORDILLERA_HD Candidate cheapest(const Lanes& lanes, std::uint32_t u, std::uint32_t v, Leeway place) const {
    const EdgeQuadric quadric(mesh, wave.planes, u, v);
    Candidate best = priced(lanes, u, v, quadric.rounded(quadric.best(place)));
    if (best.cost < kNever || place == Leeway::at_u || place == Leeway::at_v) return best;
    const Point places[3] = {mesh.vertex[u].at(), mesh.vertex[v].at(), quadric.middle()};
    for (int k = 0; k < (place == Leeway::anywhere ? 3 : 2); ++k) {
      const Candidate candidate = priced(lanes, u, v, quadric.at(places[k]));
      if (candidate.cost < best.cost) best = candidate;
    }
    return best;
  }

  template <class Lanes>
  CORDILLERA_HD Candidate priced(const Lanes& lanes, std::uint32_t u, std::uint32_t v, Candidate candidate) const {
    if (!link_sees(mesh, u, v, candidate.at)) {
      candidate.cost = kNever;
      return candidate;
    }
    StarChange change;
    add_spike_guard(samples, candidate.at, candidate.z, change.after);
    change.before = guard_cost(u) + guard_cost(v);
    const std::uint32_t at_u = mesh.vertex[u].triangles();
    lanes.template sum<StarChange>(
        samples, at_u + mesh.vertex[v].triangles(),
        [&](std::uint32_t i) { return i < at_u ? left_by(candidate, u, i, v) : left_by(candidate, v, i - at_u, u); },
        [&](std::uint32_t, const StarChange& one) { change.add(one); });
    float h = change.after.best_height();
    if (mesh.vertex[u].fixed() || mesh.vertex[v].fixed())
      h = (mesh.vertex[u].fixed() ? mesh.vertex[u].z : mesh.vertex[v].z) - candidate.z;
    candidate.z += h;
    candidate.cost = change.after.at(h) - change.before;
    if (!link_rises(mesh, u, v, candidate) || (limit.set() && !link_within(mesh, samples, u, v, candidate, limit)))
      candidate.cost = kNever;
    return candidate;
  }

  /// What becomes of the i-th triangle of an end; one that has both ends becomes nothing.
  CORDILLERA_HD ChangedTriangle left_by(const Candidate& candidate, std::uint32_t end, std::uint32_t i,
                                        std::uint32_t other) const {
    const std::uint32_t* const row = mesh.row(end);
    const std::uint32_t a = row[i], b = row[mesh.next(mesh.vertex[end], i)];
    const Vertex none{candidate.at.x, candidate.at.y, candidate.z, 0, 0, 0};
    const bool gone = a == other || b == other;
    return {FitTriangle(samples.z, candidate.at, gone ? none : mesh.vertex[a], gone ? none : mesh.vertex[b], candidate.z), error};
  }

  CORDILLERA_HD float guard_cost(std::uint32_t v) const {
    HeightFit guard;
    add_spike_guard(samples, mesh.vertex[v].at(), mesh.vertex[v].z, guard);
    return guard.rr;
  }
};

/// What the samples of new stars have now.
template <class Samples>
struct RenewErrors {
  FitMesh mesh;
  Samples samples;
  float* error;

  template <class Lanes>
  CORDILLERA_HD void operator()(const Lanes& lanes, std::uint32_t v) const {
    const Vertex at = mesh.vertex[v];
    const std::uint32_t* const row = mesh.row(v);
    lanes.each(samples, at.triangles(), [&](std::uint32_t i) {
      return ErrorTriangle{samples.z, error, at, mesh.vertex[row[i]], mesh.vertex[row[mesh.next(at, i)]]};
    });
  }
};

}  // namespace cordillera::gpu::fit
