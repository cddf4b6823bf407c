#include "server/jobs/process/provisional_job.h"

#include <algorithm>
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

struct Steps {
  std::vector<std::int64_t> samples{kFirst, kSecond};
  bool at_once = false;  ///< none of their tiles meet blocks that can be shown one by one
};

/// Whether a step reaches down to the level.
bool reaches(const pipeline::BuildRequest& request, const raster::Source& source, const std::vector<std::int64_t>& steps,
             int level) {
  return std::any_of(steps.begin(), steps.end(), [&](std::int64_t step) {
    const auto of_step = pipeline::provisional_level(request, source, step);
    return of_step.ok() && *of_step && **of_step >= level;
  });
}

Steps steps_of(const pipeline::BuildRequest& request, raster::Source& source) {
  Steps steps;
  const auto blocks = pipeline::block_level_of(request, source);
  if (!blocks.ok()) return steps;
  const std::int64_t wanted = blocks->samples;
  if (wanted > kSecond && wanted <= kMostSamples && reaches(request, source, {wanted}, blocks->level)) {
    for (std::int64_t step = kSecond * kGrowth; step < wanted; step *= kGrowth) steps.samples.push_back(step);
    steps.samples.push_back(wanted);
  }
  steps.at_once = !blocks->has_blocks_to_show || !reaches(request, source, steps.samples, blocks->level);
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

struct Step {
  std::int64_t samples = 0;
  bool at_once = false;  ///< as of all steps
};
/// Whether the tiles of a step stand.
proto::Result<bool> make_step(const pipeline::BuildRequest& request, raster::Source& source, const fs::path& folder, Step step,
                              const std::atomic<bool>& stop) {
  auto small = pipeline::provisional_request(request, source, step.samples);
  if (!small.ok()) return small.problem();
  if (!*small) return false;
  const fs::path next = folder / kNextProvisional;
  pipeline::remove_store(next.string());  // what an attempt that was ended left
  (*small)->store_path = next.string();
  (*small)->at_once = step.at_once;
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
  const auto [steps, at_once] = steps_of(request, source);
  // Those of another version of the program are not mixed with what this one makes.
  const auto stands = pipeline::StoreReader::manifest_of((folder / kProvisionalStore).string());
  const bool same = stands.ok() && stands->program() == proto::kProgram;
  if (same && stands->has_done_blocks()) return report(provisional(steps.size(), steps.size()));
  report(provisional(same ? 1 : 0, steps.size()));
  for (std::size_t step = 0; step < steps.size() && !stop; ++step) {
    // A look that was ended for this build made the first ones.
    const auto level = pipeline::provisional_level(request, source, steps[step]);
    if (same && level.ok() && *level && **level <= static_cast<int>(stands->max_level())) continue;
    const auto made = make_step(request, source, folder, {steps[step], at_once}, stop);
    if (!made.ok() && !stop) std::fprintf(stderr, "no provisional tiles: %s\n", made.problem().line().c_str());
    if (!made.ok() || !*made) return;
    report(provisional(step + 1, steps.size()));
  }
}

}  // namespace cordillera::server
