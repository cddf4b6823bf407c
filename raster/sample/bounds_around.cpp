#include "raster/sample/bounds_around.h"

#include <algorithm>
#include <array>

#include "proto/wide.h"

namespace cordillera::raster {
namespace {

constexpr std::int32_t kNone = INT32_MAX;              // least of no sample
static_assert(proto::kNoHeight == INT32_MIN);          // so a void is never the greatest
constexpr std::size_t kAround = 2 * kBoundsReach + 1;  // columns

/// Takes a row's samples into the extremes of their columns.
CORDILLERA_WIDE void add_row(const std::int32_t* row, std::size_t count, std::int32_t* least, std::int32_t* greatest) {
  for (std::size_t k = 0; k < count; ++k) {
    least[k] = std::min(least[k], row[k] == proto::kNoHeight ? kNone : row[k]);
    greatest[k] = std::max(greatest[k], row[k]);
  }
}

/// Of columns from kBoundsReach west of the first sample on.
CORDILLERA_WIDE void put_bounds(const std::int32_t* least, const std::int32_t* greatest, std::size_t count,
                                BoundsAround::Bounds* to) {
  for (std::size_t k = 0; k < count; ++k) {
    std::int32_t low = least[k], high = greatest[k];
    for (std::size_t i = 1; i < kAround; ++i) low = std::min(low, least[k + i]), high = std::max(high, greatest[k + i]);
    to[k] = {low * proto::kHeightStep_m, high * proto::kHeightStep_m};
  }
}

}  // namespace

BoundsAround::BoundsAround(const proto::Samples& samples)
    : samples_(samples),
      bounds_(std::make_unique_for_overwrite<Bounds[]>(samples.height.size())),
      known_((samples.height.size() + kPiece - 1) / kPiece, 0) {}

void BoundsAround::find(std::size_t piece) {
  known_[piece] = 1;
  const auto columns = static_cast<std::size_t>(samples_.columns), rows = static_cast<std::size_t>(samples_.rows);
  const std::size_t end = std::min((piece + 1) * kPiece, samples_.height.size());
  for (std::size_t sample = piece * kPiece; sample < end;) {  // a piece goes on in the next row
    const std::size_t x = sample % columns, y = sample / columns, count = std::min(columns - x, end - sample);
    std::array<std::int32_t, kPiece + kAround - 1> least, greatest;
    least.fill(kNone), greatest.fill(proto::kNoHeight);
    const std::size_t west = x - std::min<std::size_t>(x, kBoundsReach), east = std::min(x + count + kBoundsReach, columns);
    const std::size_t first = west + kBoundsReach - x;  // of what the window has
    for (std::size_t row = y - std::min<std::size_t>(y, kBoundsReach); row <= std::min(y + kBoundsReach, rows - 1); ++row)
      add_row(samples_.height.data() + row * columns + west, east - west, least.data() + first, greatest.data() + first);
    put_bounds(least.data(), greatest.data(), count, bounds_.get() + sample);
    sample += count;
  }
}

}  // namespace cordillera::raster
