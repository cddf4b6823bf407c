#include "server/jobs/looked_at.h"

#include <algorithm>
#include <fstream>

namespace cordillera::server {
namespace {

constexpr const char* kNotesFile = "looked-at";
constexpr std::size_t kMostTiles = 64;  // what a screen shows

}  // namespace

void LookedAt::note(const std::string& id, const proto::TileAddress& tile) {
  std::error_code ignored;
  if (!std::filesystem::exists(layout_.provisional(id), ignored)) return;  // its build has ended meanwhile
  const std::lock_guard lock(mutex_);
  std::deque<proto::TileAddress>& tiles = datasets_[id];
  if (!tiles.empty() && tiles.front() == tile) return;
  std::erase(tiles, tile);
  tiles.push_front(tile);
  if (tiles.size() > kMostTiles) tiles.pop_back();
  const std::filesystem::path folder = layout_.dataset(id), next = folder / (std::string(kNotesFile) + "-next");
  {
    std::ofstream file(next);
    for (const auto& [z, x, y] : tiles) file << z << ' ' << x << ' ' << y << '\n';
  }
  // A disk that is full, or a folder that is gone: then blocks are made in their own order.
  std::filesystem::rename(next, folder / kNotesFile, ignored);
}

bool LookedAt::any_of(const std::string& id, const std::function<bool(const proto::TileAddress&)>& is) const {
  const std::lock_guard lock(mutex_);
  const auto found = datasets_.find(id);
  return found != datasets_.end() && std::any_of(found->second.begin(), found->second.end(), is);
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
