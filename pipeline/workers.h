#pragma once
// The threads of a build: one pool (Boost.Asio), one loop over independent pieces of work.
#include <atomic>
#include <functional>
#include <memory>

namespace cordillera::pipeline {

class Workers {
 public:
  explicit Workers(unsigned threads);  ///< 0: as many as the machine has
  ~Workers();
  unsigned threads() const { return threads_; }

  /// Calls work(item, worker) for every item in 0..count-1, worker in 0..threads()-1 (two calls of one worker never overlap).
  /// Returns when all are done. The first exception is thrown again here, after the others have ended.
  void each(std::size_t count, const std::function<void(std::size_t item, unsigned worker)>& work);

 private:
  struct Pool;
  unsigned threads_;
  std::unique_ptr<Pool> pool_;
};

}  // namespace cordillera::pipeline
