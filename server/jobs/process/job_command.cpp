// The child's side of a job: limit this process, build, report.
#include <fcntl.h>
#include <signal.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <fstream>
#include <new>
#include <system_error>

#include "gpu/device/device_lost.h"
#include "pipeline/build/build.h"
#include "pipeline/estimate/estimate.h"
#include "pipeline/store/sqlite.h"
#include "proto/cores.h"
#include "proto/files.h"
#include "raster/datum/vertical.h"
#include "raster/disk/free_space.h"
#include "raster/disk/write_all.h"
#include "raster/mosaic/datum_notes.h"
#include "server/datasets/ledger.h"
#include "server/http/json.h"
#include "server/jobs/child.h"
#include "server/jobs/process/list_job.h"
#include "server/jobs/process/provisional_job.h"
#include "server/jobs/process/sharpener.h"
#include "server/jobs/process/update_job.h"
#include "server/limits/disk.h"
#include "server/memory/memory_limit.h"
#include "server/options/option_values.h"
#include "server/sandbox/asked_to_stop.h"
#include "server/sandbox/sandbox.h"

namespace cordillera::server {
namespace {

constexpr rlim_t kMiB = rlim_t{1} << 20;
constexpr rlim_t kMostFiles = 512, kFilesOfThread = 4;  // a raster, its grids
constexpr rlim_t kThreadsBeside =
    2;  // one gives the others their work, one cuts the last level into tiles. The clock on the wall is to end a build first

void limit(__rlimit_resource resource, rlim_t value) {
  rlimit now{};
  getrlimit(resource, &now);
  now.rlim_cur = std::min(now.rlim_max, value);
  now.rlim_max = now.rlim_cur;
  setrlimit(resource, &now);
}

/// What a raster from a stranger may cost, and reach. False: it reaches more than this system could keep it from.
bool restrict_process(const proto::Job& job, const std::filesystem::path& folder, proto::BuildOptions& options) {
  limit(RLIMIT_CORE, 0);
  limit(RLIMIT_FSIZE, 1024 * 1024 * kMiB);
  if (options.memory() == 0) options.set_memory(default_memory_mib(options));
  limit_memory(options);
  const rlim_t threads = proto::threads_for(options.threads());
  limit(RLIMIT_NOFILE, kMostFiles + kFilesOfThread * threads);
  if (job.max_seconds() > 0) limit(RLIMIT_CPU, rlim_t{job.max_seconds()} * (threads + kThreadsBeside));
  // If the machine runs out of memory, the kernel should take the build and not the service.
  std::ofstream("/proc/self/oom_score_adj") << 500;
  const std::filesystem::path temporary = folder / kTemporaryFolder;
  setenv("TMPDIR", temporary.c_str(), 1);
  setenv("GDAL_DRIVER_PATH", "disable", 1);     // no plugins: none of the drivers that are asked for is one
  setenv("HDF5_USE_FILE_LOCKING", "FALSE", 1);  // NetCDF would give up where flock() is refused; nobody else has the raster
  alarm(job.max_seconds());                     // a confined process cannot ask for another clock
  const sandbox::Gpu gpu = may_use_cuda(options) ? sandbox::Gpu::allowed : sandbox::Gpu::none;
  const sandbox::Confined offered = sandbox::offered(),
                          confined = sandbox::confine({folder, temporary, raster::geoid_places(), gpu});
  return (confined.files || !offered.files) && (confined.syscalls || !offered.syscalls);
}

/// A disk that fails is another matter than one that is full: a job that found no room is not tried again before there is more.
std::optional<proto::Problem> make_temporary_folder(const std::filesystem::path& folder) {
  std::error_code error;
  std::filesystem::create_directories(folder / kTemporaryFolder, error);
  if (!error) return std::nullopt;
  const bool full = error.value() == ENOSPC || error.value() == EDQUOT;
  return proto::Problem{full ? "storage-full" : "store-write",
                        "the folder for temporary files cannot be made: " + error.message(), "a writable disk with free space",
                        ""};
}

/// False when the parent is dead: the pipe has no reader.
bool report(const proto::Progress& progress) { return raster::write_all(kReportDescriptor, to_json_line(progress) + "\n"); }

proto::Progress failure(const proto::Problem& problem) {
  proto::Progress progress;
  *progress.mutable_error() = to_error(problem);
  return progress;
}

int fail(const proto::Problem& problem) {
  report(failure(problem));
  return 1;
}

/// What the operator lets a raster have.
std::optional<proto::Problem> too_large(const proto::Job& job, const std::string& name, const proto::Source& source) {
  const double columns = source.columns(), rows = source.rows();
  const std::string claim = name + " has " + std::to_string(source.columns()) + " x " + std::to_string(source.rows()) + " pixels";
  const double side = job.max_side(), pixels = job.max_pixels();
  if (side > 0 && std::max(columns, rows) > side)
    return proto::Problem{"raster-too-large", claim, "at most " + std::to_string(job.max_side()) + " along a side", ""};
  if (pixels > 0 && columns * rows > pixels)
    return proto::Problem{"raster-too-large", claim, "at most " + shown(pixels / 1e6) + " million pixels", ""};
  return std::nullopt;
}

/// What is to be done before the build: plan and build open the raster again.
std::optional<proto::Problem> look_at(const proto::Job& job, const pipeline::BuildRequest& request,
                                      const std::filesystem::path& folder, const pipeline::ProgressCallback& sink) {
  const auto source = pipeline::open_source(request);
  if (!source) return source.problem();
  if (request.members.empty())
    if (auto refused = too_large(job, job.name(), (*source)->description())) return refused;
  if (job.provisional()) make_provisional(request, **source, folder, sink, g_asked_to_stop);
  return std::nullopt;
}

proto::Result<void> build_job(const proto::Job& job, const std::filesystem::path& folder) {
  const auto sink = [](const proto::Progress& progress) {
    if (!report(progress)) g_asked_to_stop = true;
  };
  if (job.list()) return report_listed(job, folder, sink);
  const auto large = [&](const std::string& name, const proto::Source& source) { return too_large(job, name, source); };
  if (updates::has_target(folder)) {
    const auto built = updates::build_target(job, folder, large, sink, g_asked_to_stop);
    if (!built) return built.problem();
    return {};
  }
  pipeline::BuildRequest request;
  request.raster_path = (folder / job.raster()).string();
  request.raster_name = job.name();
  request.trust = raster::Trust::posted_file;
  request.id = job.id();
  request.store_path = (folder / kStoreFile).string();
  request.options = job.options();
  auto members = examine_listed(job, large);
  if (!members) return members.problem();
  request.members = std::move(*members);
  for (const std::string& note : raster::notes_on_datums(request.members)) request.options.add_warnings(note);
  if (const auto refused = look_at(job, request, folder, sink)) return *refused;
  if (job.dry_run() && job.provisional()) return {};
  if (job.dry_run()) {
    const auto found = pipeline::estimate(request);
    if (!found) return found.problem();
    proto::Progress progress;
    *progress.mutable_estimate()->mutable_manifest() = found->manifest;
    progress.mutable_estimate()->set_seconds(found->seconds);
    report(progress);  // in vain only where the parent is dead
    return {};
  }
  Sharpener sharpener(folder, job.lazy() ? Sharpener::Blocks::looked_at : Sharpener::Blocks::all);
  if (job.provisional() || job.lazy()) request.follower = &sharpener;
  const auto built = pipeline::build(request, sink, g_asked_to_stop);
  if (!built) return built.problem();
  return {};
}

}  // namespace

int job_main(const std::string& given, int parent, std::uint32_t free_percent) {
  // From here on this process ends with its parent; the parent may have ended before.
  prctl(PR_SET_PDEATHSIG, SIGKILL, 0, 0, 0);
  if (parent != 0 && getppid() != parent) return 1;
  if (fcntl(kReportDescriptor, F_GETFD) == -1) return 2;
  signal(SIGPIPE, SIG_IGN);
  signal(SIGXFSZ, SIG_IGN);
  stop_on({SIGTERM}, SecondTime::asks_again);
  const std::filesystem::path folder = std::filesystem::absolute(given);  // the process's own folder may become another
  const auto text = proto::bytes_of_file(folder / kJobFile);
  proto::Job job;
  if (!text || !from_json(*text, &job)) return fail({"internal", "the job's description cannot be read", "", ""});
  raster::keep_free(limits::bytes_to_leave(folder, free_percent));
  if (const auto missing = make_temporary_folder(folder)) return fail(*missing);
  const bool confined = restrict_process(job, folder, *job.mutable_options());
  const proto::Problem starved = out_of_memory(job.options(), job.name());
  if (!confined) {
    if (memory_is_short()) return fail(starved);  // the list of calls takes some
    return fail(
        {"internal", "the job cannot be confined as this system offers", "cordillera doctor, which says what it offers", ""});
  }
  on_out_of_memory(kReportDescriptor, to_json_line(failure(starved)) + "\n");
  try {
    if (!have_rasters(job, folder)) return fail({"internal", "the job's raster cannot be read", "", ""});
    const auto built = build_job(job, folder);
    if (built.ok()) return 0;
    return fail(memory_is_short() ? starved : built.problem());
  } catch (const std::bad_alloc&) { return fail(starved); } catch (const std::system_error& error) {
    if (error.code() == std::errc::resource_unavailable_try_again) return fail(starved);  // a thread that cannot be made
    return fail({"internal", std::string("the build failed unexpectedly: ") + error.what(), "", ""});
  } catch (const gpu::DeviceLost& lost) {
    return fail({"device-lost", lost.what(), "auto, cpu", "device"});  // the service tries once more on the CPU
  } catch (const pipeline::StoreError&
               error) {  // its disk cannot be read, or not what it wrote there: tried again, and in the end anew
    return fail({"store-write", std::string("the half-made store cannot be used: ") + error.what(), "", ""});
  } catch (const std::exception& error) {
    return fail({"internal", std::string("the build failed unexpectedly: ") + error.what(), "", ""});
  }
}

}  // namespace cordillera::server
