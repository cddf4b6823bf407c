#pragma once
// How well the triangles around a vertex fit the samples below and above them, and where the vertex would fit better. All heights
// are taken relative to a nearby one, so that floats suffice.
#include "gpu/fit/steps/lanes.h"

namespace cordillera::gpu::fit {

/// Weight of one more sample at every free vertex: the input's surface there. It keeps vertices from spiking between samples.
/// Where that surface is known to some metres, as under scattered samples that lie close to each other, it leaves them that much
/// freedom: else it would draw them away from the samples.
inline constexpr float kSpikeGuard = 0.05f;
/// Keeps a vertex that no sample sees at its height.
inline constexpr float kHeightRidge = 1e-3f;

/// The squared error as a function of the vertex' height h (relative): ll h^2 + 2 lr h + rr.
struct HeightFit {
  float ll = 0, lr = 0, rr = 0;

  CORDILLERA_HD void add(const HeightFit& other) {
    ll += other.ll;
    lr += other.lr;
    rr += other.rr;
  }
  CORDILLERA_HD float best_height() const { return -lr / (ll + kHeightRidge); }
  CORDILLERA_HD float at(float h) const { return rr + h * (2 * lr + h * ll); }
};

/// Normal equations of a Gauss-Newton step of a vertex in x, y (cells) and z; r: right-hand side.
struct StepEquations {
  float xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0, rx = 0, ry = 0, rz = 0;

  /// A triangle whose height changes by hat * (dz - slope_x dx - slope_y dy).
  CORDILLERA_HD void add(float hat_hat, float hat_error, float slope_x, float slope_y) {
    xx += hat_hat * slope_x * slope_x;
    xy += hat_hat * slope_x * slope_y;
    xz -= hat_hat * slope_x;
    yy += hat_hat * slope_y * slope_y;
    yz -= hat_hat * slope_y;
    zz += hat_hat;
    rx -= hat_error * slope_x;
    ry -= hat_error * slope_y;
    rz += hat_error;
  }
};

/// The samples of triangle (p, b, c): the fit as a function of the height of p above base.
struct FitTriangle {
  const float* z;  ///< of samples
  Point a, b, c;
  float inverse, at_b, at_c, base;

