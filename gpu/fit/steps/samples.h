#pragma once
// The samples that lie in a triangle. A sample on an edge or a corner belongs to one triangle only: to the one that it falls into
// when it leans an endless bit to one side. Samples on the border of the input lean inwards.
#include <cstdint>

#include "gpu/fit/steps/fit_mesh.h"

namespace cordillera::gpu::fit {

/// Which way a sample leans: along x, and a little along y; or the other way round.
enum Lean : std::uint8_t { kLeanWest = 1, kLeanSouth = 2, kLeanAlongY = 4 };

inline constexpr float kNoSample = -3e38f;

/// Is a sample that lies on the line of an edge (direction dx, dy) on the edge's left?
template <class Int>
CORDILLERA_HD bool leans_left(Int dx, Int dy, std::uint8_t lean) {
  const Int along_x = (lean & kLeanWest) ? dy : -dy, along_y = (lean & kLeanSouth) ? -dx : dx;
  if (lean & kLeanAlongY) return along_y != 0 ? along_y > 0 : along_x > 0;
  return along_x != 0 ? along_x > 0 : along_y > 0;
}

CORDILLERA_HD inline std::int32_t least(std::int32_t a, std::int32_t b) { return a < b ? a : b; }
CORDILLERA_HD inline std::int32_t greatest(std::int32_t a, std::int32_t b) { return a > b ? a : b; }

/// Rows begin..end-1.
struct Rows {
  std::int32_t begin = 0, end = 0;
};

/// Samples on a regular lattice, 16 units apart; some may be missing.
struct LatticeSamples {
  static constexpr std::int32_t kStep = 16;
  static constexpr float kOff = 0;     ///< units along each axis that a sample may be away from its place
  const float* z = nullptr;            ///< row-major; kNoSample where missing
  const std::uint8_t* lean = nullptr;  ///< null: all the same way
  std::int32_t columns = 0, rows = 0;

  CORDILLERA_HD Point at(std::uint32_t i) const {
    const auto columns_u = static_cast<std::uint32_t>(columns);
    return {static_cast<std::int32_t>(i % columns_u) * kStep, static_cast<std::int32_t>(i / columns_u) * kStep};
  }
  /// Of a vertex of the input, at p.
  CORDILLERA_HD std::uint32_t of_vertex(std::uint32_t, Point p) const {
    return static_cast<std::uint32_t>(p.y / kStep * columns + p.x / kStep);
  }

  /// Surely no samples but its corners, if it has some there?
  CORDILLERA_HD bool has_only_corners(Point a, Point b, Point c) const {
    const auto close = [](std::int32_t p, std::int32_t q, std::int32_t r) {
      return greatest(p, greatest(q, r)) - least(p, least(q, r)) <= kStep;
    };
    return close(a.x, b.x, c.x) && close(a.y, b.y, c.y);
  }

  /// The rows of the lattice that a triangle reaches.
  CORDILLERA_HD Rows rows_of(Point a, Point b, Point c) const {
    const std::int32_t south = least(a.y, least(b.y, c.y)), north = greatest(a.y, greatest(b.y, c.y));
    return {(south + kStep - 1) / kStep, north / kStep + 1};
  }
  /// The samples of one row of it: visit(sample, e0, e1, e2). The e are twice the areas opposite to a, b and c; their sum is that
  /// of the triangle.
  template <class Visit>
  CORDILLERA_HD void in_row(Point a, Point b, Point c, std::int32_t row, const Visit& visit) const {
    with_scan(a, b, c, [&](const auto& scan) { scan.row(row, visit); });
  }
  /// visit(in_row): in_row(visit) visits the samples of the next row.
  template <class Visit>
  CORDILLERA_HD void each_row(Point a, Point b, Point c, const Visit& visit) const {
    const Rows reach = rows_of(a, b, c);
    with_scan(a, b, c, [&](const auto& scan) {
      for (std::int32_t row = reach.begin; row < reach.end; ++row) visit([&](const auto& sample) { scan.row(row, sample); });
    });
  }
  template <class Visit>
  CORDILLERA_HD void in_triangle(Point a, Point b, Point c, const Visit& visit) const {
    each_row(a, b, c, [&](const auto& row) { row(visit); });
  }

