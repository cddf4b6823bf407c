#include "gpu/surface_error_row.h"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "proto/mesh.h"

// A sanitizer's own calls do not work yet where the loader chooses between the versions.
#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__) && defined(__OPTIMIZE__)
#define CORDILLERA_WIDE __attribute__((target_clones("avx2", "default")))
#else
#define CORDILLERA_WIDE
#endif

namespace cordillera::gpu {
namespace {

constexpr std::size_t kLanes = 4;
using Doubles = double __attribute__((vector_size(sizeof(double) * kLanes)));
using Heights = std::int32_t __attribute__((vector_size(sizeof(std::int32_t) * kLanes)));

// What follows is PlaneRow::height_m, HeightRange::clamp and square_steps, word for word, four at a time: left to itself the compiler takes
// such loops apart.
inline __attribute__((always_inline)) double greatest_of(const Doubles& lanes) {
  return std::max(std::max(lanes[0], lanes[1]), std::max(lanes[2], lanes[3]));
}

}  // namespace

CORDILLERA_WIDE double row_errors(const PlaneRow& plane, const HeightRange& range, const RowRun& run, double* out) {
  const PlaneRow p = plane;
  const Doubles none = {}, low = none + range.low_m, high = none + range.high_m;
  Doubles greatest = {};
  std::size_t k = 0;
  for (; k + kLanes <= run.count; k += kLanes) {
    Doubles s, c;
    Heights h;
    std::memcpy(&s, run.sin_lon + k, sizeof s);
    std::memcpy(&c, run.cos_lon + k, sizeof c);
    std::memcpy(&h, run.height + k, sizeof h);
    const Doubles q = p.normal_x * c + p.normal_y * s;
    const Doubles height_m = (p.above_m - p.radius_m * q) / (p.rise + p.cos_lat * q);
    const Doubles raised = height_m > low ? height_m : low, clamped = raised < high ? raised : high;
    const Doubles sample = __builtin_convertvector(h, Doubles);
    const Doubles off = clamped - sample * proto::kHeightStep_m;
    const Doubles error = off < none ? none - off : off;
    const Doubles counted = sample == static_cast<double>(proto::kNoHeight) ? none : error;
    std::memcpy(out + k, &counted, sizeof counted);
    greatest = counted > greatest ? counted : greatest;
  }
  double most = greatest_of(greatest);
  for (; k < run.count; ++k) {
    const std::int32_t h = run.height[k];
    const double error = std::abs(range.clamp(p.height_m(run.sin_lon[k], run.cos_lon[k])) - h * proto::kHeightStep_m);
    out[k] = h == proto::kNoHeight ? 0 : error;
    most = std::max(most, out[k]);
  }
  return most;
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
