#pragma once
// What a block starts from: a right-triangulated network of its samples, in which every triangle has been measured. From the
// smallest right triangles up, the vertex in the middle of an edge is left out if both triangles of the edge fit and no smaller
// one needs it.
//
// W. Evans, D. Kirkpatrick, G. Townsend, "Right-triangulated irregular networks", 2001.
#include "gpu/exact/steps/triangle.h"

namespace cordillera::gpu::exact {

/// A share of the tolerance: what is left lets the waves go far. Measured: less costs time and brings nothing, more costs
/// triangles.
inline constexpr float kStartShare = 0.75f;
inline constexpr int kLargestSquare = 32;

/// Samples of a row from (from, y) on, all of them valid and under the triangle, which is published.
CORDILLERA_HD inline bool run_fits(const Triangle& t, const float* sample, int count, int from, int y) {
  const float rise = t.rise_up(static_cast<float>(y - t.ey[0]));
  const int u = from - t.ex[0];
  int bad = 0;
  for (int i = 0; i < count; ++i)
    bad |= !(magnitude((t.height - sample[i]) + (t.rise_along(static_cast<float>(u + i)) + rise)) <= t.tolerance);
  return bad == 0;
}

/// Of the squares that a small triangle's box touches: has the triangle voids, and how deep?
CORDILLERA_HD inline Depth deepest_under(const Triangle& t, const Field& field) {
  const int tier = greatest(t.east - t.west, t.north - t.south) > 8 ? 1 : 0;
  const SquareRange range = squares_under(t, tier);
  Depth deepest = 0;
  for (int y = range.south; y <= range.north; ++y) {
    for (int x = range.west; x <= range.east; ++x)
      deepest = deeper(deepest, field.tier_depth[tier][y * field.tier_stride[tier] + x]);
  }
  return deepest;
}

/// The whole of a triangle with edges along rows, columns and diagonals.
CORDILLERA_HD inline bool right_triangle_fits(const Triangle& t, const Field& field) {
  if (!can_fit(t)) return false;
  const Depth deepest = field.depth ? deepest_under(t, field) : valid_depth(kFarthest);
  if (!t.published && !has_deep_valid(deepest, t.rim_reach)) return true;
  const bool no_voids = t.published && !has_deep_void(deepest, -1);
  for (int y = t.south; y <= t.north; ++y) {
    int from = t.west, to = t.east;
    for (int k = 0; k < 3; ++k) {
      if (t.across[k] == 0) continue;
      const int at = t.along[k] == 0                         ? t.ex[k]
                     : (t.across[k] > 0) == (t.along[k] > 0) ? t.ex[k] - (y - t.ey[k])
                                                             : t.ex[k] + (y - t.ey[k]);
      if (t.across[k] > 0)
        from = greatest(from, at);
      else
        to = least(to, at);
    }
    const std::uint32_t at = field.index(from, y);
    if (no_voids) {
      if (!run_fits(t, field.height + at, to - from + 1, from, y)) return false;
      continue;
    }
    for (int x = from; x <= to; ++x) {
      const std::uint32_t sample = at + static_cast<std::uint32_t>(x - from);
      if (!sample_fits(t, field.height[sample], field.depth[sample], x, y)) return false;
    }
  }
  return true;
}

/// What is certain of a triangle before it is made.
enum class Verdict : std::uint8_t { unknown, fits, fails };

struct GridPlace {
  int x, y;
};

/// Squares of so many cells a way, and of 8, 16 and 32, are asked whether their ground is calm.
inline constexpr int kCalmShift = 2, kCalmCells = 1 << kCalmShift;
CORDILLERA_HD constexpr int calm_squares(int samples, int shift = kCalmShift) {
  return (samples - 1 + (1 << shift) - 1) >> shift;
}

/// A block's network: which samples stay, indexed like Field::height.
struct Network {
  Field field;
  const std::uint8_t* calm = nullptr;  ///< indexed by square, calm_squares(columns, calm_shift) a row; 1: see CalmSquares
  std::uint8_t* stays = nullptr;
  int largest = 1;                                        ///< side of the largest square
  Demand demand{0, 0, {}};                                ///< with the start's share of the tolerance
  float height_step = 1, per_height_step = 1;             ///< a power of two, and one by it
  std::int32_t west = 0, east = 0, south = 0, north = 0;  ///< what of the block becomes a mesh
  std::uint32_t hems = 0;                                 ///< sides of that, bit by Side, that end at a hem: two rows of it stay
  int calm_shift = kCalmShift;  ///< squares of 1 << calm_shift cells, no smaller than those that are asked about