  /// How far the surface may be off at p: it is the input's own.
  CORDILLERA_HD float surface_off(Point) const { return 0; }
  /// The height of the surface, bilinear; kNoSample where a corner is missing.
  CORDILLERA_HD float surface(Point p) const {
    const std::int32_t column = least(p.x / kStep, columns - 2), row = least(p.y / kStep, rows - 2);
    const float* const corner = z + static_cast<std::int64_t>(row) * columns + column;
    if (corner[0] == kNoSample || corner[1] == kNoSample || corner[columns] == kNoSample || corner[columns + 1] == kNoSample)
      return kNoSample;
    const float fx = static_cast<float>(p.x - column * kStep) / kStep, fy = static_cast<float>(p.y - row * kStep) / kStep;
    const float low = corner[0] + (corner[1] - corner[0]) * fx,
                high = corner[columns] + (corner[columns + 1] - corner[columns]) * fx;
    return low + (high - low) * fy;
  }

 private:
  /// A triangle and the columns that it reaches; differences of its points and sums of two of their products fit Int.
  template <class Int>
  struct Scan {
    const LatticeSamples& samples;
    Point a, b, c;
    std::int32_t first, last;  ///< columns

    template <class Visit>
    CORDILLERA_HD void row(std::int32_t row, const Visit& visit) const {
      const Int d0x = Int{c.x} - b.x, d0y = Int{c.y} - b.y, d1x = Int{a.x} - c.x, d1y = Int{a.y} - c.y, d2x = Int{b.x} - a.x,
                d2y = Int{b.y} - a.y;
      const std::int32_t x = first * kStep, y = row * kStep;
      Int e0 = d0x * (Int{y} - b.y) - d0y * (Int{x} - b.x);
      Int e1 = d1x * (Int{y} - c.y) - d1y * (Int{x} - c.x);
      Int e2 = d2x * (Int{y} - a.y) - d2y * (Int{x} - a.x);
      std::int32_t column = 0, end = last - first;
      if (end > kLong) {
        narrow(e0, d0y * kStep, column, end);
        narrow(e1, d1y * kStep, column, end);
        narrow(e2, d2y * kStep, column, end);
        e0 -= d0y * kStep * column;
        e1 -= d1y * kStep * column;
        e2 -= d2y * kStep * column;
      }
      std::uint32_t sample = static_cast<std::uint32_t>(row) * static_cast<std::uint32_t>(samples.columns) +
                             static_cast<std::uint32_t>(first + column);
      bool inside = false;
      for (; column <= end; ++column, ++sample, e0 -= d0y * kStep, e1 -= d1y * kStep, e2 -= d2y * kStep) {
        if ((e0 | e1 | e2) < 0) {
          if (inside) break;
          continue;
        }
        inside = true;
        if (samples.z[sample] == kNoSample) continue;
        if (e0 == 0 || e1 == 0 || e2 == 0) {
          const std::uint8_t way = samples.lean ? samples.lean[sample] : std::uint8_t{0};
          if (e0 == 0 && !leans_left(d0x, d0y, way)) continue;
          if (e1 == 0 && !leans_left(d1x, d1y, way)) continue;
          if (e2 == 0 && !leans_left(d2x, d2y, way)) continue;
        }
        visit(sample, e0, e1, e2);
      }
    }

   private:
    /// Longer rows are worth divisions. A CPU walks past samples outside faster than it divides.
#ifdef __CUDA_ARCH__
    static constexpr std::int32_t kLong = 12;
#else
    static constexpr std::int32_t kLong = INT32_MAX;
#endif

    /// The steps n from..to with e - n * step >= 0; to < from if there are none.
    CORDILLERA_HD static void narrow(Int e, Int step, std::int32_t& from, std::int32_t& to) {
      if (step > 0) {
        const Int most = e < 0 ? -1 : e / step;
        if (most < to) to = static_cast<std::int32_t>(most);
      } else if (e < 0) {
        const Int fewest = step == 0 ? Int{to} + 1 : (-e - step - 1) / -step;
        if (fewest > from) from = fewest > to ? to + 1 : static_cast<std::int32_t>(fewest);
      }
    }
  };

