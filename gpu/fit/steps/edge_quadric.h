#pragma once
// The quadric of an edge, measured along the vertical: what a vertex in place of both ends would be off the planes around them.
// The planes of a vertex are kept as a weight, a mean plane and the scatter about it: nothing large is ever subtracted from
// something large.
#include "gpu/fit/steps/relocate.h"

namespace cordillera::gpu::fit {

/// Weighted planes over a vertex, relative to it: their mean height and slope, and the scatter of height (h) and slope (x, y)
/// about it. Memoryless, they are those of its triangles, which meet in it: no height, no scatter of heights.
struct Planes {
  float weight = 0, h = 0, x = 0, y = 0;
  float hh = 0, hx = 0, hy = 0, xx = 0, xy = 0, yy = 0;

  /// A plane through the vertex.
  CORDILLERA_HD void add(float area, Slope slope) {
    weight += area;
    const float share = area / weight, dx = slope.x - x, dy = slope.y - y;
    const float spread = area * (1 - share);
    x += dx * share;
    y += dy * share;
    xx += spread * dx * dx;
    xy += spread * dx * dy;
    yy += spread * dy * dy;
  }
  CORDILLERA_HD float height(float dx, float dy) const { return h + x * dx + y * dy; }
  CORDILLERA_HD float scatter(float dx, float dy) const {
    return hh + dx * (2 * hx + xx * dx + 2 * xy * dy) + dy * (2 * hy + yy * dy);
  }
  /// The same planes, relative to another point.
  CORDILLERA_HD Planes seen_from(float dx, float dy, float dz) const {
    Planes seen = *this;
    seen.h = height(dx, dy) - dz;
    seen.hh = scatter(dx, dy);
    seen.hx = hx + xx * dx + xy * dy;
    seen.hy = hy + xy * dx + yy * dy;
    return seen;
  }
};

/// Relative to the same point.
CORDILLERA_HD inline Planes together(const Planes& a, const Planes& b) {
  const float weight = a.weight + b.weight, share = b.weight / weight, spread = a.weight * share;
  const float dh = b.h - a.h, dx = b.x - a.x, dy = b.y - a.y;
  return {weight,
          a.h + share * dh,
          a.x + share * dx,
          a.y + share * dy,
          a.hh + b.hh + spread * dh * dh,
          a.hx + b.hx + spread * dh * dx,
          a.hy + b.hy + spread * dh * dy,
          a.xx + b.xx + spread * dx * dx,
          a.xy + b.xy + spread * dx * dy,
          a.yy + b.yy + spread * dy * dy};
}

CORDILLERA_HD inline Planes planes_of(const FitMesh& mesh, std::uint32_t v) {
  const Vertex at = mesh.vertex[v];
  Planes planes;
  each_triangle(mesh, v, [&](const Vertex& a, const Vertex& b) {
    float twice_area;
    const Slope slope = slope_of(mesh, at.at(), at.z, a, b, twice_area);
    planes.add(0.5f * twice_area, slope);
    return true;
  });
  return planes;
}

/// Where the vertex that is left may lie.
enum class Leeway : std::uint8_t { nowhere, anywhere, along_x, along_y, at_u, at_v };

/// The cost of what cannot be done.
inline constexpr float kNever = 3e38f;

/// A place for the vertex that is left, and what it costs.
struct Candidate {
  Point at;
  float z = 0;
  float cost = kNever;
};

/// The quadric of the edge from u to v; plan in cells relative to u, heights relative to u.
class EdgeQuadric {
 public:
  CORDILLERA_HD EdgeQuadric(const FitMesh& mesh, const Planes* planes, std::uint32_t u, std::uint32_t v)
      : mesh_(mesh), u_(mesh.vertex[u]), v_(mesh.vertex[v]), at_u_(planes[u]), at_v_(planes[v]) {
    dx_ = static_cast<float>(v_.x - u_.x) * mesh.cells_per_unit;
    dy_ = static_cast<float>(v_.y - u_.y) * mesh.cells_per_unit;
    dz_ = v_.z - u_.z;
    square_ = dx_ * dx_ + dy_ * dy_;
    harmonic_ = at_u_.weight * at_v_.weight / (at_u_.weight + at_v_.weight);
  }

