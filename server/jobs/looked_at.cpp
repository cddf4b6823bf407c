#include "server/jobs/looked_at.h"

#include <algorithm>
#include <fstream>

namespace cordillera::server {
namespace {

constexpr std::size_t kMostTiles = 64;  // what a screen shows
constexpr auto kBetweenNotes = std::chrono::milliseconds(50);
constexpr auto kBetweenNotesOfAll = std::chrono::seconds(10);
constexpr auto kWantsAllFor = std::chrono::minutes(1);  // a client that was told to ask again has done so by then

/// All of it was asked for less than so long ago.
bool wants_all(const std::filesystem::path& folder, std::chrono::seconds ago = kWantsAllFor) {
  std::error_code missing;
  const auto asked = std::filesystem::last_write_time(folder / kAllWantedFile, missing);
  return !missing && decltype(asked)::clock::now() - asked < ago;
}

/// Those that the file says.
std::vector<proto::TileAddress> tiles_in(const std::filesystem::path& folder) {
  std::vector<proto::TileAddress> tiles;
  std::ifstream file(folder / kLookedAtFile);
  for (proto::TileAddress tile; tiles.size() < kMostTiles && file >> tile.z >> tile.x >> tile.y;) tiles.push_back(tile);
  return tiles;
}

}  // namespace

void LookedAt::note_all(const std::string& id) const {
  std::error_code ignored;
  if (wants_all(layout_.dataset(id), kBetweenNotesOfAll) || !std::filesystem::exists(layout_.provisional(id), ignored)) return;
  std::ofstream(layout_.dataset(id) / kAllWantedFile) << '\n';
}

bool LookedAt::all_wanted(const std::string& id) const { return wants_all(layout_.dataset(id)); }

void LookedAt::note(const std::string& id, const std::vector<proto::TileAddress>& asked, Tell tell) {
  std::error_code ignored;
  if (!std::filesystem::exists(layout_.provisional(id), ignored)) return;  // its build has ended meanwhile
  const std::filesystem::path folder = layout_.dataset(id), next = folder / (std::string(kLookedAtFile) + kBeingWritten);
  const std::lock_guard lock(mutex_);
  const auto [dataset, added] = datasets_.try_emplace(id);
  Tiles& tiles = dataset->second;
  if (added) {
    for (const proto::TileAddress& earlier : tiles_in(folder))
      tiles.last_first.push_back(earlier);  // of a service before this one
  }
  for (const proto::TileAddress& tile : asked) {
    std::erase(tiles.last_first, tile);
    tiles.last_first.push_front(tile);
    if (tiles.last_first.size() > kMostTiles) tiles.last_first.pop_back();
  }
  const auto now = Clock::now();
  if (tell == Tell::now_and_then && now - tiles.written < kBetweenNotes) return;  // the next one tells of this one, too
  tiles.written = now;
  {
    std::ofstream file(next);
    for (const auto& [z, x, y] : tiles.last_first) file << z << ' ' << x << ' ' << y << '\n';
    file.close();
    if (!file) return;  // a disk that is full, or a folder that is gone: what was told before stays
  }
  std::filesystem::rename(next, folder / kLookedAtFile, ignored);
}

bool LookedAt::any_of(const std::string& id, const std::function<bool(const proto::TileAddress&)>& is) const {
  const std::lock_guard lock(mutex_);
  const auto found = datasets_.find(id);
  return found != datasets_.end() && std::any_of(found->second.last_first.begin(), found->second.last_first.end(), is);
}

void LookedAt::forget(const std::string& id) {
  const std::lock_guard lock(mutex_);
  datasets_.erase(id);
}

std::vector<proto::TileAddress> read_looked_at(const std::filesystem::path& folder) {
  std::vector<proto::TileAddress> tiles = tiles_in(folder);
  if (wants_all(folder)) tiles.insert(tiles.end(), {{0, 0, 0}, {0, 1, 0}});
  return tiles;
}

}  // namespace cordillera::server