  CORDILLERA_HD bool is_inside(int x, int y) const { return x >= 0 && y >= 0 && x < field.columns && y < field.rows; }
  CORDILLERA_HD bool is_own(int x, int y) const { return x >= west && y >= south && x <= east && y <= north; }
  /// Is this sample, a pad maybe, a vertex of the mesh?
  CORDILLERA_HD bool takes(int x, int y) const { return stays[field.index(x, y)] != 0 && is_own(x, y); }
  CORDILLERA_HD bool is_at_hem(int x, int y) const {
    return ((hems & 1) && (y == south || y == south + 1)) || ((hems & 2) && (x == east || x == east - 1)) ||
           ((hems & 4) && (y == north || y == north - 1)) || ((hems & 8) && (x == west || x == west + 1));
  }
  CORDILLERA_HD bool has(int x, int y) const { return is_inside(x, y) && stays[field.index(x, y)] != 0; }
  CORDILLERA_HD Corner corner(int x, int y) const {
    return {x, y, nearest_whole(field.height[field.index(x, y)] * per_height_step) * height_step, field.is_void_at(x, y)};
  }
  /// No voids in the squares of 8 that touch (x, y) and the samples around it?
  CORDILLERA_HD bool is_clear(int x, int y) const {
    if (!field.depth) return true;
    const int first_x = greatest(x - 1, 0) >> 3, last_x = least(x + 1, field.columns - 1) >> 3, first_y = greatest(y - 1, 0) >> 3,
              last_y = least(y + 1, field.rows - 1) >> 3;
    const auto depth = [this](int sx, int sy) { return field.tier_depth[0][sy * field.tier_stride[0] + sx]; };
    return !has_deep_void(
        deeper(deeper(depth(first_x, first_y), depth(last_x, first_y)), deeper(depth(first_x, last_y), depth(last_x, last_y))),
        -1);
  }
  /// Is it known of a square from there on that its triangles fit?
  CORDILLERA_HD bool is_calm(const GridPlace& square) const {
    return calm[(square.y >> calm_shift) * calm_squares(field.columns, calm_shift) + (square.x >> calm_shift)] != 0;
  }
  /// The triangle of samples a, b and c, which lies in the square of 2 * half cells from `square` on; c may lie outside of the
  /// block, and then there is none. middles: of a smallest one, the samples that are not its corners are the middles of its first
  /// `middles` edges.
  CORDILLERA_HD bool triangle_fits(const GridPlace& a, const GridPlace& b, const GridPlace& c, const GridPlace& square, int half,
                                   int middles) const {
    if (!is_inside(c.x, c.y) || is_calm(square)) return true;
    const Corner corners[3] = {corner(a.x, a.y), corner(b.x, b.y), corner(c.x, c.y)};
    if (half == 1 && is_clear(square.x + 1, square.y + 1)) {
      const Verdict verdict = smallest_fits(corners, middles);
      if (verdict != Verdict::unknown) return verdict == Verdict::fits;
    }
    return right_triangle_fits(make_triangle(corners[0], corners[1], corners[2], demand), field);
  }
  /// Over the middle of an edge the surface is the mean of its ends, but for the curve. `slack` is above all that
  /// right_triangle_fits takes off the tolerance and loses by rounding: the triangle and its squares are at most 10 samples wide,
  /// and no slope is above `spread` a sample.
  CORDILLERA_HD Verdict smallest_fits(const Corner (&corners)[3], int middles) const {
    float off = 0.5f * height_step;  // of a corner, which is rounded
    for (int k = 0; k < middles; ++k) {
      const Corner &p = corners[k], &q = corners[k == 2 ? 0 : k + 1];
      const int x = (p.x + q.x) / 2, y = (p.y + q.y) / 2;
      const float apart = magnitude((0.5f * p.height + 0.5f * q.height) - field.height[field.index(x, y)]);
      off = apart > off ? apart : off;
    }
    const Corner &a = corners[0], &b = corners[1], &c = corners[2];
    const CurveRow curve = demand.curve.at((least(a.y, least(b.y, c.y)) + greatest(a.y, greatest(b.y, c.y))) / 2);
    const float bend = 4 * (curve.along + demand.curve.up);
    const float spread = magnitude(b.height - a.height) + magnitude(c.height - a.height) + bend;
    const float slack = spread * (0x1p-14f + 200 * magnitude(curve.sway)) + bend + 2;
    return off + slack <= demand.tolerance ? Verdict::fits : off > demand.tolerance + slack ? Verdict::fails : Verdict::unknown;
  }
};

/// How far a triangle within a square of so many cells may be from a sample, rounding included, where samples are within
/// `spread` / 2 of a plane of that slope. A square of w cells bends a triangle by no more than w * w / 4 of its bends, and its
/// slopes by no more than w of them.
CORDILLERA_HD inline float apart_in_square(const Network& net, int cells, float spread, float slope, int south) {
  const float wide = static_cast<float>(cells), box = static_cast<float>(cells + 8);  // as make_triangle takes it
  const Curve& curve = net.demand.curve;
  float bend = 0, sway = 0;
  for (int y = south; y <= least(south + cells, net.field.rows - 1); ++y) {
    const CurveRow row = curve.at(y);
    bend = row.along > bend ? row.along : bend;
    sway = row.sway > sway ? row.sway : sway;
  }
  bend += curve.up;
  const float steepest = slope + 2 * (spread + net.height_step + wide * bend);
  const float rise = steepest * box + bend * (box * box);
  return spread + net.height_step + bend * (wide * wide) + 8 * rise * kRoundingShare + 2 * sway * steepest * (box * box);
}

/// The plane through a square's corners, nearly.
struct CornerPlane {
  float first, dx, dy;
  CORDILLERA_HD CornerPlane(const Field& field, int west, int south, int columns, int rows) {
    const float* const corner = field.height + field.index(west, south);
    const auto east = static_cast<std::uint32_t>(columns - 1),
               north = static_cast<std::uint32_t>(rows - 1) * static_cast<std::uint32_t>(field.stride);
    first = corner[0];
    dx = (corner[east] - first + corner[north + east] - corner[north]) / static_cast<float>(2 * (columns - 1));
    dy = (corner[north] - first + corner[north + east] - corner[east]) / static_cast<float>(2 * (rows - 1));
  }
};

/// Is it certain of a square's triangles, whatever samples their corners are, that they fit? Then none needs to be measured. Yes,
/// where all samples are void; and where all are valid and so near to a plane that no such triangle can be too far from any of
/// them: its corners are within `off` of the plane and half a height step of their samples, so it is, but for what it bends; and
/// so is a sample.
struct CalmSquares {
  Network net;
  std::uint8_t* calm;

