#include "gpu/waves.h"

#include <stdexcept>
#include <string>

#include "gpu/mend.h"
#include "gpu/nudge.h"

namespace cordillera::gpu {
namespace {

// What a weld leaves above the contract inside is brought down by flips.
constexpr ValenceCaps kMendCaps{kInnerValence, kMendedSide, kMendedCorner};

// A mesh that the project itself made is broken: nothing a user could mend, so no Problem.
[[noreturn]] void internal_error(const std::string& detail) { throw std::logic_error("simplifier: " + detail); }

}  // namespace

void BatchMesh::append(const SimplifyJob& job) {
  const proto::TileMesh& in = *job.input;
  if (first.empty()) first.push_back(0);
  const auto base = static_cast<std::uint32_t>(first.back());
  const std::size_t n = in.vertices();
  const proto::Result<Rings> made = rings_from_triangles(in);
  if (!made.ok()) internal_error(made.problem().detail);
  const Rings& rings = *made;
  x.insert(x.end(), in.x.begin(), in.x.end());
  y.insert(y.end(), in.y.begin(), in.y.end());
  elevation.insert(elevation.end(), job.elevation.begin(), job.elevation.end());
  carried.resize(base + n, 0);
  spent.resize(base + n, 0);
  key.resize(base + n, 0);
  window.resize(base + n, 0);
  local.resize(base + n, 0);
  valence.insert(valence.end(), rings.valence.begin(), rings.valence.end());
  row.reserve(row.size() + rings.neighbour.size());
  for (const std::uint32_t v : rings.neighbour) row.push_back(v + base);
  mark.reserve(base + n);
  for (std::size_t v = 0; v < n; ++v) {
    const bool side_x = in.x[v] == 0 || in.x[v] == in.side, side_y = in.y[v] == 0 || in.y[v] == in.side;
    const int side = (side_x || side_y ? kOnSide : 0) | (side_x && side_y ? kOnCorner : 0);
    // What may not go is not asked: on the border, only what the chain dropped.
    const bool keep = side && !(in.mark[v] & proto::kRemove);
    mark.push_back(static_cast<std::uint8_t>((in.mark[v] & 7) | side | (keep ? proto::kKeep : 0)));
  }
  first.push_back(base + n);
}

MeshView BatchMesh::view() {
  return {x.data(),   y.data(),       elevation.data(), carried.data(), spent.data(), key.data(),
          row.data(), valence.data(), mark.data(),      window.data(),  local.data()};
}

void number_windows(BatchMesh& mesh, const WindowCut& cut) {
  for (std::size_t k = 0; k < cut.windows.size(); ++k) {
    const WindowRange& range = cut.windows[k];
    for (std::uint32_t i = 0; i < range.count; ++i) {
      const std::uint32_t v = cut.order[range.first + i];
      mesh.window[v] = static_cast<std::uint32_t>(k);
      mesh.local[v] = static_cast<std::uint16_t>(i);
    }
  }
}

Rules rules_of(const SimplifyJob& job) {
  Rules rules;
  rules.cells_per_unit = 1 / job.cell_units;
  rules.inverse_guard = job.guard_m > 0 ? 1 / job.guard_m : 0;
  rules.inverse_rim = job.rim_units > 0 ? 1 / job.rim_units : 1e30f;
  rules.first_cost = schedule_of(job).first();
  rules.last_cost = schedule_of(job).cost;
  return rules;
}

WaveSchedule schedule_of(const SimplifyJob& job) {
  WaveSchedule schedule;
  const float per_tolerance = job.guard_m > 0 ? kGuardedCostPerTolerance : kCostPerTolerance;
  schedule.cost = per_tolerance * job.tolerance_m * job.tolerance_m;
  return schedule;
}

proto::TileMesh extract(const BatchMesh& mesh, std::size_t tile, const SimplifyJob& job) {
  const std::size_t from = mesh.first[tile], count = mesh.first[tile + 1] - from;
  Rings rings;
  rings.neighbour.resize(count * kRowWidth);
  rings.valence.resize(count);
  rings.open.resize(count);
  for (std::size_t u = 0; u < count; ++u) {
    const std::size_t v = from + u;
    const bool gone = (mesh.mark[v] & kGone) != 0;
    rings.valence[u] = gone ? 0 : mesh.valence[v];
    rings.open[u] = (mesh.mark[v] & kOnSide) ? 1 : 0;
    for (std::size_t k = 0; k < rings.valence[u]; ++k) {
      rings.neighbour[u * kRowWidth + k] = mesh.row[v * kRowWidth + k] - static_cast<std::uint32_t>(from);
    }
  }
  if (mend(rings, *job.input, kMendCaps, job.rim_units) == 0) return mesh_from_rings(*job.input, rings);
  proto::TileMesh moved = *job.input;
  if (nudge_inwards(rings, moved) > 0 && mend(rings, moved, kMendCaps) > 0) nudge_inwards(rings, moved);
  return mesh_from_rings(moved, rings);
}

}  // namespace cordillera::gpu
