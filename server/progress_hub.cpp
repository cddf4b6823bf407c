#include "server/progress_hub.h"

namespace cordillera::server {

void ProgressHub::publish(const std::string& id, const proto::Progress& progress) {
  {
    const std::lock_guard lock(mutex_);
    last_[id] = {++clock_, progress};
  }
  changed_.notify_all();
}

void ProgressHub::touch(const std::string& id) {
  {
    const std::lock_guard lock(mutex_);
    last_[id].version = ++clock_;
  }
  changed_.notify_all();
}

void ProgressHub::forget(const std::string& id) {
  {
    const std::lock_guard lock(mutex_);
    last_.erase(id);
  }
  changed_.notify_all();
}

ProgressHub::Snapshot ProgressHub::snapshot(const std::string& id) const {
  const auto found = last_.find(id);
  return found == last_.end() ? Snapshot{} : found->second;
}

ProgressHub::Snapshot ProgressHub::now(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  return snapshot(id);
}

ProgressHub::Snapshot ProgressHub::wait(const std::string& id, std::uint64_t seen, std::chrono::milliseconds longest) const {
  std::unique_lock lock(mutex_);
  changed_.wait_for(lock, longest, [&] { return closed_ || snapshot(id).version != seen; });
  return snapshot(id);
}

void ProgressHub::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  changed_.notify_all();
}

bool ProgressHub::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

}  // namespace cordillera::server