  CORDILLERA_HD void operator()(int sx, int sy) const {
    const Field& field = net.field;
    const int west = sx << kCalmShift, south = sy << kCalmShift;
    const int columns = least(kCalmCells + 1, field.columns - west), rows = least(kCalmCells + 1, field.rows - south);
    int valid = 1, none = 1;
    if (field.depth) {
      int low = 0, high = 0;
      for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < columns; ++x) {
          const int depth = field.depth[field.index(west + x, south + y)];
          low |= depth & 15, high |= depth >> 4;
        }
      }
      valid = high == 0, none = low == 0;
    } else {
      none = 0;
    }
    calm[sy * calm_squares(field.columns) + sx] = none || (valid && is_near_plane(west, south, columns, rows)) ? 1 : 0;
  }

 private:
  CORDILLERA_HD bool is_near_plane(int west, int south, int columns, int rows) const {
    const Field& field = net.field;
    const CornerPlane plane(field, west, south, columns, rows);
    const float* const first = field.height + field.index(west, south);
    float low = 0, high = 0;
    for (int y = 0; y < rows; ++y) {
      const float* const row = first + static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(field.stride);
      const float up = plane.dy * static_cast<float>(y);
      for (int x = 0; x < columns; ++x) {
        const float off = (row[x] - plane.first) - (plane.dx * static_cast<float>(x) + up);
        low = off < low ? off : low;
        high = off > high ? off : high;
      }
    }
    return apart_in_square(net, kCalmCells, high - low, magnitude(plane.dx) + magnitude(plane.dy), south) <= net.demand.tolerance;
  }
};

