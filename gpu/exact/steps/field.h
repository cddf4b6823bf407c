#pragma once
// The samples of one block and what is known of squares of them, as kernels see them. Heights are whole numbers of 2^-10 m in
// floats, which are exact up to 2^24: the range of proto::kMaxHeight_m.
#include <cmath>
#include <cstdint>

#include "proto/host_device.h"

namespace cordillera::gpu::exact {

inline constexpr int kTiers = 6;  ///< squares of 8, 32, 128, 512, 2,048 and 8,192 samples: few of the largest cover any triangle
CORDILLERA_HD constexpr int tier_shift(int tier) { return 3 + 2 * tier; }

/// All valid samples of a square are within `off` of middle + dx * (x - mx) + dy * (y - my), with (mx, my) the middle of the
/// square. A square without valid samples has off = kNothing, which fits any plane.
struct BoundingPlane {
  float middle, dx, dy, off;
  /// Of a square of 8: over its sample (x, y).
  CORDILLERA_HD float at(int x, int y) const {
    return middle + (dx * (static_cast<float>(x) - 3.5f) + dy * (static_cast<float>(y) - 3.5f));
  }
};
inline constexpr float kNothing = -1e30f;

/// How far a sample is from the nearest one of the other kind (valid or void), in steps: the least r with a distance of at most
/// 2^r, in columns and in rows; kFarthest where there is none within reach. A byte holds r + 1: in the low half for a valid
/// sample, in the high half for a void one. For a square of samples it holds the greatest of both kinds.
using Depth = std::uint8_t;
inline constexpr int kFarthest = 14;
CORDILLERA_HD constexpr bool is_void(Depth depth) { return depth >= 16; }
CORDILLERA_HD constexpr Depth valid_depth(int r) { return static_cast<Depth>(r + 1); }
CORDILLERA_HD constexpr Depth void_depth(int r) { return static_cast<Depth>((r + 1) << 4); }
CORDILLERA_HD constexpr Depth deeper(Depth a, Depth b) {
  const int low = (a & 15) > (b & 15) ? a & 15 : b & 15, high = (a >> 4) > (b >> 4) ? a >> 4 : b >> 4;
  return static_cast<Depth>(low | high << 4);
}
/// Is one of the valid samples (of the void ones) farther than 2^reach steps from the other kind? reach -1: is there one at all?
CORDILLERA_HD constexpr bool has_deep_valid(Depth depth, int reach) { return (depth & 15) > reach + 1; }
CORDILLERA_HD constexpr bool has_deep_void(Depth depth, int reach) { return (depth >> 4) > reach + 1; }

/// A flat triangle lies below the lattice's surface, which is curved as the earth is: over (u, v) samples from a corner its
/// height is that of a plane, and along * u * u + up * v * v. A chord does not lie over its line on the lattice, either: by
/// second order it sways from it, by a share of u * u to the north, and of u * v to the east. That is taken off the tolerance.
/// What is left is of third order.
struct CurveRow {
  float along = 0;   ///< 2^-10 m, not below 0
  float sway = 0;    ///< samples to the east, for each of u * v
  float narrow = 1;  ///< how wide a sample is, of its height: 1 at the equator, 0 at a pole, whose row is one point
  std::int32_t to_pole = INT32_MAX;  ///< rows

  CORDILLERA_HD bool is_pole() const { return narrow == 0; }
  /// Samples to the north, of a chord of so many columns.
  CORDILLERA_HD float north(float wide) const { return sway * (narrow * wide) * (narrow * wide); }
  /// Samples to the east; no more than the chord is wide.
  CORDILLERA_HD float east(float wide, float high) const { return sway * high < 1 ? sway * high * wide : wide; }
};
struct Curve {
  const CurveRow* row = nullptr;  ///< indexed by row; null: a plane is flat over the lattice
  float up = 0;                   ///< 2^-10 m, not below 0

