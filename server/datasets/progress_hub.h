#pragma once
// The last progress of every job, and a way to wait for the next: event streams and Prefer: wait hang here.
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <optional>
#include <string>

#include "cordillera.pb.h"

namespace cordillera::server {

/// Thread-safe.
class ProgressHub {
 public:
  struct Snapshot {
    std::uint64_t version = 0;  ///< grows with every change of this dataset; 0: nothing was ever said
    std::optional<proto::Progress> progress;
    double share = 0;  ///< of all stages together, 0 to 1; never less than before, also where a stage is done again
  };

  void publish(const std::string& id, const proto::Progress& progress);
  /// The job is over: the next one of this dataset begins at 0. Tells as touch() does.
  void ended(const std::string& id);
  /// The dataset's state changed: wakes whoever waits for it.
  void touch(const std::string& id);
  void forget(const std::string& id);

  Snapshot now(const std::string& id) const;
  /// Returns when the version is another than `seen`, the time is over or the hub is closed.
  Snapshot wait(const std::string& id, std::uint64_t seen, std::chrono::milliseconds longest) const;

  /// Called after every change and when the hub closes, on the thread that makes it: must be quick and not come back here. One at
  /// a time; null: none. Once this returns, the one before is not called any more.
  void listen(std::function<void()> listener);

  /// No one waits any more.
  void close();
  bool closed() const;

 private:
  Snapshot snapshot(const std::string& id) const;
  void tell();

  mutable std::mutex mutex_;
  mutable std::condition_variable changed_;
  std::map<std::string, Snapshot> last_;
  std::uint64_t clock_ = 0;
  bool closed_ = false;
  std::mutex listener_mutex_;
  std::function<void()> listener_;
};

}  // namespace cordillera::server
