#pragma once
// The handles on a build's source: one a worker, for a handle is for one thread.
#include <atomic>
#include <condition_variable>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <mutex>
#include <optional>
#include <vector>

#include "proto/result.h"
#include "raster/source.h"

namespace cordillera::pipeline {

class WorkerSources {
 public:
  /// Opens one more handle; called once a worker, by one thread at a time.
  using Open = std::function<proto::Result<std::unique_ptr<raster::Source>>()>;

  WorkerSources() = default;
  ~WorkerSources() { closing_ = true; }
  WorkerSources(const WorkerSources&) = delete;
  WorkerSources& operator=(const WorkerSources&) = delete;

  /// The first at once: its problem. The others one after the other while it is read, for they take milliseconds each; and all of
  /// them now, for later the file may be another one.
  proto::Result<void> open(unsigned workers, const Open& open);
  /// The worker's, as soon as it is open; or why it is not.
  proto::Result<raster::Source*> of(unsigned worker);

 private:
  void add(proto::Result<std::unique_ptr<raster::Source>> source);

  std::atomic<bool> closing_{false};
  std::mutex mutex_;  ///< of what follows
  std::condition_variable changed_;
  std::vector<std::unique_ptr<raster::Source>> sources_;  ///< by worker; those of the last ones are still to come
  std::optional<proto::Problem> problem_;                 ///< why there are no more; or what was thrown:
  std::exception_ptr thrown_;
  std::future<void> opening_;  ///< the last: it uses what is before it
};

}  // namespace cordillera::pipeline
