#pragma once
// What happens to all vertices between passes and levels: from samples to a mesh, packed, made ready for a level, and out as
// triangles with their true error.
#include "gpu/exact/cut.h"
#include "gpu/exact/steps/coded.h"
#include "gpu/exact/steps/start.h"

namespace cordillera::gpu::exact {

struct CountStays {
  Network net;
  std::uint32_t* count;
  CORDILLERA_HD void operator()(int x, int y) const { count[net.field.index(x, y)] = net.takes(x, y) ? 1 : 0; }
};

/// The vertices of a block's network.
struct TakeVertex {
  Network net;
  const std::uint32_t* number;  ///< indexed by sample of the block: vertices before it
  MeshView mesh;
  CORDILLERA_HD void operator()(int x, int y) const {
    if (!net.takes(x, y)) return;
    const std::uint32_t i = net.field.index(x, y);
    const std::uint32_t v = number[i];
    std::uint32_t ring[8];
    const int valence = network_ring(net, x, y, ring);
    for (int k = 0; k < valence; ++k) mesh.ring_of(v)[k] = number[ring[k]];
    mesh.position[v] = pack_position(x, y);
    mesh.height[v] = net.field.height[i];
    mesh.valence[v] = static_cast<std::uint8_t>(valence);
    mesh.mark[v] = net.field.is_void_at(x, y) ? kVoidVertex : 0;
  }
};

struct BeginLevel {
  MeshView mesh;
  float height_step;
  CORDILLERA_HD void operator()(std::size_t v) const {
    mesh.height[v] = rounded_to(mesh.height[v], height_step);
    mesh.mark[v] = static_cast<std::uint8_t>(mesh.mark[v] & ~(kSettled | kHeld));
  }
};

struct CountAlive {
  MeshView mesh;
  std::size_t vertices;
  std::uint32_t* count;  ///< one more at the end
  CORDILLERA_HD void operator()(std::size_t v) const { count[v] = v < vertices && mesh.valence[v] != 0 ? 1 : 0; }
};
struct PackVertex {
  MeshView from, to;
  const std::uint32_t* number;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto v = static_cast<std::uint32_t>(i);
    const int valence = from.valence[v];
    if (valence == 0) return;
    const std::uint32_t n = number[v];
    to.position[n] = from.position[v];
    to.height[n] = from.height[v];
    to.valence[n] = static_cast<std::uint8_t>(valence);
    to.mark[n] = from.mark[v];
    for (int k = 0; k < valence; ++k) to.ring_of(n)[k] = number[from.ring_of(v)[k]];
  }
};
struct PackBlock {
  const std::uint32_t* number;
  std::uint32_t* first_vertex;
  CORDILLERA_HD void operator()(std::size_t b) const { first_vertex[b] = number[first_vertex[b]]; }
};

/// A triangle belongs to its least vertex.
struct OwnTriangles {
  MeshView mesh;
  const BlockView* blocks;
  CutView finder;  ///< of the block

  CORDILLERA_HD Corner corner(std::uint32_t v) const {
    const std::uint32_t position = mesh.position[v];
    return {position_x(position), position_y(position), mesh.height[v], (mesh.mark[v] & kVoidVertex) != 0};
  }
  template <class F>
  CORDILLERA_HD void each(std::uint32_t v, const F& f) const {
    const std::uint32_t position = mesh.position[v];
    const std::uint32_t* const ring = mesh.ring_of(v);
    const int valence = mesh.valence[v];
    const bool open = blocks[finder.block_of(v)].is_on_side(position_x(position), position_y(position));
    for (int k = 0; k < (open ? valence - 1 : valence); ++k) {
      const std::uint32_t a = ring[k], b = ring[k + 1 == valence ? 0 : k + 1];
      if (v < a && v < b) f(a, b);
    }
  }
};
struct CountTriangles {
  OwnTriangles own;
  std::size_t vertices;
  std::uint32_t* count;  ///< one more at the end
  CORDILLERA_HD void operator()(std::size_t i) const {
    std::uint32_t n = 0;
    if (i < vertices) own.each(static_cast<std::uint32_t>(i), [&n](std::uint32_t, std::uint32_t) { ++n; });
    count[i] = n;
  }
};
struct TakeTriangles {
  OwnTriangles own;
  const std::uint32_t* first;
  std::uint32_t* corners;  ///< 3 a triangle
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto v = static_cast<std::uint32_t>(i);
    std::uint32_t* at = corners + std::size_t{3} * first[v];
    own.each(v, [&at, v](std::uint32_t a, std::uint32_t b) {
      at[0] = v, at[1] = a, at[2] = b;
      at += 3;
    });
  }
};

/// What is known of the samples under each triangle.
struct BoundTriangle {
  OwnTriangles own;
  const std::uint32_t* corners;
  float tolerance;  ///< of the level: no more is said
  float* bound;

  template <class Lanes>
  CORDILLERA_HD void operator()(std::size_t t, const Lanes& lanes) const {
    const std::uint32_t* const v = corners + 3 * t;
    const Field& field = own.blocks[own.finder.block_of(v[0])].field;
    const float under =
        bound_under(make_triangle(own.corner(v[0]), own.corner(v[1]), own.corner(v[2]), {tolerance, 0, field.curve}), field,
                    tolerance, lanes);
    if (lanes.index() == 0) bound[t] = under;
  }
};

