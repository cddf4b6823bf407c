#pragma once
// Builds, a bounded number at a time, first come first served. The registry remembers what is unfinished over a restart.
#include <atomic>
#include <boost/asio/thread_pool.hpp>
#include <condition_variable>
#include <map>
#include <memory>
#include <mutex>
#include <string>

#include "server/child.h"
#include "server/layout.h"
#include "server/progress_hub.h"
#include "server/registry.h"

namespace cordillera::server {

class JobQueue {
 public:
  JobQueue(Layout layout, Registry& registry, ProgressHub& hub, JobRunner runner, unsigned concurrency);
  ~JobQueue();

  /// Queues again whatever a former process left unfinished, oldest first.
  void resume();
  void enqueue(const std::string& id);
  /// Ends a running build and returns when it has ended. Remove the dataset from the registry first: then it can't start any
  /// more.
  void cancel(const std::string& id);
  /// What a build of the raster in this folder would make; waits for its turn beside the builds.
  proto::Result<proto::Estimate> dry_run(const std::filesystem::path& folder, const proto::Job& job);
  /// Ends running builds; their datasets stay unfinished in the registry.
  void stop();

 private:
  void run(const std::string& id);
  void finish(const Dataset& dataset, const proto::Result<std::optional<proto::Estimate>>& outcome);
  proto::Result<std::optional<proto::Estimate>> build(const Dataset& dataset, const std::atomic<bool>& stop);

  Layout layout_;
  Registry& registry_;
  ProgressHub& hub_;
  JobRunner runner_;
  std::mutex mutex_;
  std::condition_variable ended_;
  std::map<std::string, std::shared_ptr<std::atomic<bool>>> running_;  ///< id -> its stop flag
  std::atomic<bool> stopping_{false};
  unsigned dry_runs_free_;
  boost::asio::thread_pool pool_;  ///< last: its threads use the rest
};

}  // namespace cordillera::server
