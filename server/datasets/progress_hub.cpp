#include "server/datasets/progress_hub.h"

#include <algorithm>

#include "server/datasets/whole_share.h"

namespace cordillera::server {

void ProgressHub::tell() {
  const std::lock_guard lock(listener_mutex_);
  if (listener_) listener_();
}

void ProgressHub::listen(std::function<void()> listener) {
  const std::lock_guard lock(listener_mutex_);
  listener_ = std::move(listener);
}

void ProgressHub::publish(const std::string& id, const proto::Progress& progress) {
  {
    const std::lock_guard lock(mutex_);
    const double before = last_[id].share;
    last_[id] = {++clock_, progress, std::max(before, whole_share(progress))};
  }
  tell();
}

void ProgressHub::touch(const std::string& id) {
  {
    const std::lock_guard lock(mutex_);
    last_[id].version = ++clock_;
  }
  tell();
}

void ProgressHub::ended(const std::string& id) {
  {
    const std::lock_guard lock(mutex_);
    last_[id] = {++clock_, std::nullopt, 0};
  }
  tell();
}

void ProgressHub::forget(const std::string& id) {
  {
    const std::lock_guard lock(mutex_);
    last_.erase(id);
  }
  tell();
}

ProgressHub::Snapshot ProgressHub::now(const std::string& id) const {
  const std::lock_guard lock(mutex_);
  const auto found = last_.find(id);
  return found == last_.end() ? Snapshot{} : found->second;
}

void ProgressHub::close() {
  {
    const std::lock_guard lock(mutex_);
    closed_ = true;
  }
  tell();
}

bool ProgressHub::closed() const {
  const std::lock_guard lock(mutex_);
  return closed_;
}

}  // namespace cordillera::server
