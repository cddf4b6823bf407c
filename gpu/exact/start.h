#pragma once
// What a block starts from: a right-triangulated network of its samples, in which every triangle has been measured. From the
// smallest right triangles up, the vertex in the middle of an edge is left out if both triangles of the edge fit and no smaller
// one needs it.
//
// W. Evans, D. Kirkpatrick, G. Townsend, "Right-triangulated irregular networks", 2001.
#include "gpu/exact/triangle.h"

namespace cordillera::gpu::exact {

/// A share of the tolerance: what is left lets the waves go far. Measured: less costs time and brings nothing, more costs
/// triangles.
inline constexpr float kStartShare = 0.75f;
inline constexpr int kLargestSquare = 32;

/// A row of a surface: `height` at its first sample, `slope` there, see Curve for bend.
struct SurfaceRow {
  float height, slope, bend;
};
/// Samples of a row against it; all valid.
CORDILLERA_HD inline bool run_fits(const float* sample, int count, const SurfaceRow& row, float tolerance) {
  int bad = 0;
  for (int i = 0; i < count; ++i) {
    const float u = static_cast<float>(i);
    bad |= !(magnitude((row.height - sample[i]) + (row.slope + row.bend * u) * u) <= tolerance);
  }
  return bad == 0;
}

/// The whole of a triangle with edges along rows, columns and diagonals.
CORDILLERA_HD inline bool right_triangle_fits(const Triangle& t, const Field& field) {
  if (!can_fit(t)) return false;
  for (int y = t.south; y <= t.north; ++y) {
    int from = t.west, to = t.east;
    for (int k = 0; k < 3; ++k) {
      if (t.across[k] == 0) continue;
      const int at = t.along[k] == 0                         ? t.ex[k]
                     : (t.across[k] > 0) == (t.along[k] > 0) ? t.ex[k] - (y - t.ey[k])
                                                             : t.ex[k] + (y - t.ey[k]);
      if (t.across[k] > 0) from = greatest(from, at);
      else to = least(to, at);
    }
    const std::uint32_t at = field.index(from, y);
    if (field.depth) {
      for (int x = from; x <= to; ++x) {
        if (!sample_fits(t, field.height[at + static_cast<std::uint32_t>(x - from)],
                         field.depth[at + static_cast<std::uint32_t>(x - from)], x, y))
          return false;
      }
    } else {
      const float u = static_cast<float>(from - t.ex[0]);
      const SurfaceRow row{t.height + (t.rise_along(u) + t.rise_up(static_cast<float>(y - t.ey[0]))), t.dx + 2 * t.bend_x * u, t.bend_x};
      if (!run_fits(field.height + at, to - from + 1, row, t.tolerance)) return false;
    }
  }
  return true;
}

/// A block's network: which samples stay, indexed like Field::height.
struct Network {
  Field field;
  std::uint8_t* stays = nullptr;
  int largest = 1;      ///< side of the largest square
  Demand demand{0, 0, {}};  ///< with the start's share of the tolerance
  float height_step = 1;
  std::int32_t west = 0, east = 0, south = 0, north = 0;  ///< what of the block becomes a mesh
  std::uint32_t hems = 0;                                 ///< sides of that, bit by Side, that end at a hem: two rows of it stay

  CORDILLERA_HD bool is_inside(int x, int y) const { return x >= 0 && y >= 0 && x < field.columns && y < field.rows; }
  CORDILLERA_HD bool is_own(int x, int y) const { return x >= west && y >= south && x <= east && y <= north; }
  /// Is sample i, of the block's, a vertex of the mesh?
  CORDILLERA_HD bool takes(std::size_t i) const {
    const auto across = static_cast<std::size_t>(field.stride);
    return stays[i] != 0 && is_own(static_cast<int>(i % across), static_cast<int>(i / across));
  }
  CORDILLERA_HD bool is_at_hem(int x, int y) const {
    return ((hems & 1) && (y == south || y == south + 1)) || ((hems & 2) && (x == east || x == east - 1)) ||
           ((hems & 4) && (y == north || y == north - 1)) || ((hems & 8) && (x == west || x == west + 1));
  }
  CORDILLERA_HD bool has(int x, int y) const { return is_inside(x, y) && stays[field.index(x, y)] != 0; }
  CORDILLERA_HD Corner corner(int x, int y) const {
    return {x, y, rounded_to(field.height[field.index(x, y)], height_step), field.is_void_at(x, y)};
  }
  CORDILLERA_HD bool triangle_fits(const Corner& a, const Corner& b, int x, int y) const {
    return !is_inside(x, y) || right_triangle_fits(make_triangle(a, b, corner(x, y), demand), field);
  }
};

struct MarkSquares {
  Network net;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto stride = static_cast<std::size_t>(net.field.stride);
    const auto x = static_cast<int>(i % stride), y = static_cast<int>(i / stride);
    const bool corner = x % net.largest == 0 && y % net.largest == 0;
    net.stays[i] = net.is_inside(x, y) && (corner || net.is_at_hem(x, y)) ? 1 : 0;
  }
};

/// Vertices in the middle of a horizontal or vertical edge of length 2 * half; a thread each node of the grid of `half`.
struct KeepMiddles {
  Network net;
  int half;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto across = static_cast<std::size_t>((net.field.columns - 1) / half + 1);
    const int x = static_cast<int>(i % across) * half, y = static_cast<int>(i / across) * half, h = half;
    const bool upright = (y & h) != 0;
    if (((x & h) != 0) == upright) return;
    std::uint8_t& stays = net.stays[net.field.index(x, y)];
    const int q = h / 2;
    if (q && (net.has(x - q, y - q) || net.has(x + q, y - q) || net.has(x - q, y + q) || net.has(x + q, y + q))) {
      stays = 1;
      return;
    }
    const Corner a = upright ? net.corner(x, y - h) : net.corner(x - h, y),
                 b = upright ? net.corner(x, y + h) : net.corner(x + h, y);
    const bool fits = upright ? net.triangle_fits(b, a, x + h, y) && net.triangle_fits(a, b, x - h, y)
                              : net.triangle_fits(a, b, x, y + h) && net.triangle_fits(b, a, x, y - h);
    if (!fits) stays = 1;
  }
};

/// Centres of squares of side 2 * half, which are the middles of their diagonals; likewise.
struct KeepCentres {
  Network net;
  int half;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto across = static_cast<std::size_t>((net.field.columns - 1) / half + 1);
    const int x = static_cast<int>(i % across) * half, y = static_cast<int>(i / across) * half, h = half;
    if ((x & y & h) == 0) return;
    std::uint8_t& stays = net.stays[net.field.index(x, y)];
    if (net.has(x - h, y) || net.has(x + h, y) || net.has(x, y - h) || net.has(x, y + h)) {
      stays = 1;
      return;
    }
    const int rise = ((x ^ y) & (2 * h)) == 0 ? h : -h;  // which of the two diagonals
    const Corner west = net.corner(x - h, y - rise), east = net.corner(x + h, y + rise);
    const Corner& a = rise > 0 ? west : east;
    const Corner& b = rise > 0 ? east : west;
    if (!net.triangle_fits(a, b, x - h, y + rise)) stays = 1;
    else if (!net.triangle_fits(b, a, x + h, y - rise)) stays = 1;
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
