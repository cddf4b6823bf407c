#include "gpu/exact/simplify_block.h"

#include <bit>
#include <optional>

#include "gpu/device/device_choice.h"
#include "gpu/exact/engine_makers.h"
#include "gpu/exact/side_chain.h"

namespace cordillera::gpu::exact {
namespace {

proto::Problem invalid(std::string detail, std::string accepted, std::string parameter) {
  return {"option-invalid", std::move(detail), std::move(accepted), std::move(parameter)};
}

constexpr std::int32_t kLeastShared = 17;  ///< samples

bool is_power_of_two(std::int64_t n) { return n > 0 && std::has_single_bit(static_cast<std::uint64_t>(n)); }

std::optional<proto::Problem> check_level(const BlockPlan& plan, std::size_t l) {
  const BlockLevel& level = plan.levels[l];
  const std::string at = "levels[" + std::to_string(l) + "]";
  const double step_m = level.height_step * proto::kHeightStep_m;
  if (!(level.tolerance_m > 0 && level.tolerance_m <= proto::kMaxHeight_m)) {
    return invalid(at + " has a tolerance of " + std::to_string(level.tolerance_m) + " m", "0 to 16384 m, without the 0",
                   at + ".tolerance_m");
  }
  if (!is_power_of_two(level.height_step) || 4 * step_m > level.tolerance_m) {
    return invalid(at + " has a height step of " + std::to_string(level.height_step) + " / 1024 m",
                   "a power of two, at most a quarter of the tolerance", at + ".height_step");
  }
  if (level.rim_reach < -1 || level.rim_reach > kMostRimReach || (l > 0 && level.rim_reach < plan.levels[l - 1].rim_reach)) {
    return invalid(at + " has a rim reach of " + std::to_string(level.rim_reach), "-1 to 12, no less than the finer level's",
                   at + ".rim_reach");
  }
  if (!(level.rounding_m >= 0)) return invalid(at + " has a rounding below 0", "0 or metres", at + ".rounding_m");
  if (!(level.side_tolerance_m >= 0))
    return invalid(at + " has a side tolerance below 0", "0 or metres", at + ".side_tolerance_m");
  if (l == 0) return {};
  const BlockLevel& finer = plan.levels[l - 1];
  if (level.height_step < finer.height_step || level.tolerance_m < least_tolerance_m(finer, level.height_step)) {
    return invalid(
        at + " asks for more than the finer level",
        "a tolerance and a height step no less than the finer level's, and half the step more tolerance where that grows", at);
  }
  return {};
}

std::optional<proto::Problem> check_block(const Block& block, std::size_t b) {
  const std::string at = "blocks[" + std::to_string(b) + "]";
  if (block.columns < 2 || block.rows < 2 || block.columns > kMostSamples || block.rows > kMostSamples) {
    return invalid(at + " has " + std::to_string(block.columns) + " x " + std::to_string(block.rows) + " samples",
                   "2 to 16385 each way", at);
  }
  if (!block.curve.empty() && block.curve.size() != static_cast<std::size_t>(block.rows))
    return invalid(at + " has another curve than rows", "a number a row", at + ".curve");
  const proto::Samples* const samples = block.samples;
  const bool holds =
      samples && block.west >= samples->west && block.south >= samples->south &&
      block.west + block.columns <= samples->west + samples->columns &&
      block.south + block.rows <= samples->south + samples->rows &&
      samples->height.size() == static_cast<std::size_t>(samples->columns) * static_cast<std::size_t>(samples->rows);
  if (!holds) return invalid(at + " lies outside of its samples", "a rectangle within them", at);
  return {};
}

std::optional<proto::Problem> check_sides(const Block& block, const BlockPlan& plan, std::size_t b) {
  const std::string at = "blocks[" + std::to_string(b) + "].sides";
  const proto::Samples& samples = *block.samples;
  const std::int64_t east = block.west + block.columns - 1, north = block.south + block.rows - 1;
  const std::array<std::int64_t, 4> line{block.south, east, north, block.west};
  const std::array<std::int64_t, 4> beyond{block.south - samples.south, samples.west + samples.columns - 1 - east,
                                           samples.south + samples.rows - 1 - north, block.west - samples.west};
  for (std::size_t side = 0; side < 4; ++side) {
    if (block.sides[side] != SideKind::shared) continue;
    if (block.columns < kLeastShared || block.rows < kLeastShared)
      return invalid(at + ": the block is small", "17 samples or more each way", at);
    if (beyond[side] < kSideReach) return invalid(at + ": there are no samples beyond a shared side", "three rows of them", at);
    if ((line[side] & (plan.tile_side - 1)) != 0)
      return invalid(at + ": a shared side is no side of a tile", "a multiple of tile_side", at);
  }
  return {};
}

bool is_cut_at_tiles(const Ground& ground, std::int64_t tile_side) {
  const auto is_line = [tile_side](std::int64_t at) { return at % tile_side == 0; };
  const std::array<std::int64_t, 4> side{ground.south, ground.west + ground.columns - 1, ground.south + ground.rows - 1,
                                         ground.west};
  for (std::size_t k = 0; k < 4; ++k) {
    if (ground.goes_on[k] && !is_line(side[k])) return false;
  }
  const auto is_inside = [](std::int32_t cut, std::int32_t size) {
    return cut == 0 || (cut % 8 == 0 && cut > 0 && cut < size - 1);
  };
  return is_inside(ground.cut_column, ground.columns) && is_inside(ground.cut_row, ground.rows) &&
         (ground.cut_column == 0 || is_line(ground.west + ground.cut_column)) &&
         (ground.cut_row == 0 || is_line(ground.south + ground.cut_row));
}

std::optional<proto::Problem> check_plan(const BlockPlan& plan) {
  if (plan.levels.empty() || plan.levels.size() > 22)
    return invalid(std::to_string(plan.levels.size()) + " levels", "1 to 22", "levels");
  if (!is_power_of_two(plan.tile_side) || std::int64_t{plan.tile_side} << (plan.levels.size() - 1) > std::int64_t{1} << 30)
    return invalid("a tile side of " + std::to_string(plan.tile_side) + " samples, doubled a level", "powers of two up to 2^30",
                   "tile_side");
  for (std::size_t l = 0; l < plan.levels.size(); ++l) {
    if (auto problem = check_level(plan, l)) return problem;
  }
  return {};
}

}  // namespace

std::optional<proto::Problem> check_call(std::span<const Block> blocks, const BlockPlan& plan) {
  if (blocks.empty()) return invalid("there is no block", "one block or more", "blocks");
  if (auto problem = check_plan(plan)) return problem;
  std::size_t samples = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (auto problem = check_block(blocks[b], b)) return problem;
    if (auto problem = check_sides(blocks[b], plan, b)) return problem;
    samples += static_cast<std::size_t>(blocks[b].columns + 7) * static_cast<std::size_t>(blocks[b].rows);
  }
  if (samples >= std::size_t{1} << 32)
    return invalid(std::to_string(samples) + " samples in one call", "fewer than 2^32", "blocks");
  return {};
}

