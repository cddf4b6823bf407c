#include "server/jobs/process/provisional_job.h"

#include <cstdio>
#include <vector>

#include "pipeline/build/provisional.h"
#include "pipeline/store/mesh_files.h"
#include "pipeline/store/store.h"
#include "proto/version.h"
#include "server/jobs/child.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;

/// Samples of the finest provisional level, a step each: what is on the screen within a second on two cores, and what is worth
/// looking at a few seconds later. Further steps, each worth waiting for, where it takes more to meet the blocks of the build, up
/// to kMostSamples: of a raster of 16 gigapixels, whose build takes a hundred times as long.
constexpr std::int64_t kFirst = 40'000, kSecond = 600'000, kGrowth = 8, kMostSamples = std::int64_t{1} << 26;

std::vector<std::int64_t> steps_of(const pipeline::BuildRequest& request, raster::Source& source) {
  std::vector<std::int64_t> steps{kFirst, kSecond};
  const auto blocks = pipeline::samples_of_block_level(request, source);
  if (!blocks.ok() || *blocks <= kSecond || *blocks > kMostSamples) return steps;
  const auto meets = pipeline::provisional_level(request, source, *blocks);
  if (!meets.ok() || !*meets) return steps;
  for (std::int64_t step = kSecond * kGrowth; step < *blocks; step *= kGrowth) steps.push_back(step);
  steps.push_back(*blocks);
  return steps;
}

proto::Progress provisional(std::size_t done, std::size_t steps) {
  proto::Progress progress;
  progress.set_stage("provisional");
  progress.set_done(static_cast<double>(done));
  progress.set_total(static_cast<double>(steps));
  progress.set_seconds_left(-1);
  progress.set_provisional(done > 0);
  return progress;
}

/// Whether the tiles of a step stand.
proto::Result<bool> make_step(const pipeline::BuildRequest& request, raster::Source& source, const fs::path& folder,
                              std::int64_t samples, const std::atomic<bool>& stop) {
  auto small = pipeline::provisional_request(request, source, samples);
  if (!small.ok()) return small.problem();
  if (!*small) return false;
  const fs::path next = folder / kNextProvisional;
  pipeline::remove_store(next.string());  // what an attempt that was ended left
  (*small)->store_path = next.string();
  const auto built = pipeline::build(**small, nullptr, stop);
  if (!built.ok()) {
    pipeline::remove_store(next.string());
    return built.problem();
  }
  std::error_code error;
  fs::rename(next, folder / kProvisionalStore, error);
  return !error;
}

}  // namespace

void make_provisional(const pipeline::BuildRequest& request, raster::Source& source, const fs::path& folder,
                      const pipeline::ProgressCallback& report, const std::atomic<bool>& stop) {
  const std::vector<std::int64_t> steps = steps_of(request, source);
  // Those of another version of the program are not mixed with what this one makes.
  const auto stands = pipeline::StoreReader::manifest_of((folder / kProvisionalStore).string());
  const bool same = stands.ok() && stands->program() == proto::kProgram;
  if (same && stands->has_done_blocks()) return report(provisional(steps.size(), steps.size()));
  report(provisional(same ? 1 : 0, steps.size()));
  for (std::size_t step = 0; step < steps.size() && !stop; ++step) {
    // A look that was ended for this build made the first ones.
    const auto level = pipeline::provisional_level(request, source, steps[step]);
    if (same && level.ok() && *level && **level <= static_cast<int>(stands->max_level())) continue;
    const auto made = make_step(request, source, folder, steps[step], stop);
    if (!made.ok() && !stop) std::fprintf(stderr, "no provisional tiles: %s\n", made.problem().line().c_str());
    if (!made.ok() || !*made) return;
    report(provisional(step + 1, steps.size()));
  }
}

}  // namespace cordillera::server
