#pragma once
// The last progress of every job, and who is told of the next: event streams and Prefer: wait hang here.
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
  /// The dataset's state changed.
  void touch(const std::string& id);
  void forget(const std::string& id);

  Snapshot now(const std::string& id) const;

  /// Called after every change and when the hub closes, on the thread that makes it: must be quick and not come back here. One at
  /// a time; null: none. Once this returns, the one before is not called any more.
  void listen(std::function<void()> listener);

  /// No one waits any more.
  void close();
  bool closed() const;

 private:
  void tell();

  mutable std::mutex mutex_;
  std::map<std::string, Snapshot> last_;
  std::uint64_t clock_ = 0;
  bool closed_ = false;
  std::mutex listener_mutex_;
  std::function<void()> listener_;
};

}  // namespace cordillera::server
