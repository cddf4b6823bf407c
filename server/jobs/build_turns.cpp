#include "server/jobs/build_turns.h"

#include <algorithm>
#include <utility>

namespace cordillera::server {

bool BuildTurns::add(Entry entry) {
  const std::lock_guard lock(mutex_);
  if (!clients_.emplace(entry.id, entry.client).second) return false;
  auto& own = waiting_[entry.client];
  if (own.empty()) turns_.push_back(entry.client);
  own.push_back(std::move(entry));
  return true;
}

std::optional<BuildTurns::Entry> BuildTurns::next() {
  const std::lock_guard lock(mutex_);
  if (turns_.empty()) return std::nullopt;
  const auto own = waiting_.find(turns_.front());
  Entry entry = std::move(own->second.front());
  own->second.pop_front();
  clients_.erase(entry.id);
  turns_.splice(turns_.end(), turns_, turns_.begin());
  if (own->second.empty()) {
    waiting_.erase(own);
    turns_.pop_back();
  }
  return entry;
}

std::optional<std::size_t> BuildTurns::place(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto client = clients_.find(id);
  if (client == clients_.end()) return std::nullopt;
  const auto& own = waiting_.at(client->second);
  const auto entry = std::find_if(own.begin(), own.end(), [&](const Entry& one) { return one.id == id; });
  const auto before = static_cast<std::size_t>(entry - own.begin());
  std::size_t place = before + 1;
  bool earlier = true;  // clients whose turn comes first have one more
  for (const std::string& other : turns_) {
    if (other == client->second) earlier = false;
    else place += std::min(waiting_.at(other).size(), before + (earlier ? 1 : 0));
  }
  return place;
}

}  // namespace cordillera::server
