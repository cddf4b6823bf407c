#include "pipeline/plan/density.h"

#include <algorithm>
#include <vector>

#include "gpu/exact/simplify_block.h"
#include "pipeline/plan/sample_places.h"

namespace cordillera::pipeline {
namespace {

constexpr std::int32_t kPlaceSide = 161;  // samples of a place, each way: enough of it

/// What of the place the engine starts from as it does from the whole: from line to line of its largest squares.
gpu::exact::Block aligned_block(const proto::Samples& place) {
  constexpr std::int64_t kSquare = 32;
  gpu::exact::Block block;
  block.samples = &place;
  block.west = (place.west + kSquare - 1) / kSquare * kSquare;
  block.south = (place.south + kSquare - 1) / kSquare * kSquare;
  const auto length = [](std::int64_t first, std::int64_t last) { return static_cast<std::int32_t>(std::max<std::int64_t>((last - first) / kSquare * kSquare + 1, 0)); };
  block.columns = length(block.west, place.west + std::min(place.columns, kPlaceSide) - 1);
  block.rows = length(block.south, place.south + std::min(place.rows, kPlaceSide) - 1);
  return block;
}

}  // namespace

double start_share(const std::vector<proto::Samples>& places, double error_m) {
  const auto simplifier = gpu::exact::make_block_simplifier("cpu");
  if (!simplifier.ok()) return 0;
  gpu::exact::BlockPlan levels;
  levels.levels.resize(1);
  levels.levels.front().tolerance_m = error_m;
  double samples = 0, vertices = 0;
  for (const proto::Samples& place : places) {
    const gpu::exact::Block block = aligned_block(place);
    if (block.columns < 2 || block.rows < 2) continue;
    const auto started = (*simplifier)->start_vertices({&block, 1}, levels);
    if (!started.ok()) continue;
    samples += static_cast<double>(block.columns) * block.rows;
    vertices += static_cast<double>(*started);
  }
  return samples == 0 ? 0 : vertices / samples;
}

}  // namespace cordillera::pipeline
