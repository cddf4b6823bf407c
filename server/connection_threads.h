#pragma once
// A thread a connection, as many as there are connections, up to a bound.
#include <condition_variable>
#include <cstddef>
#include <deque>
#include <functional>
#include <mutex>

namespace cordillera::server {

/// Work that may take as long as a client keeps its connection open. A thread is started when none is idle, and ends after a while without
/// work: two hundred open connections of map clients must not wait for one another, and a quiet server is to be small.
class ConnectionThreads {
 public:
  explicit ConnectionThreads(std::size_t most) : most_(most) {}
  /// stop() must have been called, unless nothing was ever run.
  ~ConnectionThreads() = default;
  ConnectionThreads(const ConnectionThreads&) = delete;

  /// Work beyond the bound waits for a thread.
  void run(std::function<void()> work);
  /// What was given is done first; nothing may be given afterwards.
  void stop();

 private:
  void serve();

  std::mutex mutex_;
  std::condition_variable work_or_stop_, all_ended_;
  std::deque<std::function<void()>> waiting_;
  std::size_t most_, threads_ = 0, idle_ = 0;
  bool stopping_ = false;
};

}  // namespace cordillera::server
