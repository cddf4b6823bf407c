#pragma once
// Costs taken from the samples themselves: the error of a collapse is the squared error of its new star less what the same
// samples had.
#include "gpu/fit/edge_rules.h"
#include "gpu/fit/wave_view.h"

namespace cordillera::gpu::fit {

template <class Samples>
struct EvaluateBySamples {
  MeshView mesh;
  WaveView wave;
  Samples samples;
  const float* error;  ///< indexed by sample
  EdgeChoice choice = EdgeChoice::all;
  ErrorLimit limit;

  CORDILLERA_HD void operator()(std::uint32_t u) const {
    const Vertex& at = mesh.vertex[u];
    const std::uint32_t* const row = mesh.row(u);
    Candidate best;
    std::uint32_t best_slot = 0;
    for (std::uint32_t slot = 0; slot < at.valence; ++slot) {
      if (row[slot] < u) continue;
      const Place place = place_of_edge(mesh, u, slot, choice);
      if (place == Place::nowhere || !valences_allow(mesh, u, slot)) continue;
      const Candidate candidate = cheapest(u, row[slot], place);
      if (candidate.cost >= best.cost) continue;
      best = candidate;
      best_slot = slot;
    }
    wave.mark[u] &= static_cast<std::uint8_t>(~kStale);
    wave.cost[u] = best.cost;
    wave.intent[u] = {best.at, best.z, best_slot};
  }

 private:
  /// At the optimum of the quadric; where that turns a triangle, at the best of the ends and the middle.
  CORDILLERA_HD Candidate cheapest(std::uint32_t u, std::uint32_t v, Place place) const {
    const EdgeQuadric quadric(mesh, wave.planes, u, v);
    Candidate best = priced(u, v, quadric.rounded(quadric.best(place)));
    if (best.cost < kNever || place == Place::at_u || place == Place::at_v) return best;
    const Point places[3] = {mesh.vertex[u].at(), mesh.vertex[v].at(), quadric.middle()};
    for (int k = 0; k < (place == Place::anywhere ? 3 : 2); ++k) {
      const Candidate candidate = priced(u, v, quadric.at(places[k]));
      if (candidate.cost < best.cost) best = candidate;
    }
    return best;
  }

  CORDILLERA_HD Candidate priced(std::uint32_t u, std::uint32_t v, Candidate candidate) const {
    if (!link_sees(mesh, u, v, candidate.at)) {
      candidate.cost = kNever;
      return candidate;
    }
    float before = guard_cost(u) + guard_cost(v);
    HeightFit after;
    add_spike_guard(samples, candidate.at, candidate.z, after);
    each_link_edge(mesh, u, v, [&](const Vertex& a, const Vertex& b) {
      const HeightFit one = fit_and_sum(candidate, a, b, before);
      after.add(one);
      return true;
    });
    float h = after.best_height();
    if (mesh.vertex[u].fixed() || mesh.vertex[v].fixed())
      h = (mesh.vertex[u].fixed() ? mesh.vertex[u].z : mesh.vertex[v].z) - candidate.z;
    candidate.z += h;
    candidate.cost = after.at(h) - before;
    if (limit.set() && !link_within(mesh, samples, u, v, candidate, limit)) candidate.cost = kNever;
    return candidate;
  }

  /// As fit_triangle(), and adds up what the same samples have now.
  CORDILLERA_HD HeightFit fit_and_sum(const Candidate& candidate, const Vertex& a, const Vertex& b, float& before) const {
    const float inverse = 1 / static_cast<float>(turn(candidate.at, a.at(), b.at()));
    const float at_a = (a.z - candidate.z) * inverse, at_b = (b.z - candidate.z) * inverse;
    HeightFit fit;
    float now = 0;
    samples.in_triangle(candidate.at, a.at(), b.at(), [&](std::uint32_t sample, auto e0, auto e1, auto e2) {
      const float hat = static_cast<float>(e0) * inverse;
      const float rest = static_cast<float>(e1) * at_a + static_cast<float>(e2) * at_b - (samples.z[sample] - candidate.z);
      fit.ll += hat * hat;
      fit.lr += hat * rest;
      fit.rr += rest * rest;
      now += error[sample] * error[sample];
    });
    before += now;
    return fit;
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
  MeshView mesh;
  Samples samples;
  float* error;
  const std::uint32_t* list;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const Vertex at = mesh.vertex[list[i]];
    each_triangle(mesh, list[i], [&](const Vertex& a, const Vertex& b) {
      const float inverse = 1 / static_cast<float>(turn(at.at(), a.at(), b.at()));
      const float at_a = (a.z - at.z) * inverse, at_b = (b.z - at.z) * inverse;
      samples.in_triangle(at.at(), a.at(), b.at(), [&](std::uint32_t sample, auto, auto e1, auto e2) {
        error[sample] = static_cast<float>(e1) * at_a + static_cast<float>(e2) * at_b - (samples.z[sample] - at.z);
      });
      return true;
    });
  }
};

}  // namespace cordillera::gpu::fit
