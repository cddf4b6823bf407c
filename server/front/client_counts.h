#pragma once
// How much each client has of something.
#include <cstddef>
#include <map>
#include <memory>
#include <mutex>
#include <string>

namespace cordillera::server::front {

/// Thread-safe. Must outlive what it gives.
class ClientCounts {
 public:
  using Share = std::shared_ptr<void>;

  /// One more, until the share goes. Null: the client has its most.
  Share take(const std::string& client, std::size_t most) {
    const std::lock_guard lock(mutex_);
    std::size_t& count = counts_[client];
    if (count >= most) return nullptr;
    ++count;
    ++all_;
    return {this, [client](void* counts) { static_cast<ClientCounts*>(counts)->give_back(client); }};
  }
  std::size_t all() const {
    const std::lock_guard lock(mutex_);
    return all_;
  }

 private:
  void give_back(const std::string& client) {
    const std::lock_guard lock(mutex_);
    --all_;
    if (const auto its = counts_.find(client); --its->second == 0) counts_.erase(its);
  }

  mutable std::mutex mutex_;
  std::map<std::string, std::size_t> counts_;
  std::size_t all_ = 0;
};

}  // namespace cordillera::server::front
