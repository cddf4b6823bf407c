#include "server/jobs/build_turns.h"

#include <utility>

namespace cordillera::server {

bool BuildTurns::add(Entry entry) {
  const std::lock_guard lock(mutex_);
  if (!ids_.insert(entry.id).second) return false;
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
  ids_.erase(entry.id);
  turns_.splice(turns_.end(), turns_, turns_.begin());
  if (own->second.empty()) {
    waiting_.erase(own);
    turns_.pop_back();
  }
  return entry;
}

}  // namespace cordillera::server
