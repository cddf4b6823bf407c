#include "pipeline/workers.h"

#include <boost/asio/post.hpp>
#include <boost/asio/thread_pool.hpp>
#include <algorithm>
#include <exception>
#include <latch>
#include <mutex>
#include <thread>

namespace cordillera::pipeline {

struct Workers::Pool {
  explicit Pool(unsigned count) : threads(count) {}
  boost::asio::thread_pool threads;
};

Workers::Workers(unsigned threads)
    : threads_(threads ? threads : std::max(1u, std::thread::hardware_concurrency())), pool_(std::make_unique<Pool>(threads_)) {}

Workers::~Workers() { pool_->threads.join(); }

void Workers::each(std::size_t count, const std::function<void(std::size_t, unsigned)>& work) {
  const auto hands = static_cast<unsigned>(std::min<std::size_t>(count, threads_));
  std::atomic<std::size_t> next{0};
  std::latch done(hands);
  std::mutex mutex;
  std::exception_ptr first;
  for (unsigned worker = 0; worker < hands; ++worker) {
    boost::asio::post(pool_->threads, [&, worker] {
      try {
        for (std::size_t item = next++; item < count; item = next++) work(item, worker);
      } catch (...) {
        next = count;  // no new work after a failure
        const std::lock_guard lock(mutex);
        if (!first) first = std::current_exception();
      }
      done.count_down();
    });
  }
  done.wait();
  if (first) std::rethrow_exception(first);
}

}  // namespace cordillera::pipeline
