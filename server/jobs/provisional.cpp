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
  const auto first = [per_deg](double deg, std::int32_t count) {
    return std::clamp(static_cast<std::int32_t>(std::floor(deg * per_deg)), 0, count - 1);
  };
  const auto last = [per_deg](double deg, std::int32_t count) {
    return std::clamp(static_cast<std::int32_t>(std::ceil(deg * per_deg)) - 1, 0, count - 1);
  };
  const auto across = proto::tiles_across(level), up = proto::tiles_up(level);
  return TouchedTiles{first(manifest.bounds(0) + 180, across), first(manifest.bounds(1) + 90, up),
                      last(manifest.bounds(2) + 180, across), last(manifest.bounds(3) + 90, up)};
}

bool is_in_done_block(const proto::Manifest& shown, const proto::TileAddress& tile) {
  const proto::DoneBlocks& done = shown.done_blocks();
  const int level = static_cast<int>(done.level());
  if (!shown.has_done_blocks() || tile.z < level) return false;
  const proto::TileAddress block = tile.at_level(level);
  for (int k = 0; k < std::min(done.x_size(), done.y_size()); ++k) {
    if (static_cast<std::int32_t>(done.x(k)) == block.x && static_cast<std::int32_t>(done.y(k)) == block.y) return true;
  }
  return false;
}

bool waits_for_block(const proto::Manifest& shown, const proto::TileAddress& tile) {
  if (!shown.has_done_blocks()) return true;  // nobody knows yet where blocks lie
  const int level = static_cast<int>(shown.done_blocks().level());
  const auto touched = touched_by_bounds(shown, level);
  if (tile.z < level || !touched) return false;
  const proto::TileAddress block = tile.at_level(level);
  const bool west_of = block.x<touched->west, east_of = block.x> touched->east;
  const bool beside = touched->west <= touched->east ? west_of || east_of : west_of && east_of;  // these cross the antimeridian
  if (beside || block.y < touched->south || block.y > touched->north) return false;
  return !is_in_done_block(shown, tile);
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
