#pragma once
// A build cut into tasks: blocks first, then merges level by level. Each has a key, the hash of all that its result depends on,
// so a task that was done once, for this plan or an earlier one in the same folder, is not done again: a changed raster costs the
// blocks that it touches and what lies above them.
#include <algorithm>
#include <atomic>
#include <optional>
#include <string>

#include "pipeline/build/build.h"
#include "work.pb.h"

namespace cordillera::pipeline::work {

inline constexpr const char* kPlanFile = "plan.json";

/// What a plan takes over instead of working it out.
struct PlanGiven {
  /// An earlier plan of the same dataset: its levels, blocks and targets stay, so that what no changed raster touches keeps its
  /// keys.
  const proto::WorkPlan* before = nullptr;
  /// Blocks of so many samples at most, no smaller than kLeastBlockSamples; 0: as large as memory allows. Smaller ones make a
  /// change cheaper; errors above the blocks are bounds, so coarse levels take more triangles.
  std::int64_t block_samples = 0;
  /// If block_samples is 0, so many blocks that have least_block_samples or more; 0: see there.
  std::int64_t blocks = 0, least_block_samples = 0;
};
inline constexpr std::int64_t kLeastBlockSamples = std::int64_t{513} * 513;
/// Finest samples that each of so many blocks may have, if none is to be smaller than `least`.
inline std::int64_t samples_a_block(std::int64_t samples, std::int64_t blocks, std::int64_t least) {
  return std::max(samples / blocks, least);
}

/// A raster as an earlier plan found it: no need to open it again. path and trust: of now.
raster::MosaicMember member_of(const proto::PlannedSource& source, const std::string& path, raster::Trust trust);

/// Fixes numbers, tasks and keys. request.members must be set. Reads no more than a pilot (keep=) or a default error needs; with
/// error= no pixel at all. Deterministic.
proto::Result<proto::WorkPlan> plan_work(const BuildRequest& request, const std::atomic<bool>& stop, const PlanGiven& given = {});

/// The options of a build that say how a raster is read.
proto::BuildOptions reading(const proto::BuildOptions& options);

/// Writes and reads folder/plan.json. A plan of another program version or format is refused ("plan-version").
proto::Result<void> write_plan(const proto::WorkPlan& plan, const std::string& folder);
proto::Result<proto::WorkPlan> read_plan(const std::string& folder);

/// The request that the plan was made from: for the manifest, and to open sources.
BuildRequest request_of(const proto::WorkPlan& plan);
/// A raster, and its geoid, are what they were when the plan was made; "source-changed" if not.
proto::Result<void> check_unchanged(const raster::MosaicMember& planned);
/// The same of its state alone, asked for anew where it may be remembered.
proto::Result<void> check_state(const raster::MosaicMember& planned);
/// The rasters that one task reads.
std::vector<raster::MosaicMember> members_of(const proto::WorkPlan& plan, const proto::WorkTask& task);
/// The raster that blocks take water from: path, name and state alone; none: water_mask names none.
std::optional<raster::MosaicMember> water_mask_of(const proto::WorkPlan& plan);

inline proto::TileAddress address_of(const proto::WorkTask& task) {
  return {static_cast<int>(task.level()), static_cast<std::int32_t>(task.x()), static_cast<std::int32_t>(task.y())};
}

}  // namespace cordillera::pipeline::work
