#include "gpu/measure/surface_error_row.h"

#include <algorithm>
#include <cstring>

#include "proto/mesh.h"
#include "proto/wide.h"

namespace cordillera::gpu {
namespace {

constexpr std::size_t kLanes = 4;
using Doubles = double __attribute__((vector_size(sizeof(double) * kLanes)));
using Heights = std::int32_t __attribute__((vector_size(sizeof(std::int32_t) * kLanes)));

// What follows is PlaneRow::height_m, HeightRange::clamp and square_steps, word for word, four at a time: left to itself the
// compiler takes such loops apart.
inline __attribute__((always_inline)) double greatest_of(const Doubles& lanes) {
  return std::max(std::max(lanes[0], lanes[1]), std::max(lanes[2], lanes[3]));
}

// The whole of a row, four at a time; of a rest some are measured twice, to the same effect. out: null unless written.
template <bool kWritten>
inline __attribute__((always_inline)) double errors_of_row(const PlaneRow& plane, const HeightRange& range, const RowRun& run,
                                                           double* __restrict out) {
  const PlaneRow p = plane;
  const double* const sin_lon = run.sin_lon;
  const double* const cos_lon = run.cos_lon;
  const std::int32_t* const height = run.height;
  const std::size_t count = run.count;
  const Doubles none = {}, low = none + range.low_m, high = none + range.high_m;
  Doubles greatest = {};
  const auto four = [&](const Doubles& s, const Doubles& c, const Heights& h, Doubles& counted) __attribute__((always_inline)) {
    const Doubles q = p.normal_x * c + p.normal_y * s;
    const Doubles height_m = (p.above_m - p.radius_m * q) / (p.rise + p.cos_lat * q);
    const Doubles raised = height_m > low ? height_m : low, clamped = raised < high ? raised : high;
    const Doubles sample = __builtin_convertvector(h, Doubles);
    const Doubles off = clamped - sample * proto::kHeightStep_m;
    const Doubles error = off < none ? none - off : off;
    counted = sample == static_cast<double>(proto::kNoHeight) ? none : error;
    greatest = counted > greatest ? counted : greatest;
  };
  const auto at = [&](std::size_t k) __attribute__((always_inline)) {
    Doubles s, c, counted;
    Heights h;
    std::memcpy(&s, sin_lon + k, sizeof s);
    std::memcpy(&c, cos_lon + k, sizeof c);
    std::memcpy(&h, height + k, sizeof h);
    four(s, c, h, counted);
    if (kWritten) std::memcpy(out + k, &counted, sizeof counted);
  };
  if (count >= kLanes) {
    for (std::size_t k = 0; k + kLanes <= count; k += kLanes) at(k);
    if (count % kLanes != 0) at(count - kLanes);
    return greatest_of(greatest);
  }
  if (count == 0) return 0;
  const std::size_t i = count > 1 ? 1 : 0, j = count > 2 ? 2 : 0;
  const Doubles s = {sin_lon[0], sin_lon[i], sin_lon[j], sin_lon[j]}, c = {cos_lon[0], cos_lon[i], cos_lon[j], cos_lon[j]};
  Doubles counted;
  four(s, c, Heights{height[0], height[i], height[j], height[j]}, counted);
  for (std::size_t k = 0; kWritten && k < count; ++k) out[k] = counted[k];
  return greatest_of(greatest);
}

}  // namespace

CORDILLERA_WIDE double row_errors(const PlaneRow& plane, const HeightRange& range, const RowRun& run, double* out) {
  return errors_of_row<true>(plane, range, run, out);
}

CORDILLERA_WIDE double greatest_row_error(const PlaneRow& plane, const HeightRange& range, const RowRun& run) {
  return errors_of_row<false>(plane, range, run, nullptr);
}

CORDILLERA_WIDE void see_heights(const std::int32_t* height, std::size_t count, RowHeights& seen) {
  std::int32_t lowest = seen.lowest, highest = seen.highest;
  std::uint32_t none = 0;
  for (std::size_t k = 0; k < count; ++k) {
    const std::int32_t h = height[k];
    none += h == proto::kNoHeight ? 1u : 0u;
    highest = h > highest ? h : highest;  // of all 32-bit numbers kNoHeight is the least
    const std::int32_t low = h == proto::kNoHeight ? INT32_MAX : h;
    lowest = low < lowest ? low : lowest;
  }
  seen.lowest = lowest, seen.highest = highest;
  seen.valid += count - none;
}

CORDILLERA_WIDE void add_squares(const double* error_m, std::size_t count, SquareSum& sum) {
  constexpr double kSmall_m = 0x1p11;  // squares of smaller errors, 256 of them, add up exactly in a double
  constexpr double kShift = 0x1p52;    // added and taken away, it rounds to a whole number
  Doubles all = {}, greatest = {};
  std::size_t k = 0;
  for (; k + kLanes <= count; k += kLanes) {
    Doubles e;
    std::memcpy(&e, error_m + k, sizeof e);
    const Doubles steps = e * e * kSquaresPerStep + 0.5, near = steps + kShift - kShift;
    all += near > steps ? near - 1 : near;
    greatest = e > greatest ? e : greatest;
  }
  if (greatest_of(greatest) < kSmall_m) {
    sum.add(static_cast<std::uint64_t>(all[0] + all[1] + all[2] + all[3]));
  } else {
    k = 0;
  }
  for (; k < count; ++k) sum.add(square_steps(error_m[k]));
}

}  // namespace cordillera::gpu
