#pragma once
// A triangle held against the samples under it. Nothing here is an estimate: a triangle fits if every valid sample under it is
// within the tolerance, rounding included, and if it publishes no void and hides no valid sample farther from the rim than its
// level allows.
#include "gpu/exact/steps/field.h"

namespace cordillera::gpu::exact {

struct Corner {
  std::int32_t x, y;
  float height;
  bool is_void;
};

/// What a level asks of a triangle.
struct Demand {
  float tolerance;  ///< 2^-10 m
  int rim_reach;    ///< rims may move by 2^rim_reach samples; -1: not at all
  Curve curve;
  bool keeps_shown = false;  ///< a valid corner between two void ones is shown by other triangles, for it was before
};

/// Edge functions in integers, the surface in floats about the first corner.
struct Triangle {
  std::int32_t ex[3], ey[3];         ///< corners, counter-clockwise
  std::int32_t across[3], along[3];  ///< edge k: across * (x - ex) + along * (y - ey), not below 0 inside
  std::int32_t west, east, south, north;
  float height, dx, dy;  ///< at the first corner; slopes there
  float bend_x, bend_y;  ///< see Curve
  float tolerance;       ///< less what rounding may hide; not above 0: nothing fits
  int rim_reach;
  bool published;             ///< no corner is void
  std::uint8_t beside_shown;  ///< of a triangle with void corners and valid ones, bit by edge: on all of them lies what others
                              ///< show, the edge between two valid corners, or the one that there is; else 0

