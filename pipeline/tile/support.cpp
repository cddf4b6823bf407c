#include "pipeline/tile/support.h"

#include <algorithm>

namespace cordillera::pipeline {

void keep_around(proto::TileMesh& input, const proto::TileMesh& simplified, std::uint32_t triangle, std::size_t count) {
  std::int64_t x = 0, y = 0;
  for (const std::uint32_t v : simplified.triangles[triangle]) {
    x += simplified.x[v];
    y += simplified.y[v];
  }
  keep_near(input, x / 3, y / 3, count);
}

void keep_near(proto::TileMesh& input, std::int64_t x, std::int64_t y, std::size_t count) {
  std::vector<std::pair<std::int64_t, std::uint32_t>> near;
  for (std::uint32_t v = 0; v < input.vertices(); ++v) {
    if (input.mark[v] & (proto::kVoid | proto::kRemove)) continue;
    const std::int64_t dx = input.x[v] - x, dy = input.y[v] - y;
    near.emplace_back(dx * dx + dy * dy, v);
  }
  const auto most = static_cast<std::ptrdiff_t>(std::min(count, near.size()));
  std::nth_element(near.begin(), near.begin() + most, near.end());
  for (auto kept = near.begin(); kept != near.begin() + most; ++kept) input.mark[kept->second] |= proto::kKeep;
}

std::uint32_t keep_support(proto::TileMesh& input, const proto::TileMesh& simplified, std::int32_t cell_units, int attempt) {
  std::uint32_t left = 0;
  const auto keep_nearest = [&](std::int64_t x, std::int64_t y) {
    if (x < 0 || y < 0 || x > input.side || y > input.side) return;
    std::int64_t least = INT64_MAX;
    std::size_t best = 0;
    for (std::size_t v = 0; v < input.vertices(); ++v) {
      const bool inside = input.x[v] > 0 && input.y[v] > 0 && input.x[v] < input.side && input.y[v] < input.side;
      const std::int64_t dx = input.x[v] - x, dy = input.y[v] - y;
      if (!inside || dx * dx + dy * dy >= least) continue;
      least = dx * dx + dy * dy;
      best = v;
    }
    if (least != INT64_MAX) input.mark[best] |= proto::kKeep;
  };
  for (std::size_t v = 0; v < simplified.vertices(); ++v) {
    if (!(simplified.mark[v] & proto::kRemove)) continue;
    ++left;
    const std::int64_t x = simplified.x[v], y = simplified.y[v];
    const std::int64_t in_x = x == 0 ? 1 : x == input.side ? -1 : 0, in_y = y == 0 ? 1 : y == input.side ? -1 : 0;
    // Not close by: what is kept there would stand in the way as well.
    for (std::int64_t d = std::int64_t{4} * cell_units << (attempt & 3); d < input.side; d *= 2) {
      for (int across = -1; across <= 1; ++across)
        keep_nearest(x + in_x * d + in_y * across * d, y + in_y * d + in_x * across * d);
    }
  }
  return left;
}

}  // namespace cordillera::pipeline
