#include "server/front/workers.h"

#include <system_error>
#include <utility>

namespace cordillera::server::front {

Workers::Taken Workers::run(const std::string& client, std::function<void()> work) {
  const std::lock_guard lock(mutex_);
  if (works_ >= most_) return Taken::full;
  Client& its = clients_[client];
  if (its.works >= most_per_client_) return Taken::client_has_many;
  if (idle_ <= waiting_ && threads_.size() < threads_most_) {
    try {
      threads_.emplace_back([this] { serve(); });
    } catch (const std::system_error&) {
      if (threads_.empty()) {  // nobody would ever come for it
        if (its.works == 0) clients_.erase(client);
        return Taken::full;
      }
    }
  }
  if (its.waiting.empty()) turns_.push_back(client);
  its.waiting.push_back(std::move(work));
  ++its.works;
  ++works_;
  ++waiting_;
  work_or_stop_.notify_one();
  return Taken::yes;
}

void Workers::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  work_or_stop_.notify_all();
  for (std::thread& thread : threads_) {
    if (thread.joinable()) thread.join();
  }
}

/// The first work of the client whose turn it is.
std::function<void()> Workers::next(std::string* client) {
  *client = std::move(turns_.front());
  turns_.pop_front();
  Client& its = clients_[*client];
  std::function<void()> work = std::move(its.waiting.front());
  its.waiting.pop_front();
  if (!its.waiting.empty()) turns_.push_back(*client);
  --waiting_;
  return work;
}

void Workers::serve() {
  std::unique_lock lock(mutex_);
  while (true) {
    ++idle_;
    work_or_stop_.wait(lock, [this] { return waiting_ > 0 || stopping_; });
    --idle_;
    if (waiting_ == 0) return;
    std::string client;
    std::function<void()> work = next(&client);
    lock.unlock();
    work();
    work = nullptr;  // what it holds goes without the lock
    lock.lock();
    --works_;
    if (const auto its = clients_.find(client); --its->second.works == 0) clients_.erase(its);
  }
}

}  // namespace cordillera::server::front
