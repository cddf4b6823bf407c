#pragma once
// Published datasets, kept open while they are being read.
#include <cstddef>
#include <cstdint>
#include <list>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>

#include "pipeline/faces/terrain.h"
#include "server/layout.h"
#include "server/metrics/service_metrics.h"
#include "server/mounts.h"

namespace cordillera::server {

/// Names the build: what stands below …/versions/{it}/ never changes. Another program may make other bytes of the same build.
std::string version_of(const proto::Manifest& manifest);

/// What a list shows of a dataset.
struct Summary {
  proto::Manifest manifest;  ///< without what grows with the dataset: levels, sources, options
  std::string version;
};

/// Thread-safe. A reader that was handed out outlives forget().
class Library {
 public:
  /// most_kept_bytes: of what the faces of all open datasets decoded and made.
  Library(Layout layout, metrics::ServiceMetrics& metrics, Mounts& mounts, std::size_t most_kept_bytes = kMostKept_bytes)
      : layout_(std::move(layout)), metrics_(metrics), mounts_(mounts), most_kept_bytes_(most_kept_bytes) {}
  proto::Result<std::shared_ptr<const pipeline::faces::Terrain>> open(const std::string& id);
  /// Remembered: a list of thousands must not open thousands of files.
  proto::Result<std::shared_ptr<const Summary>> summary(const std::string& id);
  /// What was read of a dataset is not what was written: the answer to whoever asked, told to the operator too.
  proto::Problem damaged(const std::string& id, const std::string& why);
  /// Datasets of which something damaged was read since they were published or the service started.
  std::size_t damaged_count();
  /// Before a dataset's files are removed, and after: who opened them in between is not kept.
  void forget(const std::string& id);

 private:
  // Else who walks through all datasets would take 80 MiB with each.
  static constexpr std::size_t kMostKept_bytes = std::size_t{512} << 20;
  proto::Problem unreadable(const std::string& id, const proto::Problem& why);
  using Open = std::list<std::pair<std::string, std::shared_ptr<const pipeline::faces::Terrain>>>;
  std::shared_ptr<const pipeline::faces::Terrain> find(const std::string& id);
  Open too_much();

  Layout layout_;
  metrics::ServiceMetrics& metrics_;
  Mounts& mounts_;
  const std::size_t most_kept_bytes_;
  std::mutex mutex_;
  Open open_;  ///< the last used first
  std::unordered_map<std::string, std::shared_ptr<const Summary>> summaries_;
  std::set<std::string> damaged_;
  std::uint64_t forgotten_ = 0;  ///< how often; what was opened before may be gone
  std::uint64_t asked_ = 0;
};

}  // namespace cordillera::server
