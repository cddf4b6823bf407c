#pragma once
// Samples above blocks: a byte each, between the ends of what the plane of their square leaves open. So nearly all that samples
// know is known, at a quarter of their memory. Where a level needs less, bytes are made coarser (coarser_code), so that they can
// be packed.
#include "gpu/exact/steps/triangle.h"

namespace cordillera::gpu::exact {

inline constexpr std::uint8_t kCodedVoid = 0;
inline constexpr float kCodeSteps = 127;  ///< from the plane to either end; the plane itself is 128

/// How many steps from the plane to either end are told apart: as few as leave `unit` open (2^-10 m) and no more than a byte
/// holds. Of ground that is calm for the levels above, that is 0, and its bytes are all the same.
CORDILLERA_HD inline int code_steps(float off, float unit) {
  if (off <= unit) return 0;
  int steps = 1;
  while (steps < static_cast<int>(kCodeSteps) && 0.5f * off > unit * static_cast<float>(steps)) steps = 2 * steps + 1;
  return steps;
}
/// How far a sample may be from what its byte says, 2^-10 m. unit: see Field.
CORDILLERA_HD inline float code_error(const BoundingPlane& plane, float unit) {
  const auto steps = static_cast<float>(code_steps(plane.off, unit));
  if (steps == 0) return plane.off + 1;
  const float rounded = steps < kCodeSteps ? 1 / kCodeSteps : 0;  // to a byte, twice
  return plane.off * (0.5f / steps + rounded) + 1;
}

/// The bytes of a square of 8, row by row; pads are void.
struct CodeSamples {
  Field field;
  std::uint8_t* code;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const int across = field.tier_stride[0], west = 8 * static_cast<int>(i % static_cast<std::size_t>(across)),
              south = 8 * static_cast<int>(i / static_cast<std::size_t>(across));
    const BoundingPlane plane = field.plane[0][i];
    for (int k = 0; k < 64; ++k) {
      const int x = west + (k & 7), y = south + (k >> 3);
      const bool there = x < field.columns && y < field.rows && !field.is_void_at(x, y);
      code[64 * i + static_cast<std::size_t>(k)] =
          there ? code_of(field.height[field.index(x, y)] - plane.at(k & 7, k >> 3), plane.off) : kCodedVoid;
    }
  }

 private:
  CORDILLERA_HD static std::uint8_t code_of(float above, float most) {
    const float steps = nearest_whole(above / most * kCodeSteps);
    return static_cast<std::uint8_t>(128 + static_cast<int>(steps < -kCodeSteps  ? -kCodeSteps
                                                            : steps > kCodeSteps ? kCodeSteps
                                                                                 : steps));
  }
};

/// The byte that says the same in so many steps (code_steps). Whole numbers: a sample's byte, rounded twice, is half of such a
/// step and two halves of a byte's away at the most.
constexpr std::uint8_t coarser_code(std::uint8_t code, int steps) {
  if (code == kCodedVoid || steps == static_cast<int>(kCodeSteps)) return code;
  if (steps == 0) return 128;
  constexpr int kMost = static_cast<int>(kCodeSteps);
  const int above = code - 128, size = above < 0 ? -above : above, step = (2 * size * steps + kMost) / (2 * kMost),
            rounded = (2 * step * kMost + steps) / (2 * steps);
  return static_cast<std::uint8_t>(above < 0 ? 128 - rounded : 128 + rounded);
}

/// A row of a square of 8 against a triangle whose tolerance has been lessened by code_error.
CORDILLERA_HD inline bool coded_row_fits(const Triangle& t, const Field& field, int sx, int y) {
  const int sy = y >> 3, east = least(8 * sx + 7, t.east);
  const Depth depth = field.has_voids() ? field.tier_depth[0][sy * field.tier_stride[0] + sx] : Depth{0};
  for (int x = greatest(8 * sx, t.west); x <= east; ++x) {
    if (!t.covers(x, y)) continue;
    // Of a sample's own depth its square's is no less.
    const bool none = field.is_void_there(x, y);
    if (!sample_fits(t, none ? 0 : field.height_at(x, y), static_cast<Depth>(depth & (none ? 0xf0 : 0x0f)), x, y)) return false;
  }
  return true;
}
CORDILLERA_HD inline Triangle less_code_error(Triangle t, const Field& field, int sx, int sy) {
  const BoundingPlane& plane = field.plane[0][sy * field.tier_stride[0] + sx];
  if (plane.off >= 0) t.tolerance -= code_error(plane, field.code_unit);
  return t;
}
CORDILLERA_HD inline bool coded_samples_fit(const Triangle& t, const Field& field, int sx, int sy) {
  const Triangle asked = less_code_error(t, field, sx, sy);
  const int north = least(8 * sy + 7, t.north);
  for (int y = greatest(8 * sy, t.south); y <= north; ++y) {
    if (!coded_row_fits(asked, field, sx, y)) return false;
  }
  return true;
}

/// How far the valid samples of a square under a published triangle are from it, 2^-10 m; below 0: there are none. All lanes of
/// a team have called, and get the same.
template <class Lanes>
CORDILLERA_HD float coded_square_error(const Triangle& t, const Field& field, int sx, int sy, const Lanes& lanes) {
  float worst = -1;
  for (int y = 8 * sy + lanes.row(); y < 8 * sy + 8; y += lanes.rows()) {
    for (int x = 8 * sx + lanes.column(); x < 8 * sx + 8; x += lanes.columns()) {
      if (!t.covers(x, y) || field.is_void_there(x, y)) continue;
      const float off = magnitude(t.height_above(static_cast<float>(x), static_cast<float>(y), field.height_at(x, y)));
      if (off > worst) worst = off;
    }
  }
  return lanes.max(worst);
}

/// How far the valid samples under a published triangle may be from it, 2^-10 m, if the demand's tolerance was `most`: no more
/// than that is said. Squares that cannot have more than what is found already are not looked at.
template <class Lanes>
CORDILLERA_HD float bound_under(const Triangle& t, const Field& field, float most, const Lanes& lanes) {
  if (!t.published) return 0;
  struct Square {
    std::int16_t x, y;
    std::int8_t tier;
  };
  Square stack[kMostFirstSquares + 15 * kTiers];
  int waiting = 0;
  const auto push = [&](const SquareRange& range, int tier) {
    for (int y = range.south; y <= range.north; ++y) {
      for (int x = range.west; x <= range.east; ++x)
        stack[waiting++] = {static_cast<std::int16_t>(x), static_cast<std::int16_t>(y), static_cast<std::int8_t>(tier)};
    }
  };
  const int first = first_tier(t);
  push(squares_under(t, first), first);
  Triangle asked = t;
  asked.rim_reach = kFarthest;  // what rims leave out is not asked here
  asked.tolerance = 0;
  while (waiting > 0 && asked.tolerance < most) {
    const Square s = stack[--waiting];
    if (square_fits(asked, field, s.tier, s.x, s.y)) continue;
    if (s.tier > 0) {
      push(parts_under(t, s.tier, s.x, s.y), s.tier - 1);
      continue;
    }
    const float off = lanes.coded_error(t, field, s.x, s.y);
    if (off < 0) continue;
    const float error = off + code_error(field.plane[0][s.y * field.tier_stride[0] + s.x], field.code_unit);
    if (error > asked.tolerance) asked.tolerance = error;
  }
  const float hidden = most - t.tolerance;  // what rounding and the earth's curve may add
  return asked.tolerance + hidden < most ? asked.tolerance + hidden : most;
}

}  // namespace cordillera::gpu::exact
