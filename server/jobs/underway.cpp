#include "server/jobs/underway.h"

#include <array>
#include <fstream>
#include <string>
#include <utility>

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

/// Of a job that runs this one is among them.
struct Ends {
  unsigned count = 0;
  std::size_t stage = 0;  ///< how far the build was when they began to be counted
  double done = 0;
};

fs::path file_under_way(const fs::path& folder) { return folder / kUnderWayFile; }

Ends read_ends(const fs::path& folder) {
  Ends ends;
  std::ifstream file(file_under_way(folder));
  if (!(file >> ends.count >> ends.stage >> ends.done)) return {};
  return ends;
}

/// Not brought to the disk: a power cut that loses it is one that no build has made.
void write_ends(const fs::path& folder, const Ends& ends) {
  std::ofstream(file_under_way(folder)) << ends.count << ' ' << ends.stage << ' ' << std::fixed << ends.done << '\n';
}

/// As long as a job runs.
class Underway {
 public:
  explicit Underway(fs::path folder) : folder_(std::move(folder)), ends_(read_ends(folder_)) {
    ++ends_.count;
    write_ends(folder_, ends_);
  }
  ~Underway() {
    try {
      if (--ends_.count == 0)
        forget_unsaid_ends(folder_);
      else
        write_ends(folder_, ends_);
    } catch (const std::exception&) {  // want of memory: an end is counted that was none
    }
  }
  Underway(const Underway&) = delete;
  Underway& operator=(const Underway&) = delete;

  /// Where it begins is what was built before: if that has become more, the ends are counted anew.
  void report(const proto::Progress& now) {
    constexpr std::array<const char*, 3> kStages = {"build", "merge", "publish"};
    for (std::size_t stage = seen_; stage < kStages.size(); ++stage) {
      if (now.stage() != kStages[stage]) continue;
      seen_ = stage + 1;
      if (std::pair(seen_, now.done()) <= std::pair(ends_.stage, ends_.done)) return;
      ends_ = {1, seen_, now.done()};
      write_ends(folder_, ends_);
    }
  }

 private:
  const fs::path folder_;
  Ends ends_;
  std::size_t seen_ = 0;  ///< stages that have begun
};

}  // namespace

unsigned unsaid_ends(const fs::path& folder) { return read_ends(folder).count; }

void forget_unsaid_ends(const fs::path& folder) {
  std::error_code ignored;
  fs::remove(file_under_way(folder), ignored);
}

JobRunner noting_ends(JobRunner runner) {
  return [runner = std::move(runner)](const fs::path& folder, const ProgressSink& told, const std::atomic<bool>& stop) {
    if (!told) return runner(folder, told, stop);  // a dry run, which no other service goes on with
    Underway job(folder);
    ProgressSink progress = [&](const proto::Progress& now) {
      job.report(now);
      told(now);
    };
    progress.rasters = told.rasters;
    return runner(folder, progress, stop);
  };
}

}  // namespace cordillera::server