  CORDILLERA_HD CurveRow at(int y) const { return row ? row[y] : CurveRow{}; }
};

/// A meridian between tiles that ends at a pole keeps what vertices it has at doubling distances from it, in those tiles: the
/// triangles there are long and thin, and need something to end at.
CORDILLERA_HD constexpr bool stays_on_meridian(std::int32_t to_pole, std::int32_t tile_side) {
  return to_pole <= tile_side && (to_pole & (to_pole - 1)) == 0;
}

/// Rows are padded to whole squares of 8, and so are columns; pads lie outside of every triangle. Above the blocks samples are
/// coded, see coded.h.
struct Field {
  const float* height = nullptr;       ///< indexed by y * stride + x; void: 0; null: samples are coded
  const std::uint8_t* code = nullptr;  ///< 64 a square of 8
  float code_unit = 0;                 ///< what codes leave open of a sample where they could tell more, 2^-10 m; see code_steps
  const Depth* depth = nullptr;        ///< indexed as height; null where the block has no voids, or coded samples
  const BoundingPlane* plane[kTiers] = {};  ///< indexed by square, y * tier_stride + x
  const Depth* tier_depth[kTiers] = {};     ///< indexed likewise; null where the block has no voids
  std::int32_t columns = 0, rows = 0, stride = 0;
  std::int32_t tier_stride[kTiers] = {};
  Curve curve;

  CORDILLERA_HD std::uint32_t index(int x, int y) const {
    return static_cast<std::uint32_t>(y) * static_cast<std::uint32_t>(stride) + static_cast<std::uint32_t>(x);
  }
  CORDILLERA_HD bool has_voids() const { return tier_depth[0] != nullptr; }
  CORDILLERA_HD bool is_void_at(int x, int y) const { return depth && is_void(depth[index(x, y)]); }
  /// The sample, also where it is coded.
  CORDILLERA_HD float height_at(int x, int y) const {
    if (height) return height[index(x, y)];
    const std::uint32_t square = square_of(x, y);
    const BoundingPlane& p = plane[0][square];
    return p.at(x & 7, y & 7) + p.off * ((static_cast<float>(code[64 * std::size_t{square} + code_place(x, y)]) - 128) / 127);
  }
  CORDILLERA_HD bool is_void_there(int x, int y) const {
    return height ? is_void_at(x, y) : code[64 * std::size_t{square_of(x, y)} + code_place(x, y)] == 0;
  }
  CORDILLERA_HD std::uint32_t square_of(int x, int y) const {
    return static_cast<std::uint32_t>((y >> 3) * tier_stride[0] + (x >> 3));
  }
  CORDILLERA_HD static std::uint32_t code_place(int x, int y) { return static_cast<std::uint32_t>((y & 7) * 8 + (x & 7)); }
  CORDILLERA_HD int squares_down(int tier) const { return ((rows - 1) >> tier_shift(tier)) + 1; }
  CORDILLERA_HD std::size_t squares(int tier) const {
    return static_cast<std::size_t>(tier_stride[tier]) * static_cast<std::size_t>(squares_down(tier));
  }
};

CORDILLERA_HD inline float magnitude(float a) { return a < 0 ? -a : a; }
/// The nearest whole number, of two the even one: what rintf and rint give, without a call. Beyond half of what has a fraction it
/// is theirs.
CORDILLERA_HD inline float nearest_whole(float a) {
  constexpr float kNoFraction = 0x1.8p23f;
  return magnitude(a) < 0x1p22f ? (a + kNoFraction) - kNoFraction : rintf(a);
}
CORDILLERA_HD inline double nearest_whole(double a) {
  constexpr double kNoFraction = 0x1.8p52;
  return a < 0x1p51 && a > -0x1p51 ? (a + kNoFraction) - kNoFraction : rint(a);
}
/// The nearest multiple of step, a power of two; of two the even one.
CORDILLERA_HD inline float rounded_to(float height, float step) { return nearest_whole(height / step) * step; }

CORDILLERA_HD inline int least(int a, int b) { return a < b ? a : b; }
CORDILLERA_HD inline int greatest(int a, int b) { return a > b ? a : b; }

}  // namespace cordillera::gpu::exact
