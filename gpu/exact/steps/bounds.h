#pragma once
// What is known of squares of samples: a plane and how far they are from it, and how far from a rim they reach. Made once a
// block.
#include "gpu/device/atomic.h"
#include "gpu/exact/steps/field.h"

namespace cordillera::gpu::exact {

struct Interval {
  double low = 1e30, high = -1e30;
  CORDILLERA_HD void add(double from, double to) {
    if (from < low) low = from;
    if (to > high) high = to;
  }
  /// The plane through the middle of the interval. Its numbers are rounded to floats: `off` makes up for that.
  CORDILLERA_HD BoundingPlane plane(float dx, float dy) const {
    if (low > high) return {0, 0, 0, kNothing};
    const float middle = static_cast<float>(0.5 * (low + high));
    return {middle, dx, dy, static_cast<float>(0.5 * (high - low)) * (1 + 0x1p-20f) + magnitude(middle) * 0x1p-23f + 0.5f};
  }
};

/// Squares of 8 samples: the least-squares plane where all samples are there, else a level one.
struct BoundSamples {
  Field field;
  BoundingPlane* plane;
  Depth* depth;  ///< null where the block has no voids

  CORDILLERA_HD void operator()(std::size_t i) const {
    const int across = field.tier_stride[0], west = 8 * static_cast<int>(i % static_cast<std::size_t>(across)),
              south = 8 * static_cast<int>(i / static_cast<std::size_t>(across));
    const int columns = least(8, field.columns - west), rows = least(8, field.rows - south);
    Depth all = 0;
    int valid = 0;
    double sum_x = 0, sum_y = 0;
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) {
        const std::uint32_t at = field.index(west + x, south + y);
        if (field.depth) all = deeper(all, field.depth[at]);
        if (field.depth && is_void(field.depth[at])) continue;
        const double height = field.height[at];
        ++valid;
        sum_x += (x - 3.5) * height;
        sum_y += (y - 3.5) * height;
      }
    }
    constexpr double kSquares = 8 * 42.0;  // of x - 3.5 over 8 x 8 samples
    const float dx = valid == 64 ? static_cast<float>(sum_x / kSquares) : 0,
                dy = valid == 64 ? static_cast<float>(sum_y / kSquares) : 0;
    Interval off;
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) {
        if (field.is_void_at(west + x, south + y)) continue;
        const double d = field.height[field.index(west + x, south + y)] -
                         (static_cast<double>(dx) * (x - 3.5) + static_cast<double>(dy) * (y - 3.5));
        off.add(d, d);
      }
    }
    plane[i] = off.plane(dx, dy);
    if (depth) depth[i] = all;
  }
};

/// A square of the tier above, from its 4 x 4 parts: the least-squares plane of their middles, and of their own planes' distance
/// from it.
struct BoundSquares {
  Field field;
  int tier;  ///< of the result, 1 or more
  BoundingPlane* plane;
  Depth* depth;  ///< null where the block has no voids

  CORDILLERA_HD void operator()(std::size_t i) const {
    const int across = field.tier_stride[tier], below = field.tier_stride[tier - 1];
    const int west = 4 * static_cast<int>(i % static_cast<std::size_t>(across)),
              south = 4 * static_cast<int>(i / static_cast<std::size_t>(across));
    const int columns = least(4, below - west), rows = least(4, field.squares_down(tier - 1) - south);
    const double side = 1 << tier_shift(tier - 1);
    Depth all = 0;
    // The last squares of a row and of a column reach beyond the block: their middles are not where samples are.
    bool whole = west + 4 < below && south + 4 < field.squares_down(tier - 1);
    double sum_x = 0, sum_y = 0;
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) {
        const std::size_t at = static_cast<std::size_t>((south + y) * below + west + x);
        const BoundingPlane& part = field.plane[tier - 1][at];
        if (field.has_voids()) all = deeper(all, field.tier_depth[tier - 1][at]);
        whole = whole && part.off >= 0;
        sum_x += (x - 1.5) * part.middle;
        sum_y += (y - 1.5) * part.middle;
      }
    }
    const float dx = whole ? static_cast<float>(sum_x / (20 * side)) : 0,
                dy = whole ? static_cast<float>(sum_y / (20 * side)) : 0;
    Interval off;
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x) {
        const BoundingPlane& part = field.plane[tier - 1][static_cast<std::size_t>((south + y) * below + west + x)];
        if (part.off < 0) continue;
        const double middle = part.middle - (static_cast<double>(dx) * (x - 1.5) + static_cast<double>(dy) * (y - 1.5)) * side;
        const double slope_x = static_cast<double>(part.dx) - dx, slope_y = static_cast<double>(part.dy) - dy;
        const double far =
            part.off + 0.5 * (side - 1) * ((slope_x < 0 ? -slope_x : slope_x) + (slope_y < 0 ? -slope_y : slope_y));
        off.add(middle - far, middle + far);
      }
    }
    plane[i] = off.plane(dx, dy);
    if (depth) depth[i] = all;
  }
};

