#include "pipeline/threads/workers.h"
#include "proto/cores.h"

#include <exception>

namespace cordillera::pipeline {

struct Workers::Loop {
  const std::function<void(std::size_t, unsigned)>& work;
  std::size_t count;
  Haste haste;
  std::size_t next = 0, running = 0;
  std::exception_ptr first = nullptr;
  std::condition_variable ended = {};

  std::size_t left() const { return count - next; }
};

Workers::Workers(unsigned threads) {
  const unsigned count = proto::threads_for(threads);
  try {
    for (unsigned worker = 0; worker < count; ++worker) threads_.emplace_back([this, worker] { run(worker); });
  } catch (...) {  // the system has no thread more
    end();
    throw;
  }
}

Workers::~Workers() { end(); }

void Workers::end() {
  {
    const std::lock_guard lock(mutex_);
    ending_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

void Workers::each(std::size_t count, const std::function<void(std::size_t, unsigned)>& work, Haste haste) {
  if (count == 0) return;
  Loop loop{work, count, haste};
  std::unique_lock lock(mutex_);
  loops_.push_back(&loop);
  changed_.notify_all();
  loop.ended.wait(lock, [&] { return loop.left() == 0 && loop.running == 0; });
  std::erase(loops_, &loop);
  if (loop.first) std::rethrow_exception(loop.first);
}

void Workers::with_caller(std::size_t count, const std::function<void(std::size_t)>& work) {
  if (count == 0) return;
  const std::function<void(std::size_t, unsigned)> any = [&](std::size_t item, unsigned) { work(item); };
  if (threads() == 1) return each(count, any);  // one thread was asked for
  Loop loop{any, count, Haste::somebody_waits};
  std::unique_lock lock(mutex_);
  if (count > 1) {
    loops_.push_back(&loop);
    changed_.notify_all();
  }
  while (loop.left() > 0) do_one(loop, threads(), lock);
  loop.ended.wait(lock, [&] { return loop.running == 0; });
  std::erase(loops_, &loop);
  if (loop.first) std::rethrow_exception(loop.first);
}

void Workers::run(unsigned worker) {
  std::unique_lock lock(mutex_);
  while (true) {
    Loop* loop = nullptr;
    changed_.wait(lock, [&] { return (loop = next()) != nullptr || ending_; });
    if (loop == nullptr) return;
    do_one(*loop, worker, lock);
  }
}

Workers::Loop* Workers::next() {
  const auto before = [](const Loop& a, const Loop& b) {
    return a.haste != b.haste ? a.haste == Haste::somebody_waits : a.left() < b.left();
  };
  Loop* found = nullptr;
  for (Loop* loop : loops_) {
    if (loop->left() > 0 && (found == nullptr || before(*loop, *found))) found = loop;
  }
  return found;
}

void Workers::do_one(Loop& loop, unsigned worker, std::unique_lock<std::mutex>& lock) {
  const std::size_t item = loop.next++;
  ++loop.running;
  lock.unlock();
  std::exception_ptr thrown;
  try {
    loop.work(item, worker);
  } catch (...) { thrown = std::current_exception(); }
  lock.lock();
  --loop.running;
  if (thrown) {
    loop.next = loop.count;  // no new work after a failure
    if (!loop.first) loop.first = thrown;
  }
  if (loop.left() == 0 && loop.running == 0) loop.ended.notify_one();
}

}  // namespace cordillera::pipeline
