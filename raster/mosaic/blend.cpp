#include "raster/mosaic/blend.h"

#include <algorithm>

#include "proto/integers.h"

namespace cordillera::raster {
namespace {

bool valid(const proto::Samples& samples, std::size_t at) { return samples.height[at] != proto::kNoHeight; }

/// top * share + below * (1 - share) in whole steps, share = over / under; halves go up.
std::int32_t mix(std::int32_t top, std::int32_t below, std::int64_t over, std::int64_t under) {
  const std::int64_t sum = 2 * (top * over + below * (under - over)) + under;
  return static_cast<std::int32_t>(proto::floor_divide(sum, 2 * under));
}

}  // namespace

std::vector<std::uint16_t> distance_to_void(const proto::Samples& samples, int most) {
  const std::ptrdiff_t columns = samples.columns, rows = samples.rows;
  std::vector<std::uint16_t> distance(samples.height.size());
  // Two sweeps with the eight neighbours are exact for this distance.
  const auto sweep = [&](std::ptrdiff_t r, std::ptrdiff_t c, std::ptrdiff_t step) {
    const std::ptrdiff_t at = r * columns + c;
    int least = distance[static_cast<std::size_t>(at)];
    const auto look = [&](std::ptrdiff_t nr, std::ptrdiff_t nc) {
      if (nr < 0 || nr >= rows || nc < 0 || nc >= columns) return;
      least = std::min(least, distance[static_cast<std::size_t>(nr * columns + nc)] + 1);
    };
    look(r, c - step);
    for (std::ptrdiff_t side = -1; side <= 1; ++side) look(r - step, c + side);
    distance[static_cast<std::size_t>(at)] = static_cast<std::uint16_t>(least);
  };
  for (std::size_t at = 0; at < distance.size(); ++at) distance[at] = valid(samples, at) ? static_cast<std::uint16_t>(most) : 0;
  for (std::ptrdiff_t r = 0; r < rows; ++r) {
    for (std::ptrdiff_t c = 0; c < columns; ++c) sweep(r, c, 1);
  }
  for (std::ptrdiff_t r = rows - 1; r >= 0; --r) {
    for (std::ptrdiff_t c = columns - 1; c >= 0; --c) sweep(r, c, -1);
  }
  return distance;
}

std::vector<std::uint8_t> lay_over(const proto::Samples& top, proto::Samples& below, int feather) {
  std::vector<std::uint8_t> mixed(top.height.size());
  bool both = false;
  for (std::size_t at = 0; at < top.height.size() && !both; ++at) both = valid(top, at) && valid(below, at);
  const bool blend = feather > 0 && both;
  const std::vector<std::uint16_t> inside = blend ? distance_to_void(top, feather) : std::vector<std::uint16_t>{};
  const std::vector<std::uint16_t> under = blend ? distance_to_void(below, feather) : std::vector<std::uint16_t>{};
  for (std::size_t at = 0; at < top.height.size(); ++at) {
    if (!valid(top, at)) continue;
    if (blend && valid(below, at) && inside[at] < feather) {
      // Weights: top's own distance, and what that leaves, as far as below reaches.
      const std::int64_t full = feather, own = inside[at] * full, rest = (full - inside[at]) * under[at];
      below.height[at] = mix(top.height[at], below.height[at], own, own + rest);
      below.flat_water[at] = 0;
      mixed[at] = rest > 0 ? 1 : 0;
      continue;
    }
    below.height[at] = top.height[at];
    below.flat_water[at] = top.flat_water[at];
  }
  return mixed;
}

proto::Samples cut_out(const proto::Samples& from, const Source::Window& window) {
  proto::Samples samples = void_samples(window);
  for (std::int32_t r = 0; r < samples.rows; ++r) {
    const std::int64_t row = samples.south + r - from.south;
    if (row < 0 || row >= from.rows) continue;
    const auto at = static_cast<std::ptrdiff_t>(row * from.columns + (samples.west - from.west));
    const auto to = static_cast<std::ptrdiff_t>(r) * samples.columns;
    std::copy_n(from.height.begin() + at, samples.columns, samples.height.begin() + to);
    std::copy_n(from.flat_water.begin() + at, samples.columns, samples.flat_water.begin() + to);
  }
  return samples;
}

}  // namespace cordillera::raster