/// Samples as they come: row-major whole numbers of 2^-10 m, kNoHeight where void. A thread a padded sample, (x, y).
struct LoadSample {
  const std::int32_t* from;
  std::int64_t from_stride;
  float* height;
  Depth* depth;          ///< valid or void, both as far from the other kind as can be
  std::uint32_t* voids;  ///< set to 1 where there is one
  std::int32_t columns, rows, stride;

  CORDILLERA_HD void operator()(int x, int y) const {
    const std::size_t i = static_cast<std::size_t>(y) * static_cast<std::size_t>(stride) + static_cast<std::size_t>(x);
    const bool inside = x < columns && y < rows;
    const std::int32_t sample = inside ? from[y * from_stride + x] : 0;
    const bool none = sample == kVoidSample;
    height[i] = none ? 0.0f : static_cast<float>(sample);
    depth[i] = !inside ? Depth{0} : none ? void_depth(kFarthest) : valid_depth(kFarthest);
    if (none) set_shared(voids, 1u);
  }
  static constexpr std::int32_t kVoidSample = INT32_MIN;
};

/// Which samples are within 2^r of one of the other kind: `reach` more in a row (then in a column) than what `from` knows, which
/// is of that reach at least, so that three of its windows cover the new one without a gap. A byte has bit 0 where a valid sample
/// is near, bit 1 where a void one is. A thread eight samples (column and row of words), the bytes of a word, the western one
/// lowest; bytes beyond the block's columns are 0.
struct NearInRow {
  Field field;
  int reach;  ///< a power of two
  bool upright;
  const std::uint64_t* from;
  std::uint64_t* to;

  CORDILLERA_HD void operator()(int x, int y) const {
    to[y * (field.stride / 8) + x] = upright          ? word(x, y - reach) | word(x, y) | word(x, y + reach)
                                     : reach % 8 == 0 ? words_apart(x, y)
                                                      : bytes_apart(x, y);
  }

 private:
  CORDILLERA_HD std::uint64_t word(int x, int y) const {
    const int across = field.stride / 8;
    return x < 0 || y < 0 || x >= across || y >= field.rows
               ? 0
               : from[static_cast<std::size_t>(y) * static_cast<std::size_t>(across) + static_cast<std::size_t>(x)];
  }
  CORDILLERA_HD std::uint64_t words_apart(int x, int y) const {
    return (word(x - reach / 8, y) | word(x, y) | word(x + reach / 8, y)) & inside(x);
  }
  CORDILLERA_HD std::uint64_t bytes_apart(int x, int y) const {
    const std::uint64_t own = word(x, y);
    const int bits = 8 * reach;
    return (own | own << bits | word(x - 1, y) >> (64 - bits) | own >> bits | word(x + 1, y) << (64 - bits)) & inside(x);
  }
  CORDILLERA_HD std::uint64_t inside(int x) const {
    const int columns = field.columns - 8 * x;
    return columns >= 8 ? ~std::uint64_t{0} : ~(~std::uint64_t{0} << (8 * columns));
  }
};
struct MarkKinds {
  const Depth* depth;
  std::uint8_t* near;
  CORDILLERA_HD void operator()(std::size_t i) const { near[i] = depth[i] == 0 ? 0 : is_void(depth[i]) ? 2 : 1; }
};
/// A thread eight samples, too.
struct LowerDepth {
  const std::uint64_t* near;
  int r;
  Depth* depth;
  CORDILLERA_HD void operator()(std::size_t word) const {
    std::uint64_t both = near[word] & near[word] >> 1 & 0x0101010101010101u;
    for (std::size_t i = 8 * word; both != 0; ++i, both >>= 8) {
      if ((both & 1) == 0 || depth[i] == 0) continue;
      const Depth known = is_void(depth[i]) ? void_depth(r) : valid_depth(r);
      if (known < depth[i]) depth[i] = known;
    }
  }
};

}  // namespace cordillera::gpu::exact
