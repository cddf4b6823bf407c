#pragma once
// Published datasets, kept open while they are being read.
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <list>
#include <memory>
#include <mutex>
#include <set>
#include <string>
#include <unordered_map>
#include <utility>

#include "pipeline/faces/terrain.h"
#include "pipeline/store/store_words.h"
#include "server/data/layout.h"
#include "server/datasets/mounts.h"
#include "server/metrics/service_metrics.h"

namespace cordillera::server {

/// Names the build: what stands below …/versions/{it}/ never changes. Another program may make other bytes of the same build.
std::string version_of(const proto::Manifest& manifest);

/// What is answered while it cannot be opened for want of descriptors.
proto::Problem wants_descriptor(const std::string& id);

/// What is answered where there is no such dataset.
proto::Problem unknown_dataset(const std::string& id);

/// What a list shows of a dataset.
struct Summary {
  proto::Manifest manifest;  ///< without what grows with the dataset: levels, sources, options
  std::string version;
};

struct LibraryBounds {
  /// Memory for what the faces of all open datasets decoded, made and read. Without a common bound, a client that walks through
  /// all datasets would take 112 MiB with each.
  std::size_t kept_bytes = std::size_t{480} << 20;  // and 32 MiB that the front keeps
  std::size_t open = 64;                            ///< datasets, a few descriptors each
};

/// Thread-safe. A reader that was handed out outlives forget().
class Library {
 public:
  using IsThere = std::function<bool(const std::string& id)>;
  Library(Layout layout, metrics::ServiceMetrics& metrics, Mounts& mounts, LibraryBounds bounds = {})
      : layout_(std::move(layout)), metrics_(metrics), mounts_(mounts), bounds_(bounds) {}
  proto::Result<std::shared_ptr<const pipeline::faces::Terrain>> open(const std::string& id);
  /// The provisional tiles of a dataset that is being built; null: there are none, not yet or no more.
  std::shared_ptr<const pipeline::faces::Terrain> provisional(const std::string& id);
  /// The final tiles of the finest level of a block that is not done; null: there are none, not yet or no more.
  std::shared_ptr<const pipeline::faces::Terrain> finest(const std::string& id, const proto::TileAddress& block);
  /// Remembered: a list of thousands must not open thousands of files.
  proto::Result<std::shared_ptr<const Summary>> summary(const std::string& id);
  /// Whether a dataset has not been deleted: one that is deleted loses its files while others read it, and is not damaged. Before
  /// the first use.
  void set_existence_check(IsThere is_there) { is_there_ = std::move(is_there); }
  /// What title and attribution a dataset has now. Before the first use; forget() after every change.
  using WordsOf = std::function<pipeline::Words(const std::string& id)>;
  void set_words(WordsOf words_of) { words_of_ = std::move(words_of); }
  /// What was read of a dataset is not what was written: the answer to whoever asked, told to the operator too. Of one that was
  /// deleted meanwhile: that there is none.
  proto::Problem damaged(const std::string& id, const std::string& why);
  /// Datasets of which something damaged was read since they were published or the service started.
  std::size_t damaged_count();
  /// How often something was forgotten: what was read of any dataset before is as it was.
  std::uint64_t changes() const { return forgotten_; }
  /// Before a dataset's files are removed, and after: who opened them in between is not kept.
  void forget(const std::string& id);

 private:
  proto::Problem unreadable(const std::string& id, const proto::Problem& why);
  using Open = std::list<std::pair<std::string, std::shared_ptr<const pipeline::faces::Terrain>>>;
  std::shared_ptr<const pipeline::faces::Terrain> find(const std::string& key);
  std::shared_ptr<const pipeline::faces::Terrain> unfinished(const std::string& id, const std::filesystem::path& file);
  proto::Result<std::shared_ptr<const pipeline::faces::Terrain>> open_file(const std::string& key,
                                                                           const std::filesystem::path& file,
                                                                           const std::string& id);
  pipeline::Words words(const std::string& id) const { return words_of_ ? words_of_(id) : pipeline::Words(); }
  Open too_much();

  Layout layout_;
  metrics::ServiceMetrics& metrics_;
  Mounts& mounts_;
  const LibraryBounds bounds_;
  IsThere is_there_;
  WordsOf words_of_;
  std::mutex mutex_;
  Open open_;  ///< the last used first; provisional ones under names that are no ids
  std::unordered_map<std::string, std::shared_ptr<const Summary>> summaries_;
  std::set<std::string> damaged_;
  std::atomic<std::uint64_t> forgotten_{0};  ///< how often; what was opened before may be gone
  std::uint64_t asked_ = 0;
};

}  // namespace cordillera::server
