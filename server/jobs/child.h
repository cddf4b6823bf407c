#pragma once
// A job in a process of its own: what a driver, a memory limit or a cancel ends is the child, not the service.
#include <atomic>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "cordillera.pb.h"
#include "proto/result.h"
#include "server/data/layout.h"

namespace cordillera::server {

/// The descriptor on which a child reports: JSON lines of proto::Progress.
inline constexpr int kReportDescriptor = 3;
/// A job's temporary files, removed when it has ended. The only place where it may make symbolic links: the service follows names
/// in the rest.
inline constexpr const char* kTemporaryFolder = "tmp";

namespace updates {
class RangedSources;
}

/// Whom a job tells how far it is, and what it may ask for meanwhile.
struct ProgressSink : std::function<void(const proto::Progress&)> {
  using std::function<void(const proto::Progress&)>::function;
  updates::RangedSources* rasters = nullptr;  ///< its rasters come as they are read; null: they are there
};
using JobOutcome = proto::Result<std::optional<proto::Estimate>>;
/// Does the job in a folder; the estimate is there if it was a dry run. stop: leave early (type "cancelled").
using JobRunner =
    std::function<JobOutcome(const std::filesystem::path& folder, const ProgressSink& progress, const std::atomic<bool>& stop)>;

/// Runs `program job FOLDER` in a session of its own. The child gets no descriptor but stdin (empty), a pipe as stderr, whose
/// lines are logged, the report, and where its raster comes as it is read a socket for that (fetch/range_asks.h); of the
/// environment what sandbox/environment.cpp names. stop: SIGTERM, then SIGKILL. A child that ends without saying why is a Problem
/// "job-crashed" that names the signal or exit code. free_percent: of its folder's disk, that it leaves free; where that is too
/// little for it, it says "storage-full". "service-busy": the system had no descriptor, process or memory to start it with.
JobRunner child_runner(const std::string& program, std::uint32_t free_percent = 0);

/// The same runner, whose problems tell clients no place on the operator's disk: what lies in the job's folder has its name
/// there. The log has all.
JobRunner telling_no_places(JobRunner runner);

/// What the child does: `cordillera job FOLDER`. Returns the exit code.
int job_main(const std::string& folder, int parent, std::uint32_t free_percent = 0);

}  // namespace cordillera::server
