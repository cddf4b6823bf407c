#include "server/jobs/looked_at.h"

#include <algorithm>
#include <fstream>

namespace cordillera::server {
namespace {

constexpr const char* kNotesFile = "looked-at";
constexpr std::size_t kMostTiles = 64;  // what a screen shows
constexpr auto kBetweenNotes = std::chrono::milliseconds(50);

}  // namespace

void LookedAt::note(const std::string& id, const proto::TileAddress& tile) {
  std::error_code ignored;
  if (!std::filesystem::exists(layout_.provisional(id), ignored)) return;  // its build has ended meanwhile
  const std::lock_guard lock(mutex_);
  Tiles& tiles = datasets_[id];
  std::erase(tiles.last_first, tile);
  tiles.last_first.push_front(tile);
  if (tiles.last_first.size() > kMostTiles) tiles.last_first.pop_back();
  const auto now = Clock::now();
  if (now - tiles.written < kBetweenNotes) return;  // the next one tells of this one, too
  tiles.written = now;
  const std::filesystem::path folder = layout_.dataset(id), next = folder / (std::string(kNotesFile) + "-next");
  {
    std::ofstream file(next);
    for (const auto& [z, x, y] : tiles.last_first) file << z << ' ' << x << ' ' << y << '\n';
  }
  // A disk that is full, or a folder that is gone: then blocks are made in their own order.
  std::filesystem::rename(next, folder / kNotesFile, ignored);
}

void LookedAt::forget(const std::string& id) {
  const std::lock_guard lock(mutex_);
  datasets_.erase(id);
}

std::vector<proto::TileAddress> read_looked_at(const std::filesystem::path& folder) {
  std::vector<proto::TileAddress> tiles;
  std::ifstream file(folder / kNotesFile);
  for (proto::TileAddress tile; tiles.size() < kMostTiles && file >> tile.z >> tile.x >> tile.y;) tiles.push_back(tile);
  return tiles;
}

}  // namespace cordillera::server
