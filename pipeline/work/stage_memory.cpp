#include "pipeline/work/stage_memory.h"

#include <algorithm>
#include <cmath>

#include "pipeline/plan/block_grid.h"

namespace cordillera::pipeline::work {
namespace {

constexpr std::uint32_t kLeast_mib = 1024;  // of a block
constexpr double kBeside_mib = 512;
constexpr double kBytesOfSample = 2, kBytesAround = 5;  // of all levels above blocks; docs/operate/limits.md
constexpr std::uint32_t kOneRegion_mib = 2048;          // with so much for `memory`, one is made at a time

}  // namespace

std::uint32_t memory_mib_of(const proto::WorkPlan& plan, std::size_t stage) {
  if (stage == 0) return kLeast_mib;
  if (!has_one_ground(plan.plan())) return kOneRegion_mib;
  const BlockGrid grid = grid_of(plan.plan());
  const double side = static_cast<double>(block_side(plan.plan()));
  const double bytes = side * side * grid.count() * (grid.closes ? kBytesAround : kBytesOfSample);
  return std::max(kLeast_mib, static_cast<std::uint32_t>(std::ceil(kBeside_mib + bytes / (1 << 20))));
}

}  // namespace cordillera::pipeline::work