  CORDILLERA_HD FitTriangle(const float* samples, Point p, const Vertex& to, const Vertex& next, float base_)
      : z(samples), a(p), b(to.at()), c(next.at()), inverse(1 / static_cast<float>(turn(a, b, c))), base(base_) {
    at_b = (to.z - base) * inverse;
    at_c = (next.z - base) * inverse;
  }
  template <class Int>
  CORDILLERA_HD void add(HeightFit& fit, std::uint32_t sample, Int e0, Int e1, Int e2) const {
    const float hat = static_cast<float>(e0) * inverse;
    const float rest = static_cast<float>(e1) * at_b + static_cast<float>(e2) * at_c - (z[sample] - base);
    fit.ll += hat * hat;
    fit.lr += hat * rest;
    fit.rr += rest * rest;
  }
};

template <class Samples>
CORDILLERA_HD void add_spike_guard(const Samples& samples, Point p, float base, HeightFit& fit) {
  const float surface = samples.surface(p);
  if (surface == kNoSample) return;
  const float above = base - surface, off = samples.surface_off(p);
  if (off > 0 && above <= off && above >= -off) return;
  const float rest = above > 0 ? above - off : above + off;
  fit.ll += kSpikeGuard;
  fit.lr += kSpikeGuard * rest;
  fit.rr += kSpikeGuard * rest * rest;
}

/// The plane of (p, a, b), p at height base: dz/dx and dz/dy, per cell.
struct Slope {
  float x, y;
};
CORDILLERA_HD inline Slope slope_of(const FitMesh& mesh, Point p, float base, const Vertex& a, const Vertex& b,
                                    float& twice_area) {
  const float ax = static_cast<float>(a.x - p.x) * mesh.cells_per_unit, ay = static_cast<float>(a.y - p.y) * mesh.cells_per_unit;
  const float bx = static_cast<float>(b.x - p.x) * mesh.cells_per_unit, by = static_cast<float>(b.y - p.y) * mesh.cells_per_unit;
  const float az = a.z - base, bz = b.z - base;
  twice_area = ax * by - ay * bx;
  const float inverse = 1 / twice_area;
  return {(az * by - bz * ay) * inverse, (bz * ax - az * bx) * inverse};
}

/// Do all triangles of v stay positive with v at p?
CORDILLERA_HD inline bool star_stays_positive(const FitMesh& mesh, std::uint32_t v, Point p) {
  return each_triangle(mesh, v, [p](const Vertex& a, const Vertex& b) { return turn(p, a.at(), b.at()) > 0; });
}

/// The star of v with v at p, which must keep it positive; heights relative to that of v.
template <class Lanes, class Samples>
CORDILLERA_HD HeightFit fit_star(const Lanes& lanes, const FitMesh& mesh, const Samples& samples, std::uint32_t v, Point p) {
  const Vertex at = mesh.vertex[v];
  const std::uint32_t* const row = mesh.row(v);
  HeightFit fit;
  lanes.template sum<HeightFit>(
      samples, at.triangles(),
      [&](std::uint32_t i) { return FitTriangle(samples.z, p, mesh.vertex[row[i]], mesh.vertex[row[mesh.next(at, i)]], at.z); },
      [&](std::uint32_t, const HeightFit& one) { fit.add(one); });
  add_spike_guard(samples, p, at.z, fit);
  return fit;
}

/// The same where v is, with the equations of a step.
template <class Lanes, class Samples>
CORDILLERA_HD HeightFit fit_star(const Lanes& lanes, const FitMesh& mesh, const Samples& samples, std::uint32_t v,
                                 StepEquations& step) {
  const Vertex at = mesh.vertex[v];
  const std::uint32_t* const row = mesh.row(v);
  HeightFit fit;
  add_spike_guard(samples, at.at(), at.z, fit);
  step.zz = fit.ll;
  step.rz = fit.lr;
  const auto corner = [&](std::uint32_t i) -> const Vertex& { return mesh.vertex[row[i]]; };
  lanes.template sum<HeightFit>(
      samples, at.triangles(),
      [&](std::uint32_t i) { return FitTriangle(samples.z, at.at(), corner(i), corner(mesh.next(at, i)), at.z); },
      [&](std::uint32_t i, const HeightFit& one) {
        if (one.ll > 0) {
          float twice_area;
          const Slope slope = slope_of(mesh, at.at(), at.z, corner(i), corner(mesh.next(at, i)), twice_area);
          step.add(one.ll, one.lr, slope.x, slope.y);
        }
        fit.add(one);
      });
  return fit;
}

/// What the rounding of places may add to the error of a sample in a triangle, or on its sides: much where it is a needle.
template <class Samples>
CORDILLERA_HD float error_of_rounding(const Vertex& a, const Vertex& b, const Vertex& c) {
  const auto size = [](float value) { return value < 0 ? -value : value; };
  const float inverse = 1 / static_cast<float>(turn(a.at(), b.at(), c.at()));
  const float at_b = (b.z - a.z) * inverse, at_c = (c.z - a.z) * inverse;
  const float along_x = at_b * static_cast<float>(c.y - a.y) - at_c * static_cast<float>(b.y - a.y),
              along_y = at_c * static_cast<float>(b.x - a.x) - at_b * static_cast<float>(c.x - a.x);
  return Samples::kOff * (size(along_x) + size(along_y));
}

/// The greatest error of a triangle's samples.
template <class Samples>
CORDILLERA_HD float worst_error(const Samples& samples, const Vertex& a, const Vertex& b, const Vertex& c) {
  const float inverse = 1 / static_cast<float>(turn(a.at(), b.at(), c.at()));
  const float at_b = (b.z - a.z) * inverse, at_c = (c.z - a.z) * inverse;
  float worst = 0;
  samples.in_triangle(a.at(), b.at(), c.at(), [&](std::uint32_t sample, auto, auto e1, auto e2) {
    const float error = static_cast<float>(e1) * at_b + static_cast<float>(e2) * at_c - (samples.z[sample] - a.z);
    const float size = error < 0 ? -error : error;
    worst = size > worst ? size : worst;
  });
  return worst;
}

}  // namespace cordillera::gpu::fit
