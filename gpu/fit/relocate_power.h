#pragma once
// The step of relocate.h for a high power of the error: sums of it are all but the maximum, and still smooth. There is no spike
// guard here: the input's surface between samples would count as much as the samples do.
#include "gpu/fit/relocate.h"

namespace cordillera::gpu::fit {

/// The power-th powers of a star's errors, and the equations of a step of least squares weighted with the power less two.
struct PowerFit {
  float sum = 0;
  StepEquations step;
};

template <class Samples>
struct RelocateByPower {
  MeshView mesh;
  Samples samples;
  float inverse_scale = 1;  ///< of errors: about one over the greatest, lest powers overflow or vanish
  int power = 8;            ///< even
  ErrorLimit limit;

  CORDILLERA_HD void operator()(std::uint32_t v) const {
    Vertex& at = mesh.vertex[v];
    if (at.fixed()) return;
    PowerFit here;
    add_star(v, at.at(), at.z, here);
    const StepEquations& n = here.step;
    if (here.sum < kNothing || !(n.zz > kNothing)) return;
    const Slope plan = plan_step(n, freedom_of(mesh, v), 0.5f * mean_edge_cells(mesh, v));
    const float rise = -(n.rz + n.xz * plan.x + n.yz * plan.y) / n.zz;
    float share = 2 / static_cast<float>(power - 1);  // a full step of these weights goes too far by about the power
    for (int k = 0; k < kTries; ++k, share *= 0.4f) {
      const Point p{at.x + nearest(share * plan.x * mesh.units_per_cell), at.y + nearest(share * plan.y * mesh.units_per_cell)};
      if (!star_stays_positive(mesh, v, p) || leaves_border(mesh, v, p)) continue;
      PowerFit there;
      add_star(v, p, at.z + share * rise, there);
      if (!(there.sum < here.sum * kGain)) continue;
      Vertex moved = at;
      moved.x = p.x;
      moved.y = p.y;
      moved.z = at.z + share * rise;
      if (!limit.set() || star_within(mesh, samples, v, moved, limit)) at = moved;
      return;
    }
  }

 private:
  static constexpr int kTries = 4;
  static constexpr float kNothing = 1e-30f, kGain = 0.9999f;

  CORDILLERA_HD void add_star(std::uint32_t v, Point p, float z, PowerFit& fit) const {
    each_triangle(mesh, v, [&](const Vertex& a, const Vertex& b) {
      add_triangle(p, z, a, b, fit);
      return true;
    });
  }

  CORDILLERA_HD void add_triangle(Point p, float z, const Vertex& a, const Vertex& b, PowerFit& fit) const {
    const float inverse = 1 / static_cast<float>(turn(p, a.at(), b.at()));
    const float at_a = (a.z - z) * inverse, at_b = (b.z - z) * inverse;
    float sum = 0, hat_hat = 0, hat_error = 0;
    samples.in_triangle(p, a.at(), b.at(), [&](std::uint32_t sample, auto e0, auto e1, auto e2) {
      const float hat = static_cast<float>(e0) * inverse;
      const float error = static_cast<float>(e1) * at_a + static_cast<float>(e2) * at_b - (samples.z[sample] - z);
      const float scaled = error * inverse_scale, weight = weight_of(scaled);
      sum += weight * scaled * scaled;
      hat_hat += weight * hat * hat;
      hat_error += weight * hat * error;
    });
    float twice_area;
    const Slope slope = slope_of(mesh, p, z, a, b, twice_area);
    fit.sum += sum;
    fit.step.add(hat_hat, hat_error, slope.x, slope.y);
  }

  /// scaled^(power - 2)
  CORDILLERA_HD float weight_of(float scaled) const {
    const float square = scaled * scaled;
    float weight = square;
    for (int k = 4; k < power; k += 2) weight *= square;
    return weight;
  }
};

}  // namespace cordillera::gpu::fit
