#pragma once
// Everything the API works on, opened together.
#include <memory>
#include <set>
#include <string>

#include "server/job_queue.h"
#include "server/library.h"
#include "server/options.h"
#include "server/progress_hub.h"
#include "server/registry.h"

namespace cordillera::server {

/// Holds something until it goes out of scope.
using Token = std::shared_ptr<void>;

class Service {
 public:
  /// Creates the data folder, locks it (two servers on one folder would ruin each other's work), removes what a former process
  /// left half-made and queues its unfinished builds again.
  static proto::Result<std::unique_ptr<Service>> open(const Settings& settings, JobRunner runner);
  ~Service();

  const Settings& settings() const { return settings_; }
  const Layout& layout() const { return layout_; }
  Registry& registry() { return *registry_; }
  ProgressHub& hub() { return hub_; }
  JobQueue& queue() { return *queue_; }
  Library& library() { return library_; }

  /// Refuses when too many clients wait already (event streams, Prefer: wait): threads must be left for the others.
  Token wait_token();
  /// Refuses while another request with the same key is under way.
  Token key_token(const std::string& idempotency_key);

  bool stopping() const { return hub_.closed(); }
  void stop();

 private:
  Service(const Settings& settings, int lock);

  Settings settings_;
  Layout layout_;
  int lock_;
  std::unique_ptr<Registry> registry_;
  ProgressHub hub_;
  Library library_;
  std::unique_ptr<JobQueue> queue_;
  std::mutex mutex_;
  int waiting_ = 0;
  std::set<std::string> keys_;
};

/// Connections that are served at the same time, a thread each, and how many of them may wait for progress.
inline constexpr int kMostConnections = 1024;
inline constexpr int kMostWaiting = 512;

}  // namespace cordillera::server
