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
    if (other == client->second)
      earlier = false;
    else
      place += std::min(waiting_.at(other).size(), before + (earlier ? 1 : 0));
  }
  return place;
}

/// With the lock. It takes no memory: who waits would wait for good.
void DryTurns::let_begin() {
  while (free_ > 0) {
    const auto turn = waiting_.next();
    if (!turn) return;
    const auto place = places_.find(turn->id);
    if (place == places_.end()) continue;  // it waits no longer
    place->second = true;
    --free_;
    changed_.notify_all();
  }
}

void DryTurns::end(const std::string& id) {
  const std::lock_guard lock(mutex_);
  const auto place = places_.find(id);
  if (place == places_.end()) return;  // there was no memory for it
  if (place->second) ++free_;
  places_.erase(place);
  let_begin();
}

std::shared_ptr<void> DryTurns::take(const std::string& id, const std::string& client) {
  const std::shared_ptr<void> turn(this, [this, id](void*) { end(id); });  // before the lock, which its end takes
  std::unique_lock lock(mutex_);
  const bool& begun = places_.emplace(id, false).first->second;
  waiting_.add({id, client, 0});
  let_begin();
  changed_.wait(lock, [&] { return stopping_ || begun; });
  return begun ? turn : nullptr;
}

std::size_t DryTurns::waiting() const {
  const std::lock_guard lock(mutex_);
  return static_cast<std::size_t>(std::count_if(places_.begin(), places_.end(), [](const auto& place) { return !place.second; }));
}

void DryTurns::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
}

}  // namespace cordillera::server
