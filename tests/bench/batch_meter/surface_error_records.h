#pragma once
// What measuring many tiles on a device keeps of a tile, a triangle, a row of samples, and what it finds out.
#include <cstdint>

#include "gpu/device/atomic.h"
#include "gpu/device/bits.h"
#include "gpu/measure/surface_error_apart.h"
#include "gpu/measure/surface_error_triangle.h"
#include "gpu/measure/surface_error_window.h"

namespace cordillera::gpu {

/// What is found out about a tile. Errors are not negative, so that the bits of the greatest have its order.
struct TileTally {
  std::uint64_t max_bits = 0, square_low = 0, square_high = 0, covered = 0, summed = 0, overcovered = 0, valid = 0;
};

/// A tile of the batch, on the device.
struct MeteredTile {
  TileFacts facts;
  std::uint32_t first_vertex = 0, first_triangle = 0, first_rim = 0, rims = 0;
  Span rows;  ///< tile-local, of the samples
  SampleWindow::Stretch stretch[2];
  std::int64_t row_shift = 0;   ///< sample row = tile-local row + row_shift
  std::uint32_t all_valid = 0;  ///< 1: there is a sample everywhere under the tile
};

/// Where an exclusive sum tells to whom element i belongs: the last k with first(k) <= i.
template <class First>
CORDILLERA_HD std::uint32_t owner_of(std::uint32_t i, std::uint32_t count, const First& first) {
  std::uint32_t low = 0, high = count;
  while (high - low > 1) {
    const std::uint32_t middle = low + (high - low) / 2;
    (first(middle) <= i ? low : high) = middle;
  }
  return low;
}

/// What a row needs to know of its triangle, small enough to be kept for all of them.
struct alignas(16) MeteredTriangle {
  struct Edge {
    std::int32_t x, y, dx, dy;
  };
  Plane exact, rounded;
  HeightRange exact_range, rounded_range;
  double place_m;  ///< see place_error_m()
  double apart_m;  ///< see decodings_apart_m()
  std::int64_t slack[3];
  Edge edge[3];
  std::int32_t west, east;  ///< of the plan's columns
  std::int32_t first_row;
  std::uint32_t tile;
  std::uint32_t owned, slacks;  ///< bit k: edge k is; 1: some edge has slack

  CORDILLERA_HD void set(const MeasuredTriangle& t, std::uint32_t its_tile, double unit_rad) {
    exact = t.exact;
    rounded = t.rounded;
    exact_range = t.exact_range;
    rounded_range = t.rounded_range;
    place_m = place_error_m(t);
    apart_m = decodings_apart_m(t, unit_rad);
    owned = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const PlanEdge& e = t.plan.edge[k];
      edge[k] = {static_cast<std::int32_t>(e.x), static_cast<std::int32_t>(e.y), static_cast<std::int32_t>(e.dx),
                 static_cast<std::int32_t>(e.dy)};
      slack[k] = e.slack;
      owned |= e.owned ? 1u << k : 0u;
    }
    west = static_cast<std::int32_t>(t.plan.columns.first);
    east = static_cast<std::int32_t>(t.plan.columns.last);
    first_row = static_cast<std::int32_t>(t.plan.rows.first);
    tile = its_tile;
    slacks = t.plan.slack;
  }
  /// with_slack: `shown` is wanted, too.
  CORDILLERA_HD RowSpans row(std::int64_t y, bool with_slack) const {
    PlanTriangle plan;
    for (unsigned k = 0; k < 3; ++k) {
      const Edge e = edge[k];
      plan.edge[k] = {e.x, e.y, e.dx, e.dy, with_slack ? slack[k] : 0, (owned >> k & 1u) != 0};
    }
    plan.columns = {west, east};
    return plan.row(y);
  }
};

/// The same, known to be `from` or later.
template <class First>
CORDILLERA_HD std::uint32_t owner_from(std::uint32_t from, std::uint32_t i, std::uint32_t count, const First& first) {
  std::uint32_t low = from, step = 1;
  while (low + step < count && first(low + step) <= i) {
    low += step;
    step *= 2;
  }
  std::uint32_t high = low + step < count ? low + step : count;
  while (high - low > 1) {
    const std::uint32_t middle = low + (high - low) / 2;
    (first(middle) <= i ? low : high) = middle;
  }
  return low;
}

/// A row of samples of a triangle. The closed triangle's, from which the ends of the others are a sample or none away.
struct MeteredRow {
  enum Ends : std::uint32_t {
    kOwnedWest = 1,
    kOwnedEast = 2,
    kStrictWest = 4,
    kStrictEast = 8,  ///< the end sample is among them
    kOwned = 16,
    kStrict = 32,  ///< there are any
    kPlain = 64,   ///< samples everywhere, one after the other; the next two say where
  };
  std::uint32_t triangle;
  std::int32_t y, first, last;  ///< tile-local; first > last: none
  std::uint32_t ends;
  std::int32_t sample_row;  ///< of y
  std::int64_t shift;       ///< sample column = tile-local column + shift

