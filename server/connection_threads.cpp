#include "server/connection_threads.h"

#include <chrono>
#include <system_error>
#include <thread>
#include <utility>

namespace cordillera::server {
namespace {
constexpr std::chrono::seconds kIdle{20};
}

void ConnectionThreads::run(std::function<void()> work) {
  const std::lock_guard lock(mutex_);
  waiting_.push_back(std::move(work));
  if (idle_ >= waiting_.size()) return work_or_stop_.notify_one();
  if (threads_ >= most_) return;
  try {
    std::thread([this] { serve(); }).detach();
    ++threads_;
  } catch (const std::system_error&) {
    if (threads_ == 0) throw;  // nobody would ever come for it
  }
}

void ConnectionThreads::stop() {
  std::unique_lock lock(mutex_);
  stopping_ = true;
  work_or_stop_.notify_all();
  all_ended_.wait(lock, [this] { return threads_ == 0; });
}

void ConnectionThreads::serve() {
  std::unique_lock lock(mutex_);
  while (true) {
    ++idle_;
    const bool woken = work_or_stop_.wait_for(lock, kIdle, [this] { return !waiting_.empty() || stopping_; });
    --idle_;
    if (!woken || waiting_.empty()) break;
    const std::function<void()> work = std::move(waiting_.front());
    waiting_.pop_front();
    lock.unlock();
    work();
    lock.lock();
  }
  --threads_;
  if (threads_ == 0) all_ended_.notify_all();
}

}  // namespace cordillera::server
