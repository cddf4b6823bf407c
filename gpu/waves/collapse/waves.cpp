#include "gpu/waves/collapse/waves.h"

#include <stdexcept>

#include "gpu/waves/border/empty_border.h"

namespace cordillera::gpu {

Rules rules_of(const SimplifyJob& job) {
  Rules rules;
  rules.cells_per_unit = 1 / job.cell_units;
  rules.inverse_guard = job.guard_m > 0 ? 1 / job.guard_m : 0;
  rules.inverse_rim = job.rim_units > 0 ? 1 / job.rim_units : 1e30f;
  rules.cost = (job.guard_m > 0 ? kGuardedCostPerTolerance : kCostPerTolerance) * job.tolerance_m * job.tolerance_m;
  return rules;
}

// A mesh that the project itself made is broken: nothing a user could mend, so no Problem.
void refuse_broken(std::span<const SimplifyJob> jobs) {
  for (const SimplifyJob& job : jobs) {
    const proto::Result<Rings> rings = rings_from_triangles(*job.input);
    if (!rings.ok()) throw std::logic_error("simplifier: " + rings.problem().detail);
  }
  throw std::logic_error("simplifier: the device found a mesh broken that the host does not");
}

proto::TileMesh finish_tile(const SimplifyJob& job, const Survivors& survivors) {
  const proto::TileMesh& in = *job.input;
  const std::size_t count = survivors.original.size();
  proto::TileMesh mesh;
  mesh.side = in.side;
  mesh.x.resize(count);
  mesh.y.resize(count);
  mesh.height.resize(count);
  mesh.mark.resize(count);
  thread_local Rings rings;  // kept from tile to tile: most of the time would go into fresh memory
  rings.neighbour.resize(count * kRowWidth);
  rings.valence.resize(count);
  rings.open.resize(count);
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t v = survivors.original[i] - survivors.first_original;
    mesh.x[i] = in.x[v];
    mesh.y[i] = in.y[v];
    mesh.height[i] = in.height[v];
    mesh.mark[i] = in.mark[v];
    const std::uint32_t from = survivors.row_start[i], to = survivors.row_start[i + 1];
    rings.valence[i] = static_cast<std::uint8_t>(to - from);
    rings.open[i] = in.x[v] == 0 || in.x[v] == in.side || in.y[v] == 0 || in.y[v] == in.side;
    for (std::uint32_t k = from; k < to; ++k)
      rings.neighbour[i * kRowWidth + k - from] = survivors.neighbour[k] - survivors.first;
  }
  return with_border_emptied(rings, mesh, job.rim_units);
}

}  // namespace cordillera::gpu
