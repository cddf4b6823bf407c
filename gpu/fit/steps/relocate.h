#pragma once
// One vertex moved to where its star fits the samples better: a Gauss-Newton step in x, y and z, taken as far as it lessens the
// true error. What the collapses place well is polished by it, what they place badly is rescued.
#include "gpu/fit/steps/star_energy.h"

namespace cordillera::gpu::fit {

CORDILLERA_HD inline float square_root(float value) {
#ifdef __CUDA_ARCH__
  return __fsqrt_rn(value);
#else
  return __builtin_sqrtf(value);
#endif
}

/// Along which axes a vertex may move.
struct Freedom {
  bool x = true, y = true;
};
CORDILLERA_HD inline Freedom freedom_of(const FitMesh& mesh, std::uint32_t v) {
  const Vertex& at = mesh.vertex[v];
  if (!at.open()) return {};
  if (!is_straight(mesh, v)) return {false, false};
  const Vertex& from = mesh.vertex[mesh.row(v)[0]];
  return {from.y == at.y, from.x == at.x};
}

CORDILLERA_HD inline float mean_edge_cells(const FitMesh& mesh, std::uint32_t v) {
  const Vertex& at = mesh.vertex[v];
  float sum = 0;
  for (std::uint32_t i = 0; i < at.valence; ++i) {
    const Vertex& to = mesh.vertex[mesh.row(v)[i]];
    const float dx = static_cast<float>(to.x - at.x), dy = static_cast<float>(to.y - at.y);
    sum += square_root(dx * dx + dy * dy);
  }
  return sum * mesh.cells_per_unit / static_cast<float>(at.valence);
}

/// The plan part of the step, in cells, at most half a mean edge long.
CORDILLERA_HD inline Slope plan_step(const StepEquations& n, Freedom freedom, float most) {
  const float a = n.xx - n.xz * n.xz / n.zz, b = n.xy - n.xz * n.yz / n.zz, c = n.yy - n.yz * n.yz / n.zz;
  const float gx = n.rz * n.xz / n.zz - n.rx, gy = n.rz * n.yz / n.zz - n.ry;
  const float damping = 1e-2f * (a + c) + 1e-9f;
  Slope step{0, 0};
  if (freedom.x && freedom.y) {
    const float ad = a + damping, cd = c + damping, inverse = 1 / (ad * cd - b * b);
    step = {(cd * gx - b * gy) * inverse, (ad * gy - b * gx) * inverse};
  } else if (freedom.x) {
    step.x = gx / (a + damping);
  } else if (freedom.y) {
    step.y = gy / (c + damping);
  }
  const float length = square_root(step.x * step.x + step.y * step.y);
  if (!(length < 1e6f)) return {0, 0};
  if (length <= most) return step;
  return {step.x * most / length, step.y * most / length};
}

/// What a vertex may not do to its samples.
struct ErrorLimit {
  float most = 3e38f;
  CORDILLERA_HD bool set() const { return most < 1e38f; }
};

/// Where places are rounded a small share of the limit is for that: in which triangle a sample is, that lies on a side, is not
/// known.
template <class Samples>
CORDILLERA_HD bool is_within(const Samples& samples, const Vertex& a, const Vertex& b, const Vertex& c, ErrorLimit limit) {
  if constexpr (Samples::kOff > 0) {
    constexpr float kRoundingShare = 1.0f / 32;
    const float rounding = kRoundingShare * limit.most;
    return error_of_rounding<Samples>(a, b, c) <= rounding && worst_error(samples, a, b, c) <= limit.most - rounding;
  } else {
    return worst_error(samples, a, b, c) <= limit.most;
  }
}

/// Would every sample of the star stay within the limit, with v so?
template <class Samples>
CORDILLERA_HD bool star_within(const FitMesh& mesh, const Samples& samples, std::uint32_t v, Vertex moved, ErrorLimit limit) {
  return each_triangle(mesh, v, [&](const Vertex& a, const Vertex& b) { return is_within(samples, moved, a, b, limit); });
}

/// Would no edge of it be a spike's?
CORDILLERA_HD inline bool star_rises(const FitMesh& mesh, std::uint32_t v, const Vertex& moved) {
  return moved.steep == 0 ||
         each_triangle(mesh, v, [&](const Vertex& a, const Vertex& b) { return may_see(moved, a) && may_see(moved, b); });
}

/// A border vertex stays between its two neighbours on the border.
CORDILLERA_HD inline bool leaves_border(const FitMesh& mesh, std::uint32_t v, Point p) {
  const Vertex& at = mesh.vertex[v];
  if (!at.open()) return false;
  const Vertex &from = mesh.vertex[mesh.row(v)[0]], &to = mesh.vertex[mesh.row(v)[at.valence - 1]];
  const auto between = [](std::int32_t a, std::int32_t b, std::int32_t c) {
    return (a < b && b < c) || (c < b && b < a) || (a == b && b == c);
  };
  return (p.x != at.x || p.y != at.y) && !(between(from.x, p.x, to.x) && between(from.y, p.y, to.y));
}

/// Moves vertices; several at a time, if no two are neighbours.
template <class Samples>
struct Relocate {
  FitMesh mesh;
  Samples samples;
  int tries = 2;
  ErrorLimit limit;

  template <class Lanes>
  CORDILLERA_HD void operator()(const Lanes& lanes, std::uint32_t v) const {
    const Vertex at = mesh.vertex[v];
    if (at.fixed()) return;
    StepEquations equations;
    const HeightFit here = fit_star(lanes, mesh, samples, v, equations);
    Vertex moved = at;
    moved.z = at.z + here.best_height();
    const float least_error = here.at(here.best_height());
    if (least_error > kNothing && equations.zz > 0) try_steps(lanes, v, equations, least_error, moved);
    if (!star_rises(mesh, v, moved) || (limit.set() && !star_within(mesh, samples, v, moved, limit))) return;
    if (lanes.leads()) mesh.vertex[v] = moved;
  }

 private:
  static constexpr float kNothing = 1e-6f;  ///< squared error below which nothing is to be gained
  static constexpr float kGain = 0.9999f;

  template <class Lanes>
  CORDILLERA_HD void try_steps(const Lanes& lanes, std::uint32_t v, const StepEquations& equations, float least_error,
                               Vertex& moved) const {
    const Vertex at = mesh.vertex[v];
    const Freedom freedom = freedom_of(mesh, v);
    if (!freedom.x && !freedom.y) return;
    const Slope step = plan_step(equations, freedom, 0.5f * mean_edge_cells(mesh, v));
    float share = 1;
    for (int k = 0; k < tries; ++k, share *= 0.4f) {
      const Point p{at.x + nearest(share * step.x * mesh.units_per_cell), at.y + nearest(share * step.y * mesh.units_per_cell)};
      if (p.x == at.x && p.y == at.y) return;
      if (!star_stays_positive(mesh, v, p) || leaves_border(mesh, v, p)) continue;
      const HeightFit there = fit_star(lanes, mesh, samples, v, p);
      const float h = there.best_height();
      if (!(there.at(h) < least_error * kGain)) continue;
      moved.x = p.x;
      moved.y = p.y;
      moved.z = at.z + h;
      return;
    }
  }
};

}  // namespace cordillera::gpu::fit
