#pragma once
// Everything the API works on, opened together.
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <set>
#include <string>
#include <thread>

#include "server/access/audit.h"
#include "server/access/gate.h"
#include "server/data/folder_lock.h"
#include "server/datasets/archive.h"
#include "server/datasets/ledger.h"
#include "server/datasets/library.h"
#include "server/datasets/list_texts.h"
#include "server/datasets/mounts.h"
#include "server/datasets/progress_hub.h"
#include "server/datasets/registry.h"
#include "server/http/web_files.h"
#include "server/jobs/job_queue.h"
#include "server/limits/admission.h"
#include "server/metrics/service_metrics.h"
#include "server/options/options.h"
#include "server/service/archive_files.h"
#include "server/service/live_cache.h"
#include "server/uploads/part_files.h"

namespace cordillera::server {

/// Holds something until it goes out of scope.
using Token = std::shared_ptr<void>;

/// What clients hold of the HTTP front.
struct FrontCounts {
  std::size_t connections = 0;
  std::size_t unsent_bytes = 0;  ///< of large answers
};

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
  Mounts& mounts() { return mounts_; }
  /// A dataset of the registry, or a mounted one.
  Row find(const std::string& id) const;
  const access::Gate& gate() const { return *gate_; }
  access::Audit& audit() { return *audit_; }
  WebFiles& web_files() { return web_files_; }
  updates::Ledger& ledger() { return ledger_; }
  updates::Archive& archive() { return archive_; }
  uploads::PartFiles& uploads() { return uploads_; }
  limits::Admission& admission() { return *admission_; }
  metrics::ServiceMetrics& metrics() { return metrics_; }
  LiveCache& live() { return *live_; }

  ListTexts& list_texts() { return list_texts_; }
  ArchiveFiles& archive_files() { return *archive_files_; }

  /// A dataset has another version or other words, or has gone: what was opened, told or made of it before is not used any more.
  /// Who waits for it is told by the hub, and not here.
  void forget(const std::string& id);

  /// Refuses when too many wait for the same already. progress: event streams, and posts with Prefer: wait.
  enum class WaitsFor : std::uint8_t { progress, tiles };
  Token wait_token(WaitsFor what = WaitsFor::progress);
  int waiting(WaitsFor what = WaitsFor::progress) const;
  /// Refuses while another request of this owner with the same key is under way.
  Token key_token(const std::string& owner, const std::string& idempotency_key);

  /// Sets who knows what the clients hold.
  void watch_front(std::function<FrontCounts()> front) { front_ = std::move(front); }
  FrontCounts front() const { return front_ ? front_() : FrontCounts{}; }

  bool stopping() const { return hub_.closed(); }
  void stop();

 private:
  Service(const Settings& settings, std::unique_ptr<FolderLock> lock);
  /// All that works by itself, once data and access are in order.
  void begin_work(JobRunner runner);
  void read_ahead();

  Settings settings_;
  Layout layout_;
  std::unique_ptr<FolderLock> lock_;
  std::unique_ptr<Registry> registry_;
  metrics::ServiceMetrics metrics_;
  std::unique_ptr<access::Gate> gate_;
  std::unique_ptr<access::Audit> audit_;
  std::unique_ptr<limits::Admission> admission_;
  ProgressHub hub_;
  Mounts mounts_;
  Library library_;
  WebFiles web_files_;
  uploads::PartFiles uploads_;
  updates::Ledger ledger_;
  updates::Archive archive_;
  std::unique_ptr<ArchiveFiles> archive_files_;
  std::unique_ptr<JobQueue> queue_;
  std::unique_ptr<LiveCache> live_;
  std::atomic<LiveCache*> told_{nullptr};  ///< the same while it is told of builds
  ListTexts list_texts_;
  std::thread reading_ahead_;
  std::function<FrontCounts()> front_;  ///< set before the first request
  mutable std::mutex mutex_;
  std::array<int, 2> waiting_{};                        ///< by WaitsFor
  std::set<std::pair<std::string, std::string>> keys_;  ///< with their owners
};

/// Clients that may wait for progress at the same time, and requests that may wait for tiles.
inline constexpr int kMostWaiting = 512, kMostWaitingForTiles = 512;

}  // namespace cordillera::server