  CORDILLERA_HD void set(std::uint32_t t, std::int64_t row, const RowSpans& spans) {
    triangle = t;
    y = static_cast<std::int32_t>(row);
    first = 0;
    last = -1;
    ends = 0;
    sample_row = 0;
    shift = 0;
    if (length(spans.closed) == 0) return;
    first = static_cast<std::int32_t>(spans.closed.first);
    last = static_cast<std::int32_t>(spans.closed.last);
    if (length(spans.owned) > 0)
      ends |= kOwned | (spans.owned.first == first ? kOwnedWest : 0u) | (spans.owned.last == last ? kOwnedEast : 0u);
    if (length(spans.strict) > 0)
      ends |= kStrict | (spans.strict.first == first ? kStrictWest : 0u) | (spans.strict.last == last ? kStrictEast : 0u);
  }
  /// Most rows need nothing else of their tile.
  CORDILLERA_HD void find_samples(const MeteredTile& tile) {
    const SampleWindow::Stretch& s = tile.stretch[0];
    if (!tile.all_valid || y < tile.rows.first || y > tile.rows.last || first < s.columns.first || last > s.columns.last) return;
    ends |= kPlain;
    sample_row = static_cast<std::int32_t>(y + tile.row_shift);
    shift = s.shift;
  }
  struct Part {
    std::int32_t first, last;
    CORDILLERA_HD bool holds(std::int32_t x) const { return x >= first && x <= last; }
  };
  CORDILLERA_HD Part owned() const { return part(kOwned, kOwnedWest, kOwnedEast); }
  CORDILLERA_HD Part strict() const { return part(kStrict, kStrictWest, kStrictEast); }
  CORDILLERA_HD std::int32_t strict_count() const {
    const Part samples = strict();
    return samples.last - samples.first + 1;
  }

 private:
  CORDILLERA_HD Part part(std::uint32_t any, std::uint32_t west, std::uint32_t east) const {
    if ((ends & any) == 0) return {0, -1};
    return {first + ((ends & west) ? 0 : 1), last - ((ends & east) ? 0 : 1)};
  }
};

/// What a thread finds out about one tile.
struct RowTally {
  std::uint64_t max_bits = 0;
  SquareSum squares;
  std::uint32_t covered = 0, summed = 0;
  std::int64_t overcovered = 0;

  CORDILLERA_HD void raise(double error_m) {
    const std::uint64_t bits = double_bits(error_m);
    max_bits = bits > max_bits ? bits : max_bits;
  }
  CORDILLERA_HD void add_to(TileTally* to) const {
    raise_to(&to->max_bits, max_bits);
    gpu::add_to(&to->square_low, squares.low);
    gpu::add_to(&to->square_high, squares.high);
    gpu::add_to(&to->covered, covered);
    gpu::add_to(&to->summed, summed);
    gpu::add_to(&to->overcovered, static_cast<std::uint64_t>(overcovered));
  }
};

/// Threads of a device that run in step; one on a host.
#ifdef __CUDA_ARCH__
inline constexpr std::uint32_t kInStep = 32;
#else
inline constexpr std::uint32_t kInStep = 1;
#endif

/// Adds what a thread found; called by all that run in step. Where they all speak of one tile they add up first: else they would
/// queue for it.
CORDILLERA_HD inline void add_together(TileTally* to, const RowTally& found) {
#ifdef __CUDA_ARCH__
  constexpr unsigned kAll = 0xffffffffu;
  using Word = unsigned long long;
  int alike = 0;
  __match_all_sync(kAll, reinterpret_cast<Word>(to), &alike);
  if (alike) {
    RowTally sum = found;
    for (int d = 16; d > 0; d /= 2) {
      const std::uint64_t other = __shfl_xor_sync(kAll, static_cast<Word>(sum.max_bits), d);
      sum.max_bits = other > sum.max_bits ? other : sum.max_bits;
      sum.squares.low += __shfl_xor_sync(kAll, static_cast<Word>(sum.squares.low), d);
      sum.squares.high += __shfl_xor_sync(kAll, static_cast<Word>(sum.squares.high), d);
      sum.covered += __shfl_xor_sync(kAll, sum.covered, d);
      sum.summed += __shfl_xor_sync(kAll, sum.summed, d);
      sum.overcovered += __shfl_xor_sync(kAll, static_cast<long long>(sum.overcovered), d);
    }
    if (to && (threadIdx.x & 31u) == 0) sum.add_to(to);
    return;
  }
#endif
  if (to) found.add_to(to);
}

}  // namespace cordillera::gpu
