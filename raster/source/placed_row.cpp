#include "raster/source/placed_row.h"

#include <algorithm>

#include "proto/wide.h"

namespace cordillera::raster {
namespace {

/// NaN is neither less nor greater than anything.
CORDILLERA_WIDE void widen(const double* places, std::size_t count, double& low, double& high) {
  constexpr std::size_t kLanes = 8;
  double least[kLanes], most[kLanes];
  std::fill_n(least, kLanes, low), std::fill_n(most, kLanes, high);
  const auto add = [&](std::size_t lane, double at) {
    least[lane] = at < least[lane] ? at : least[lane];
    most[lane] = at > most[lane] ? at : most[lane];
  };
  std::size_t k = 0;
  for (; k + kLanes <= count; k += kLanes)
    for (std::size_t lane = 0; lane < kLanes; ++lane) add(lane, places[k + lane]);
  for (; k < count; ++k) add(0, places[k]);
  low = *std::min_element(least, least + kLanes), high = *std::max_element(most, most + kLanes);
}

/// Heights in steps; false when some are void.
CORDILLERA_WIDE bool put_heights(const double* height_m, const double* above_m, std::size_t count, std::int32_t* to) {
  unsigned voids = 0;
  for (std::size_t c = 0; c < count; ++c) {
    const double total_m = height_m[c] + above_m[c];
    const bool fits = std::abs(total_m) <= proto::kMaxHeight_m;
    const auto steps = static_cast<std::int32_t>(std::nearbyint((fits ? total_m : 0) / proto::kHeightStep_m));
    to[c] = fits ? steps : proto::kNoHeight;
    voids |= fits ? 0u : 1u;
  }
  return voids == 0;
}

CORDILLERA_WIDE void put_marks(const std::int32_t* __restrict height, const std::uint8_t* __restrict flat, std::size_t count,
                               std::uint8_t* __restrict to) {
  for (std::size_t c = 0; c < count; ++c) to[c] = height[c] == proto::kNoHeight ? 0 : flat[c];
}

}  // namespace

void FiniteRange::add(const double* places, std::size_t count) { widen(places, count, low_, high_); }

void put(double height_m, bool flat, std::size_t at, proto::Samples& samples) {
  if (!(std::abs(height_m) <= proto::kMaxHeight_m)) return;
  samples.height[at] = static_cast<std::int32_t>(std::nearbyint(height_m / proto::kHeightStep_m));
  samples.flat_water[at] = flat ? proto::kFlatWater : 0;
}

void put_row(const Kernel& kernel, const PixelBlock& block, const PlacedRow& row, const double* height_m,
             const std::uint8_t* flat, std::size_t from, proto::Samples& samples) {
  std::int32_t* const to = samples.height.data() + from;
  const bool all = put_heights(height_m, row.above_m, row.count, to);
  if (flat != nullptr) put_marks(to, flat, row.count, samples.flat_water.data() + from);
  if (all) return;
  for (std::size_t c = 0; c < row.count; ++c) {
    const PixelPosition place{row.u[c], row.v[c]};
    if (std::isnan(height_m[c]) && !std::isnan(place.u) && kernel.valid(place, block))
      put(kernel.value(place, block) + row.above_m[c], flat != nullptr && flat[c] != 0, from + c, samples);
  }
}

}  // namespace cordillera::raster