/// Errors of a level of a block, so that no order of adding shows: a maximum by the bits of a double that is not negative, and
/// whole numbers.
struct ErrorSums {
  std::uint64_t max_bits = 0;  ///< 2^-10 m
  std::uint64_t squares = 0;   ///< of tolerance / kErrorUnits
  std::uint64_t samples = 0;
};
inline constexpr double kErrorUnits = 4096;

/// Of the absolute value; they order like the numbers.
CORDILLERA_HD inline std::uint64_t magnitude_bits(double d) {
  union {
    double d;
    std::uint64_t u;
  } bits{d};
  return bits.u & ~(std::uint64_t{1} << 63);
}

/// A run of triangles against all their samples. A sample on an edge belongs to the triangle on the side of a tiny step inwards
/// from the block's border.
struct MeasureTriangles {
  OwnTriangles own;
  const std::uint32_t* corners;
  std::size_t triangles;
  std::size_t length;  ///< of a run
  std::size_t parts;   ///< of every triangle: rows by turns, each part of a run by other lanes
  double units;        ///< kErrorUnits / tolerance
  ErrorSums* errors;   ///< indexed by block

  template <class Lanes>
  CORDILLERA_HD void operator()(std::size_t i, const Lanes& lanes) const {
    const std::size_t run = i / parts;
    const auto part = static_cast<int>(i % parts);
    ErrorSums sums;
    std::uint32_t block = ~0u;
    for (std::size_t t = run * length; t < triangles && t < (run + 1) * length; ++t) {
      const std::uint32_t* const corner = corners + 3 * t;
      const std::uint32_t of = own.finder.block_of(corner[0]);
      if (of != block && block != ~0u) flush(lanes, block, sums);
      block = of;
      measure(lanes, part, block, corner, sums);
    }
    if (block != ~0u) flush(lanes, block, sums);
  }

 private:
  template <class Lanes>
  CORDILLERA_HD void flush(const Lanes& lanes, std::uint32_t block, ErrorSums& sums) const {
    sums.max_bits = lanes.max(sums.max_bits);
    sums.squares = lanes.sum(sums.squares);
    sums.samples = lanes.sum(sums.samples);
    if (lanes.index() == 0) lanes.add(errors[block], sums);
    sums = {};
  }
  CORDILLERA_HD static bool owns(const Triangle& t, const Field& field, int x, int y) {
    return t.owns(x, y, x + 1 < field.columns ? 1 : -1, y + 1 < field.rows ? 1 : -1);
  }
  template <class Lanes>
  CORDILLERA_HD void measure(const Lanes& lanes, int part, std::uint32_t block, const std::uint32_t* corner,
                             ErrorSums& sums) const {
    const Corner c[3] = {own.corner(corner[0]), own.corner(corner[1]), own.corner(corner[2])};
    const int rows = greatest(c[0].y, greatest(c[1].y, c[2].y)) - least(c[0].y, least(c[1].y, c[2].y)) + 1;
    if (part * lanes.rows() >= rows) return;
    const Field& field = own.blocks[block].field;
    const Triangle t = make_triangle(c[0], c[1], c[2], {0, 0, field.curve});
    if (!t.published) return;
    const double ux = c[1].x - c[0].x, uy = c[1].y - c[0].y, vx = c[2].x - c[0].x, vy = c[2].y - c[0].y, area = ux * vy - uy * vx;
    const double bend_x = t.bend_x, bend_y = t.bend_y;
    const double rise_b = (static_cast<double>(c[1].height) - c[0].height) - (bend_x * (ux * ux) + bend_y * (uy * uy)),
                 rise_c = (static_cast<double>(c[2].height) - c[0].height) - (bend_x * (vx * vx) + bend_y * (vy * vy));
    const double dx = (rise_b * vy - rise_c * uy) / area, dy = (rise_c * ux - rise_b * vx) / area;
    for (int y = t.south + lanes.row() + part * lanes.rows(); y <= t.north; y += lanes.rows() * static_cast<int>(parts)) {
      int from = t.west, to = t.east;
      clip_row(t, y, from, to);
      int own_from = from, own_to = to;
      while (own_from <= own_to && !owns(t, field, own_from, y)) ++own_from;
      while (own_from <= own_to && !owns(t, field, own_to, y)) --own_to;
      const double v = y - t.ey[0], rise = dy * v + bend_y * (v * v);
      for (int x = from + lanes.column(); x <= to; x += lanes.columns()) {
        if (field.is_void_at(x, y)) continue;
        const double u = x - t.ex[0];
        const double off =
            (static_cast<double>(t.height) - field.height[field.index(x, y)]) + ((dx * u + bend_x * (u * u)) + rise);
        const std::uint64_t bits = magnitude_bits(off);
        if (bits > sums.max_bits) sums.max_bits = bits;
        if (x < own_from || x > own_to) continue;
        const auto whole = static_cast<std::int64_t>(nearest_whole(off * units));
        sums.squares += static_cast<std::uint64_t>(whole * whole);
        ++sums.samples;
      }
    }
  }
  /// The samples of a row in the triangle, edges included.
  CORDILLERA_HD static void clip_row(const Triangle& t, int y, int& from, int& to) {
    for (int k = 0; k < 3; ++k) {
      const int slope = t.across[k], at = t.along[k] * (y - t.ey[k]);  // slope * (x - ex) >= -at
      if (slope > 0)
        from = greatest(from, t.ex[k] - floor_of(at, slope));
      else if (slope < 0)
        to = least(to, t.ex[k] + floor_of(at, -slope));
    }
  }
  CORDILLERA_HD static int floor_of(int n, int by) { return n >= 0 ? n / by : -((by - 1 - n) / by); }
};

}  // namespace cordillera::gpu::exact
