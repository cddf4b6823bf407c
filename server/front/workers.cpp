#include "server/front/workers.h"

#include <system_error>
#include <utility>

#include "server/memory/heap.h"

namespace cordillera::server::front {

Workers::Workers(std::size_t threads, std::size_t most, std::size_t most_per_client)
    : threads_most_(threads), most_(most), most_per_client_(most_per_client) {
  threads_.emplace_back([this] { serve(); });
}

Workers::Taken Workers::run(const std::string& client, std::function<void()> work) {
  const std::lock_guard lock(mutex_);
  if (works_ >= most_) return Taken::full;
  const auto place = clients_.try_emplace(client).first;
  Client& its = place->second;
  if (its.works >= most_per_client_) return Taken::client_has_many;
  if (idle_ <= waiting_ && threads_.size() < threads_most_ && has_memory_for_a_thread()) {
    try {
      threads_.emplace_back([this] { serve(); });
    } catch (const std::system_error&) {
      // The system has none more: those that there are do it.
    }
  }
  its.waiting.push_back(std::move(work));
  if (its.waiting.size() == 1) {
    try {
      turns_.push_back(place);
    } catch (...) {  // what nobody's turn is would wait for ever
      its.waiting.pop_back();
      throw;
    }
  }
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

/// The first work of the client whose turn it is. Takes no memory: there may be none.
std::function<void()> Workers::next(Clients::iterator its) {
  std::function<void()> work = std::move(its->second.waiting.front());
  its->second.waiting.pop_front();
  if (its->second.waiting.empty())
    turns_.pop_front();
  else
    turns_.splice(turns_.end(), turns_, turns_.begin());
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
    const auto its = turns_.front();
    std::function<void()> work = next(its);
    lock.unlock();
    work();
    work = nullptr;  // what it holds goes without the lock
    lock.lock();
    --works_;
    if (--its->second.works == 0) clients_.erase(its);
  }
}

}  // namespace cordillera::server::front
