#pragma once
// The step of relocate.h for a high power of the error: sums of it are all but the maximum, and still smooth. There is no spike
// guard here: the input's surface between samples would count as much as the samples do.
#include "gpu/fit/steps/relocate.h"

namespace cordillera::gpu::fit {

/// The power-th powers of a star's errors, and the equations of a step of least squares weighted with the power less two.
struct PowerFit {
  float sum = 0;
  StepEquations step;
};

/// Of a triangle (p, b, c), p at height z: the powers, and what the equations are made of.
struct PowerSum {
  float sum = 0, hat_hat = 0, hat_error = 0;
  CORDILLERA_HD void add(const PowerSum& other) {
    sum += other.sum;
    hat_hat += other.hat_hat;
    hat_error += other.hat_error;
  }
};
struct PowerTriangle : FitTriangle {
  float inverse_scale;
  int power;

  template <class Int>
  CORDILLERA_HD void add(PowerSum& to, std::uint32_t sample, Int e0, Int e1, Int e2) const {
    const float hat = static_cast<float>(e0) * inverse;
    const float error = static_cast<float>(e1) * at_b + static_cast<float>(e2) * at_c - (z[sample] - base);
    const float scaled = error * inverse_scale, weight = weight_of(scaled);
    to.sum += weight * scaled * scaled;
    to.hat_hat += weight * hat * hat;
    to.hat_error += weight * hat * error;
  }

 private:
  /// scaled^(power - 2)
  CORDILLERA_HD float weight_of(float scaled) const {
    const float square = scaled * scaled;
    float weight = square;
    for (int k = 4; k < power; k += 2) weight *= square;
    return weight;
  }
};

template <class Samples>
struct RelocateByPower {
  FitMesh mesh;
  Samples samples;
  float inverse_scale = 1;  ///< of errors: about one over the greatest, lest powers overflow or vanish
  int power = 8;            ///< even
  ErrorLimit limit;

  template <class Lanes>
  CORDILLERA_HD void operator()(const Lanes& lanes, std::uint32_t v) const {
    const Vertex at = mesh.vertex[v];
    if (at.fixed()) return;
    const PowerFit here = fit(lanes, v, at.at(), at.z);
    const StepEquations& n = here.step;
    if (here.sum < kNothing || !(n.zz > kNothing)) return;
    const Slope plan = plan_step(n, freedom_of(mesh, v), 0.5f * mean_edge_cells(mesh, v));
    const float rise = -(n.rz + n.xz * plan.x + n.yz * plan.y) / n.zz;
    float share = 2 / static_cast<float>(power - 1);  // a full step of these weights goes too far by about the power
    for (int k = 0; k < kTries; ++k, share *= 0.4f) {
      const Point p{at.x + nearest(share * plan.x * mesh.units_per_cell), at.y + nearest(share * plan.y * mesh.units_per_cell)};
      if (!star_stays_positive(mesh, v, p) || leaves_border(mesh, v, p)) continue;
      const PowerFit there = fit(lanes, v, p, at.z + share * rise);
      if (!(there.sum < here.sum * kGain)) continue;
      Vertex moved = at;
      moved.x = p.x;
      moved.y = p.y;
      moved.z = at.z + share * rise;
      if (!star_rises(mesh, v, moved) || (limit.set() && !star_within(mesh, samples, v, moved, limit))) return;
      if (lanes.leads()) mesh.vertex[v] = moved;
      return;
    }
  }

 private:
  static constexpr int kTries = 4;
  static constexpr float kNothing = 1e-30f, kGain = 0.9999f;

  /// The star of v with v at p and height z.
  template <class Lanes>
  CORDILLERA_HD PowerFit fit(const Lanes& lanes, std::uint32_t v, Point p, float z) const {
    const Vertex at = mesh.vertex[v];
    const std::uint32_t* const row = mesh.row(v);
    const auto corner = [&](std::uint32_t i) -> const Vertex& { return mesh.vertex[row[i]]; };
    PowerFit whole;
    lanes.template sum<PowerSum>(
        samples, at.triangles(),
        [&](std::uint32_t i) {
          return PowerTriangle{FitTriangle(samples.z, p, corner(i), corner(mesh.next(at, i)), z), inverse_scale, power};
        },
        [&](std::uint32_t i, const PowerSum& one) {
          float twice_area;
          const Slope slope = slope_of(mesh, p, z, corner(i), corner(mesh.next(at, i)), twice_area);
          whole.sum += one.sum;
          whole.step.add(one.hat_hat, one.hat_error, slope.x, slope.y);
        });
    return whole;
  }
};

}  // namespace cordillera::gpu::fit