std::optional<proto::Problem> check_call(const Ground& ground, const BlockPlan& plan) {
  if (auto problem = check_plan(plan)) return problem;
  if (ground.columns < 2 || ground.rows < 2 || ground.columns > kMostAbove || ground.rows > kMostAbove)
    return invalid("a ground of " + std::to_string(ground.columns) + " x " + std::to_string(ground.rows) + " samples",
                   "2 to 65536 each way", "ground");
  if (!is_cut_at_tiles(ground, std::int64_t{plan.tile_side} << (plan.levels.size() - 1)))
    return invalid("a ground that goes on is not cut at sides of tiles", "such ones, and inside of it, too", "ground");
  const std::size_t squares = ground.across() * ground.up();
  const Squares& known = ground.squares;
  if (known.plane.size() != squares || known.code.size() != 64 * squares ||
      !(known.depth.empty() || known.depth.size() == squares))
    return invalid("a ground with another number of squares than it has place for", std::to_string(squares), "ground");
  if (!ground.curve.empty() && ground.curve.size() != static_cast<std::size_t>(ground.rows))
    return invalid("a ground with another curve than rows", "a number a row", "ground.curve");
  return {};
}

#ifndef CORDILLERA_HAS_CUDA
proto::Result<std::unique_ptr<BlockSimplifier>> make_cuda_engine(int, ParallelFor) { return built_without_cuda(); }
#endif

proto::Result<std::unique_ptr<BlockSimplifier>> make_block_simplifier(const std::string& device, ParallelFor parallel) {
  return on_device(
      device, [&]() -> proto::Result<std::unique_ptr<BlockSimplifier>> { return make_host_engine(parallel); },
      [&](int number) { return make_cuda_engine(number, parallel); });
}

}  // namespace cordillera::gpu::exact
