// The proof: a small raster, built in a child process within the limits of a posted one, and a tile of it read back.
#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <fstream>

#include "gpu/device/device_choice.h"
#include "gpu/simplify.h"
#include "pipeline/encode/decode.h"
#include "pipeline/store/store.h"
#include "server/doctor/doctor.h"
#include "server/http/digest.h"
#include "server/http/json.h"
#include "server/jobs/child.h"
#include "server/sandbox/sandbox.h"

namespace cordillera::server::doctor {
namespace {

namespace fs = std::filesystem;

constexpr int kSide = 64;

/// A cone over the Alps, half an arc minute a sample.
void write_cone(const fs::path& path) {
  std::ofstream file(path);
  file << "ncols " << kSide << "\nnrows " << kSide
       << "\nxllcorner 10\nyllcorner 46\ncellsize 0.0083333333333333\nNODATA_value -9999\n";
  for (int row = 0; row < kSide; ++row) {
    for (int column = 0; column < kSide; ++column) file << 3000 - 40 * std::hypot(row - 31.5, column - 31.5) << ' ';
    file << '\n';
  }
}

/// A folder that goes with its owner. In the data folder, if there is one: that is the disk in question.
class Scratch {
 public:
  explicit Scratch(const fs::path& data) {
    std::error_code error;
    const bool there = fs::is_directory(data / "incoming", error);
    const fs::path parent = there ? data / "incoming" : fs::temp_directory_path(error);
    if (!there && error) {
      trouble_ = "TMPDIR names no folder";
      return;
    }
    folder_ = parent / ("doctor-" + random_letters(12));
    fs::create_directory(folder_, error);
    if (error) trouble_ = "no folder can be made in " + parent.string() + ": " + error.message();
  }
  ~Scratch() {
    std::error_code ignored;
    if (trouble_.empty()) fs::remove_all(folder_, ignored);
  }
  Scratch(const Scratch&) = delete;
  Scratch& operator=(const Scratch&) = delete;
  const fs::path& path() const { return folder_; }
  const std::string& trouble() const { return trouble_; }

 private:
  fs::path folder_;
  std::string trouble_;  ///< empty: it is there
};

proto::Job job_of(const Settings& settings) {
  proto::Job job;
  job.set_id("doctor");
  job.set_name("cone.asc");
  job.set_raster("source.asc");
  // By itself so small a build would leave a GPU alone; whether jobs may use it is what is to be found out.
  const bool on_gpu = gpu::is_any_device(settings.build.device()) && gpu::cuda_devices() > 0;
  job.mutable_options()->set_device(on_gpu ? "cuda" : settings.build.device());
  job.mutable_options()->set_threads(settings.build.threads());
  job.mutable_options()->set_memory(settings.build.memory());
  job.mutable_options()->set_crs("EPSG:4326");
  job.set_max_seconds(120);
  return job;
}

proto::Result<std::string> build(const Settings& settings, const fs::path& folder) {
  write_cone(folder / "source.asc");
  std::ofstream(folder / kJobFile) << to_json_line(job_of(settings)) << '\n';
  const std::atomic<bool> never{false};
  const auto start = std::chrono::steady_clock::now();
  const auto built = child_runner("/proc/self/exe")(folder, nullptr, never);
  if (!built) return built.problem();
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const auto reader = pipeline::StoreReader::open((folder / kStoreFile).string());
  if (!reader) return reader.problem();
  const proto::Manifest& manifest = (*reader)->manifest();
  int tiles = 0;
  const int finest = static_cast<int>(manifest.max_level());
  const auto records = (*reader)->records_of(finest);
  for (const proto::TileRecord& record : records) {
    const auto tile = (*reader)->tile(pipeline::address_of(record), pipeline::Encoding::drc);
    const auto decoded = tile ? pipeline::decode_drc(tile->bytes) : proto::Problem{"tile-damaged", "a tile is missing", "", ""};
    if (!decoded) return decoded.problem();
    ++tiles;
  }
  if (tiles == 0) return proto::Problem{"tile-damaged", "the build gave no tile", "", ""};
  return std::to_string(manifest.tiles()) + " tiles on " + manifest.device() + " in " + std::to_string(seconds).substr(0, 4) +
         " s, read back";
}

Finding fence() {
  const sandbox::Confined offered = sandbox::offered();
  const bool whole = offered.files && offered.syscalls;
  return Finding{"sandbox", whole ? Health::good : Health::warning, "builds are confined by " + sandbox::offered_words(),
                 whole ? "" : "a kernel with both: Linux 5.13 or later with landlock in CONFIG_LSM or lsm="};
}

}  // namespace

void check_build(const Settings& settings, Findings& findings) {
  findings.push_back(fence());
  const Scratch scratch(settings.serve.data);
  if (!scratch.trouble().empty()) {
    findings.push_back(Finding{"build", Health::bad, "a small raster could not be built: " + scratch.trouble(),
                               "a data folder, or a TMPDIR where there is none yet, that this user can write into"});
    return;
  }
  const auto built = build(settings, scratch.path());
  if (built) {
    findings.push_back(Finding{"build", Health::good, *built, ""});
  } else {
    findings.push_back(
        Finding{"build", Health::bad, "a small raster could not be built: " + built.problem().detail, built.problem().accepted});
  }
}

}  // namespace cordillera::server::doctor