  template <class Visit>
  CORDILLERA_HD void with_scan(Point a, Point b, Point c, const Visit& visit) const {
    const std::int32_t west = least(a.x, least(b.x, c.x)), east = greatest(a.x, greatest(b.x, c.x));
    const std::int32_t south = least(a.y, least(b.y, c.y)), north = greatest(a.y, greatest(b.y, c.y));
    const std::int32_t first = (west + kStep - 1) / kStep, last = east / kStep;
    constexpr std::int32_t kSmall = 1 << 14;
    if (east - west <= kSmall && north - south <= kSmall)
      visit(Scan<std::int32_t>{*this, a, b, c, first, last});
    else
      visit(Scan<std::int64_t>{*this, a, b, c, first, last});
  }
};

/// Samples anywhere, sorted into square bins; those of a row of bins follow each other.
struct ScatteredSamples {
  static constexpr float kOff = 0.5f;    ///< as above: places were rounded
  const float* z = nullptr;              ///< indexed by sample, in the order of the bins
  const Point* point = nullptr;          ///< likewise
  const std::uint8_t* lean = nullptr;    ///< likewise
  const std::uint32_t* start = nullptr;  ///< indexed by bin, row-major, one more at the end: its first sample
  std::int32_t columns = 0;              ///< of bins
  int bin_shift = 0;                     ///< a bin is 1 << bin_shift units wide
  LatticeSamples raster;                 ///< the input's surface, resampled; its unit is coarser:
  int raster_shift = 0;                  ///< by so many bits
  const float* off = nullptr;            ///< indexed by bin: how far that surface is off at its samples, at most

  CORDILLERA_HD Point at(std::uint32_t i) const { return point[i]; }
  CORDILLERA_HD std::uint32_t of_vertex(std::uint32_t v, Point) const { return v; }
  CORDILLERA_HD bool has_only_corners(Point, Point, Point) const { return false; }
  CORDILLERA_HD float surface(Point p) const { return raster.surface({p.x >> raster_shift, p.y >> raster_shift}); }
  CORDILLERA_HD float surface_off(Point p) const {
    return off[static_cast<std::int64_t>(p.y >> bin_shift) * columns + (p.x >> bin_shift)];
  }

  /// Rows of bins.
  CORDILLERA_HD Rows rows_of(Point a, Point b, Point c) const {
    return {least(a.y, least(b.y, c.y)) >> bin_shift, (greatest(a.y, greatest(b.y, c.y)) >> bin_shift) + 1};
  }
  template <class Visit>
  CORDILLERA_HD void in_row(Point a, Point b, Point c, std::int32_t row, const Visit& visit) const {
    const std::int32_t west = least(a.x, least(b.x, c.x)) >> bin_shift, east = greatest(a.x, greatest(b.x, c.x)) >> bin_shift;
    const std::uint32_t* const bins = start + static_cast<std::int64_t>(row) * columns;
    for (std::uint32_t i = bins[west]; i < bins[east + 1]; ++i) {
      const std::int64_t e0 = turn(b, c, point[i]), e1 = turn(c, a, point[i]), e2 = turn(a, b, point[i]);
      if ((e0 | e1 | e2) < 0) continue;
      if (e0 == 0 && !leans_left(c.x - b.x, c.y - b.y, lean[i])) continue;
      if (e1 == 0 && !leans_left(a.x - c.x, a.y - c.y, lean[i])) continue;
      if (e2 == 0 && !leans_left(b.x - a.x, b.y - a.y, lean[i])) continue;
      visit(i, e0, e1, e2);
    }
  }
  template <class Visit>
  CORDILLERA_HD void each_row(Point a, Point b, Point c, const Visit& visit) const {
    const Rows reach = rows_of(a, b, c);
    for (std::int32_t row = reach.begin; row < reach.end; ++row) {
      visit([&](const auto& sample) { in_row(a, b, c, row, sample); });
    }
  }
  template <class Visit>
  CORDILLERA_HD void in_triangle(Point a, Point b, Point c, const Visit& visit) const {
    each_row(a, b, c, [&](const auto& row) { row(visit); });
  }
};

}  // namespace cordillera::gpu::fit
