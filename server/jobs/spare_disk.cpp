#include "server/jobs/spare_disk.h"

#include <map>
#include <memory>
#include <mutex>

#include "pipeline/store/mesh_files.h"
#include "proto/files.h"
#include "server/datasets/ledger.h"
#include "server/http/json.h"
#include "server/limits/disk.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

constexpr int kMostRefused = 12;  // an hour, once tries are as rare as they get

/// Jobs that found no room, by folder. Thread-safe.
class Starved {
 public:
  explicit Starved(std::uint32_t free_percent) : free_percent_(free_percent) {}

  std::uint64_t room(const fs::path& folder) const {
    const auto disk = limits::disk_space(folder);
    return disk ? limits::room(*disk, free_percent_) : 0;
  }
  /// The problem again, where it would have no more room than it had. Not for ever: what it had may have been others' in part.
  std::optional<proto::Problem> refuse(const fs::path& folder, std::uint64_t room) {
    const std::lock_guard lock(mutex_);
    const auto found = tries_.find(folder);
    if (found == tries_.end() || room > found->second.had || ++found->second.refused > kMostRefused) return std::nullopt;
    return found->second.problem;
  }
  void note(const fs::path& folder, std::uint64_t had, const proto::Problem& problem) {
    const std::lock_guard lock(mutex_);
    std::error_code error;
    std::erase_if(tries_, [&](const auto& entry) { return !fs::exists(entry.first, error); });
    tries_.insert_or_assign(folder, Try{had, 0, problem});
  }
  void forget(const fs::path& folder) {
    const std::lock_guard lock(mutex_);
    tries_.erase(folder);
  }

 private:
  struct Try {
    std::uint64_t had = 0;
    int refused = 0;
    proto::Problem problem;
  };
  const std::uint32_t free_percent_;
  std::mutex mutex_;
  std::map<fs::path, Try> tries_;
};

/// A look at a raster, or at a list, writes no store: what lies there is another job's, and may be served.
bool writes_store(const fs::path& folder) {
  const auto text = proto::bytes_of_file(folder / kJobFile);
  proto::Job job;
  return text && from_json(*text, &job) && !job.dry_run() && !job.list();
}

/// Of a version that is served nothing goes.
void remove_unfinished(const fs::path& folder) {
  pipeline::remove_store((folder / (updates::has_target(folder) ? updates::kNextStore : kStoreFile)).string());
}

}  // namespace

JobRunner sparing(JobRunner runner, std::uint32_t free_percent) {
  const auto starved = std::make_shared<Starved>(free_percent);
  return [runner = std::move(runner), starved](const fs::path& folder, const ProgressSink& progress,
                                               const std::atomic<bool>& stop) -> proto::Result<std::optional<proto::Estimate>> {
    const std::uint64_t had = starved->room(folder);
    if (auto refused = starved->refuse(folder, had)) return *refused;
    auto outcome = runner(folder, progress, stop);
    if (outcome || outcome.problem().type != "storage-full") {
      starved->forget(folder);
      return outcome;
    }
    starved->note(folder, had, outcome.problem());
    if (writes_store(folder)) remove_unfinished(folder);
    return outcome;
  };
}

}  // namespace cordillera::server