/// The same of larger squares, from the planes of the squares of 8 samples that they touch, all of them without voids.
struct CalmAreas {
  Network net;
  int shift;
  std::uint8_t* calm;

  CORDILLERA_HD void operator()(int sx, int sy) const {
    const Field& field = net.field;
    const int cells = 1 << shift, west = sx << shift, south = sy << shift;
    const int columns = least(cells + 1, field.columns - west), rows = least(cells + 1, field.rows - south);
    const CornerPlane plane(field, west, south, columns, rows);
    float off = 0;
    bool clear = true;
    for (int y = south >> 3; y <= (south + rows - 1) >> 3; ++y) {
      for (int x = west >> 3; x <= (west + columns - 1) >> 3; ++x) {
        const int square = y * field.tier_stride[0] + x;
        clear = clear && !(field.depth && has_deep_void(field.tier_depth[0][square], -1));
        const float apart =
            from(plane, field.plane[0][square], static_cast<float>(8 * x - west), static_cast<float>(8 * y - south));
        off = apart > off ? apart : off;
      }
    }
    const bool near =
        apart_in_square(net, cells, 2 * off, magnitude(plane.dx) + magnitude(plane.dy), south) <= net.demand.tolerance;
    calm[sy * calm_squares(field.columns, shift) + sx] = clear && near ? 1 : 0;
  }

 private:
  static constexpr float kRounded = 8;  ///< of heights beyond 2^23, and more

  /// How far samples of a square of 8 may be from the plane; x, y: from the plane's first corner to the square's.
  CORDILLERA_HD static float from(const CornerPlane& plane, const BoundingPlane& of, float x, float y) {
    const float middle = (of.middle - plane.first) - (plane.dx * (x + 3.5f) + plane.dy * (y + 3.5f));
    return magnitude(middle) + 3.5f * (magnitude(of.dx - plane.dx) + magnitude(of.dy - plane.dy)) + of.off + kRounded;
  }
};

struct MarkSquares {
  Network net;
  CORDILLERA_HD void operator()(int x, int y) const {
    const bool corner = ((x | y) & (net.largest - 1)) == 0;
    net.stays[net.field.index(x, y)] = net.is_inside(x, y) && (corner || net.is_at_hem(x, y)) ? 1 : 0;
  }
};

/// Vertices in the middle of a horizontal or vertical edge of length 2 * half; a thread each node (column, row) of the grid of
/// `half`.
struct KeepMiddles {
  Network net;
  int half;