  CORDILLERA_HD std::int32_t edge(int k, int x, int y) const { return across[k] * (x - ex[k]) + along[k] * (y - ey[k]); }
  CORDILLERA_HD bool covers(int x, int y) const { return (edge(0, x, y) | edge(1, x, y) | edge(2, x, y)) >= 0; }
  /// Covers it a tiny step on? Then of triangles with a common edge one alone has the samples on it.
  CORDILLERA_HD bool owns(int x, int y, int step_x, int step_y) const {
    for (int k = 0; k < 3; ++k) {
      const int at = edge(k, x, y), toward_x = across[k] * step_x, toward_y = along[k] * step_y;
      if (at < 0 || (at == 0 && (toward_x < 0 || (toward_x == 0 && toward_y < 0)))) return false;
    }
    return true;
  }
  /// What it rises from its first corner, u samples to the east; v to the north.
  CORDILLERA_HD float rise_along(float u) const { return dx * u + bend_x * (u * u); }
  CORDILLERA_HD float rise_up(float v) const { return dy * v + bend_y * (v * v); }
  /// Its height over (x, y), less `less`. Heights are whole numbers, so their difference is exact, and only the rise is rounded.
  CORDILLERA_HD float height_above(float x, float y, float less) const {
    return (height - less) + (rise_along(x - static_cast<float>(ex[0])) + rise_up(y - static_cast<float>(ey[0])));
  }
  CORDILLERA_HD bool is_shown_by_others(int x, int y) const {
    for (int k = 0; k < 3; ++k) {
      if ((beside_shown >> k & 1) && edge(k, x, y) != 0) return false;
    }
    return beside_shown != 0;
  }
  CORDILLERA_HD std::int32_t twice_area() const { return edge(0, ex[2], ey[2]); }
};

/// Of a surface's height, what rounding in floats may hide: a few units of 2^-24 of how far it rises over the triangle and
/// the squares that touch it.
inline constexpr float kRoundingShare = 0x1p-20f;

CORDILLERA_HD inline Triangle make_triangle(const Corner& a, const Corner& b, const Corner& c, const Demand& demand) {
  Triangle t;
  t.ex[0] = a.x, t.ex[1] = b.x, t.ex[2] = c.x;
  t.ey[0] = a.y, t.ey[1] = b.y, t.ey[2] = c.y;
  for (int k = 0; k < 3; ++k) {
    const int next = k == 2 ? 0 : k + 1;
    t.across[k] = t.ey[k] - t.ey[next];
    t.along[k] = t.ex[next] - t.ex[k];
  }
  t.west = least(a.x, least(b.x, c.x)), t.east = greatest(a.x, greatest(b.x, c.x));
  t.south = least(a.y, least(b.y, c.y)), t.north = greatest(a.y, greatest(b.y, c.y));
  const std::int32_t ux = b.x - a.x, uy = b.y - a.y, vx = c.x - a.x, vy = c.y - a.y;
  const double inverse = 1.0 / static_cast<double>(ux * vy - uy * vx);
  const CurveRow curve = demand.curve.at((t.south + t.north) / 2);
  t.bend_x = curve.along;
  t.bend_y = demand.curve.up;
  const double bend_x = t.bend_x, bend_y = t.bend_y;
  const double rise_b = (static_cast<double>(b.height) - a.height) - (bend_x * (ux * ux) + bend_y * (uy * uy)),
               rise_c = (static_cast<double>(c.height) - a.height) - (bend_x * (vx * vx) + bend_y * (vy * vy));
  t.height = a.height;
  t.dx = static_cast<float>((rise_b * vy - rise_c * uy) * inverse);
  t.dy = static_cast<float>((rise_c * ux - rise_b * vx) * inverse);
  const float wide = static_cast<float>(t.east - t.west + 8), high = static_cast<float>(t.north - t.south + 8);
  const float rise = (magnitude(t.dx) * wide + magnitude(t.dy) * high) + (t.bend_x * (wide * wide) + t.bend_y * (high * high));
  const float columns = static_cast<float>(t.east - t.west), rows = static_cast<float>(t.north - t.south);
  const float sway = magnitude(t.dy) * curve.north(columns) + magnitude(t.dx) * curve.east(columns, rows);
  t.tolerance = demand.tolerance - (rise * kRoundingShare + sway);
  t.rim_reach = demand.rim_reach;
  t.published = !(a.is_void || b.is_void || c.is_void);
  // The edges that meet at every valid corner: 0 goes from a to b, 1 from b to c, 2 from c to a.
  const int common = (a.is_void ? 7 : 5) & (b.is_void ? 7 : 3) & (c.is_void ? 7 : 6), voids = a.is_void + b.is_void + c.is_void;
  t.beside_shown = voids == 1 || (voids == 2 && demand.keeps_shown) ? static_cast<std::uint8_t>(common) : std::uint8_t{0};
  return t;
}

CORDILLERA_HD inline bool sample_fits(const Triangle& t, float height, Depth depth, int x, int y) {
  // The triangle across such an edge may be void, too: then nothing shows what lies there, and it must be next to a void.
  if (!t.published)
    return !has_deep_valid(depth, t.rim_reach) || (t.rim_reach < 0 && t.is_shown_by_others(x, y) && !has_deep_valid(depth, 0));
  if (is_void(depth)) return !has_deep_void(depth, t.rim_reach);
  return magnitude(t.height_above(static_cast<float>(x), static_cast<float>(y), height)) <= t.tolerance;
}
CORDILLERA_HD inline bool sample_fits(const Triangle& t, const Field& field, int x, int y) {
  if (!t.covers(x, y)) return true;
  const std::uint32_t at = field.index(x, y);
  return sample_fits(t, field.height[at], field.depth ? field.depth[at] : Depth{0}, x, y);
}

/// Is the part of the triangle in a square certain to fit, or the square certain to lie outside? False: its parts must be looked
/// at.
CORDILLERA_HD inline bool square_fits(const Triangle& t, const Field& field, int tier, int sx, int sy) {
  const int shift = tier_shift(tier), last = (1 << shift) - 1, x = sx << shift, y = sy << shift;
  for (int k = 0; k < 3; ++k) {
    if (t.edge(k, x, y) + last * (greatest(t.across[k], 0) + greatest(t.along[k], 0)) < 0) return true;
  }
  const std::uint32_t at = static_cast<std::uint32_t>(sy * field.tier_stride[tier] + sx);
  if (field.has_voids()) {
    const Depth depth = field.tier_depth[tier][at];
    if (!t.published) return !has_deep_valid(depth, t.rim_reach);
    if (has_deep_void(depth, t.rim_reach)) return false;
  }
  const BoundingPlane plane = field.plane[tier][at];
  const float half = 0.5f * static_cast<float>(last);
  const float middle_x = static_cast<float>(x) + half, middle_y = static_cast<float>(y) + half;
  const float apart = magnitude(t.height_above(middle_x, middle_y, plane.middle));
  const float slope_x = t.dx + 2 * t.bend_x * (middle_x - static_cast<float>(t.ex[0])),
              slope_y = t.dy + 2 * t.bend_y * (middle_y - static_cast<float>(t.ey[0]));
  const float within =
      half * (magnitude(slope_x - plane.dx) + magnitude(slope_y - plane.dy)) + (t.bend_x + t.bend_y) * (half * half);
  return apart + within + plane.off <= t.tolerance;
}

/// Steps between samples a way, from corner to corner: edge functions of wider triangles would not fit into 32 bits. A ground
/// above blocks may be wider.
inline constexpr std::int32_t kWidestTriangle = 16384;

/// Nothing to look at: a triangle is too wide, or no plane is steep enough to spend the tolerance on rounding, but one may be;
/// without voids a void triangle hides nothing.
CORDILLERA_HD inline bool can_fit(const Triangle& t) {
  return t.east - t.west <= kWidestTriangle && t.north - t.south <= kWidestTriangle && (!t.published || t.tolerance > 0);
}
/// So few samples that squares would not save looking at them.
CORDILLERA_HD inline bool is_small(const Triangle& t) { return (t.east - t.west + 1) * (t.north - t.south + 1) <= 64; }
/// Where few squares cover it: at most 5 a way.
CORDILLERA_HD inline int first_tier(const Triangle& t) {
  const int wide = greatest(t.east - t.west, t.north - t.south);
  int tier = 0;
  while (tier + 1 < kTiers && wide >> tier_shift(tier) >= 4) ++tier;
  return tier;
}
inline constexpr int kMostFirstSquares = 25;

/// Squares of a tier, ends included.
struct SquareRange {
  int west, east, south, north;
};
CORDILLERA_HD inline SquareRange squares_under(const Triangle& t, int tier) {
  const int shift = tier_shift(tier);
  return {t.west >> shift, t.east >> shift, t.south >> shift, t.north >> shift};
}
/// The parts of a square of `tier` that the triangle's box touches, a tier below.
CORDILLERA_HD inline SquareRange parts_under(const Triangle& t, int tier, int sx, int sy) {
  const SquareRange all = squares_under(t, tier - 1);
  return {greatest(4 * sx, all.west), least(4 * sx + 3, all.east), greatest(4 * sy, all.south), least(4 * sy + 3, all.north)};
}

}  // namespace cordillera::gpu::exact
