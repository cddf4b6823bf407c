#pragma once
// Where people look while a dataset is being built: its job makes the blocks there first. A hint: nothing depends on it but the
// order.
#include <chrono>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <vector>

#include "proto/lattice.h"
#include "server/data/layout.h"

namespace cordillera::server {

/// The server's side: tiles that were asked for lately, told to each dataset's job by a file in its folder. Thread-safe.
class LookedAt {
 public:
  explicit LookedAt(Layout layout) : layout_(std::move(layout)) {}
  enum class Tell { now, now_and_then };
  /// Tiles of the lattice were asked for, and the dataset is being built. now_and_then: another look may have to tell of them.
  void note(const std::string& id, const std::vector<proto::TileAddress>& asked, Tell tell);
  /// Something that is made of all of the dataset was asked for.
  void note_all(const std::string& id) const;
  bool all_wanted(const std::string& id) const;
  /// Whether `is` says yes to one of the tiles that were asked for lately.
  bool any_of(const std::string& id, const std::function<bool(const proto::TileAddress&)>& is) const;
  void forget(const std::string& id);

 private:
  using Clock = std::chrono::steady_clock;
  struct Tiles {
    std::deque<proto::TileAddress> last_first;
    Clock::time_point written{};
  };
  const Layout layout_;
  mutable std::mutex mutex_;
  std::map<std::string, Tiles> datasets_;  ///< that are being built
};

/// The job's side: what the file in its folder says, the last first; nothing where there is none. Behind them, if all of the
/// dataset was asked for in the last minute, both tiles of level 0.
std::vector<proto::TileAddress> read_looked_at(const std::filesystem::path& folder);

}  // namespace cordillera::server