  CORDILLERA_HD void operator()(int column, int row) const {
    const int x = column * half, y = row * half, h = half;
    const bool upright = (y & h) != 0;
    if (((x & h) != 0) == upright) return;
    std::uint8_t& stays = net.stays[net.field.index(x, y)];
    const int q = h / 2;
    if (q && (net.has(x - q, y - q) || net.has(x + q, y - q) || net.has(x - q, y + q) || net.has(x + q, y + q))) {
      stays = 1;
      return;
    }
    const GridPlace a = upright ? GridPlace{x, y - h} : GridPlace{x - h, y},
                    b = upright ? GridPlace{x, y + h} : GridPlace{x + h, y};
    const bool fits = upright ? net.triangle_fits(b, a, {x + h, y}, {x, y - h}, h, 1) &&
                                    net.triangle_fits(a, b, {x - h, y}, {x - 2 * h, y - h}, h, 1)
                              : net.triangle_fits(a, b, {x, y + h}, {x - h, y}, h, 1) &&
                                    net.triangle_fits(b, a, {x, y - h}, {x - h, y - 2 * h}, h, 1);
    if (!fits) stays = 1;
  }
};

/// Centres of squares of side 2 * half, which are the middles of their diagonals; likewise.
struct KeepCentres {
  Network net;
  int half;

  CORDILLERA_HD void operator()(int column, int row) const {
    const int x = column * half, y = row * half, h = half;
    if ((x & y & h) == 0) return;
    std::uint8_t& stays = net.stays[net.field.index(x, y)];
    if (net.has(x - h, y) || net.has(x + h, y) || net.has(x, y - h) || net.has(x, y + h)) {
      stays = 1;
      return;
    }
    const int rise = ((x ^ y) & (2 * h)) == 0 ? h : -h;  // which of the two diagonals
    const GridPlace west{x - h, y - rise}, east{x + h, y + rise}, square{x - h, y - h};
    const GridPlace& a = rise > 0 ? west : east;
    const GridPlace& b = rise > 0 ? east : west;
    if (!net.triangle_fits(a, b, {x - h, y + rise}, square, h, 3) || !net.triangle_fits(b, a, {x + h, y - rise}, square, h, 3))
      stays = 1;
  }
};

/// Neighbours of a vertex of the network, counter-clockwise, on the block's border from one border neighbour to the other; as
/// indices of samples. Returns how many; at most 8. A vertex knows its directions by the size of the squares that it is a corner
/// of, and finds the nearest vertex in each.
CORDILLERA_HD inline int network_ring(const Network& net, int x, int y, std::uint32_t* ring) {
  constexpr int kX[8] = {1, 1, 0, -1, -1, -1, 0, 1}, kY[8] = {0, 1, 1, 1, 0, -1, -1, -1};
  const int bits = x | y;
  const int own = bits ? bits & -bits : net.largest, size = least(own, net.largest);
  const bool corner = own >= net.largest;  // of largest squares, whose diagonals alternate
  const bool diagonals = corner ? ((x / size + y / size) & 1) == 0 : (x & y & size) != 0, axes = corner || !diagonals;
  std::uint32_t found[8];
  bool has[8], inside[8];
  for (int k = 0; k < 8; ++k) {
    has[k] = false;
    inside[k] = net.is_own(x + kX[k], y + kY[k]);
    int reach = k % 2 && !diagonals ? size / 2 : size;
    if (!inside[k] || reach == 0) continue;
    const bool certain = k % 2 ? diagonals : axes;
    if (!certain && !net.has(x + kX[k] * reach, y + kY[k] * reach)) continue;
    while (reach > 1 && net.has(x + kX[k] * (reach / 2), y + kY[k] * (reach / 2))) reach /= 2;
    has[k] = true;
    found[k] = net.field.index(x + kX[k] * reach, y + kY[k] * reach);
  }
  int first = 0, count = 0;
  for (int k = 0; k < 8; ++k) {
    if (inside[k] && !inside[(k + 7) % 8]) first = k;
  }
  for (int k = 0; k < 8; ++k) {
    if (has[(first + k) % 8]) ring[count++] = found[(first + k) % 8];
  }
  return count;
}

}  // namespace cordillera::gpu::exact