  /// A place in the plan, not yet rounded, and its cost with the height that costs least.
  struct Optimum {
    float x, y, cost;
  };
  /// Where the place rule lets the vertex lie, at the least cost; kept near the edge's middle where the planes do not say.
  CORDILLERA_HD Optimum best(Leeway place) const {
    if (place == Leeway::at_u) return priced(0, 0);
    if (place == Leeway::at_v) return priced(dx_, dy_);
    const float slope_x = at_u_.x - at_v_.x, slope_y = at_u_.y - at_v_.y, gap = at_u_.h - at_v_.height(-dx_, -dy_) - dz_;
    float xx = harmonic_ * slope_x * slope_x + at_u_.xx + at_v_.xx, yy = harmonic_ * slope_y * slope_y + at_u_.yy + at_v_.yy;
    const float xy = harmonic_ * slope_x * slope_y + at_u_.xy + at_v_.xy, damping = kDamping * (xx + yy) + 1e-12f;
    const float rx = at_v_.xx * dx_ + at_v_.xy * dy_ - harmonic_ * gap * slope_x - at_u_.hx - at_v_.hx + 0.5f * damping * dx_;
    const float ry = at_v_.xy * dx_ + at_v_.yy * dy_ - harmonic_ * gap * slope_y - at_u_.hy - at_v_.hy + 0.5f * damping * dy_;
    xx += damping;
    yy += damping;
    if (place == Leeway::along_x) return priced(between(rx / xx, dx_), 0);
    if (place == Leeway::along_y) return priced(0, between(ry / yy, dy_));
    const float inverse = 1 / (xx * yy - xy * xy);
    const float x = (yy * rx - xy * ry) * inverse, y = (xx * ry - xy * rx) * inverse;
    const float off_x = x - 0.5f * dx_, off_y = y - 0.5f * dy_;
    if (off_x * off_x + off_y * off_y < 12 * square_ + 8) return priced(x, y);
    return priced(0.5f * dx_, 0.5f * dy_);
  }

  CORDILLERA_HD Candidate rounded(const Optimum& optimum) const {
    // Far from u a float no longer has every unit, and v may be a border's, which must not move.
    if (optimum.x == dx_ && optimum.y == dy_) return at(v_.at());
    return at({u_.x + nearest(optimum.x * mesh_.units_per_cell), u_.y + nearest(optimum.y * mesh_.units_per_cell)});
  }
  /// At p, with the height that costs least.
  CORDILLERA_HD Candidate at(Point p) const {
    const float x = static_cast<float>(p.x - u_.x) * mesh_.cells_per_unit,
                y = static_cast<float>(p.y - u_.y) * mesh_.cells_per_unit;
    const float by_u = at_u_.height(x, y), by_v = dz_ + at_v_.height(x - dx_, y - dy_);
    const float mean = (at_u_.weight * by_u + at_v_.weight * by_v) / (at_u_.weight + at_v_.weight);
    return {p, u_.z + mean, priced(x, y).cost};
  }
  CORDILLERA_HD Point middle() const { return {u_.x + (v_.x - u_.x) / 2, u_.y + (v_.y - u_.y) / 2}; }

 private:
  static constexpr float kShape = 1e-7f;  // where costs are equal, short edges go first
  static constexpr float kDamping = 1e-3f;

  CORDILLERA_HD Optimum priced(float x, float y) const {
    const float gap = at_u_.height(x, y) - dz_ - at_v_.height(x - dx_, y - dy_);
    const float cost = harmonic_ * gap * gap + at_u_.scatter(x, y) + at_v_.scatter(x - dx_, y - dy_);
    return {x, y, (cost > 0 ? cost : 0) + kShape * square_ * (1 + square_)};
  }
  CORDILLERA_HD static float between(float value, float end) {
    const float low = end < 0 ? end : 0, high = end < 0 ? 0 : end;
    return value < low ? low : value > high ? high : value;
  }

  const FitMesh& mesh_;
  const Vertex &u_, &v_;
  const Planes &at_u_, &at_v_;
  float dx_, dy_, dz_, square_, harmonic_;
};

}  // namespace cordillera::gpu::fit
