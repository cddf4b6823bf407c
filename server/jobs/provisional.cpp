#include "server/jobs/provisional.h"

#include <algorithm>
#include <cmath>

#include "proto/lattice.h"

namespace cordillera::server {

void mark_provisional(Response& response) {
  std::erase_if(response.headers, [](const auto& header) { return header.first == "Cache-Control" || header.first == "ETag"; });
  response.set("Cache-Control", "no-store");
  response.set(kProvisionalHeader, "true");
}

std::optional<TouchedTiles> touched_by_bounds(const proto::Manifest& manifest, int level) {
  if (manifest.bounds_size() < 4) return std::nullopt;
  const double per_deg = proto::tiles_up(level) / 180.0;
  const auto first = [per_deg](double deg, std::int32_t count) { return std::clamp(static_cast<std::int32_t>(std::floor(deg * per_deg)), 0, count - 1); };
  const auto last = [per_deg](double deg, std::int32_t count) { return std::clamp(static_cast<std::int32_t>(std::ceil(deg * per_deg)) - 1, 0, count - 1); };
  const auto across = proto::tiles_across(level), up = proto::tiles_up(level);
  return TouchedTiles{first(manifest.bounds(0) + 180, across), first(manifest.bounds(1) + 90, up), last(manifest.bounds(2) + 180, across),
                      last(manifest.bounds(3) + 90, up)};
}

Json tiles_json(const proto::Manifest& manifest) {
  Json levels = Json::array();
  for (int level = static_cast<int>(manifest.min_level()); level <= static_cast<int>(manifest.max_level()); ++level) {
    const auto tiles = touched_by_bounds(manifest, level);
    if (tiles) levels.push_back({{"level", level}, {"x", {tiles->west, tiles->east}}, {"y", {tiles->south, tiles->north}}});
  }
  Json json;
  json["provisional"] = manifest.provisional();
  json["levels"] = std::move(levels);
  json["bounds"] = std::vector<double>(manifest.bounds().begin(), manifest.bounds().end());
  json["tiles"] = manifest.tiles();
  return json;
}

}  // namespace cordillera::server
