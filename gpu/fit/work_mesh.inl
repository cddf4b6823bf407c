// The mesh in work on a device; included by fitter.inl only.
#include <bit>

#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

template <class Device>
bool WorkMesh<Device>::load(const Plan& plan) {
  const std::size_t count = plan.at.size();
  ids_ = count;
  triangles_ = plan.triangles.size();
  removed_ = 0;
  blocks_ = plan.block_start.empty() ? 0 : plan.block_start.size() - 1;
  if (blocks_ > 0) upload(block_start_, plan.block_start);
  std::vector<Vertex> vertices(count);
  for (std::size_t v = 0; v < count; ++v)
    vertices[v] = {plan.at[v].x, plan.at[v].y, plan.z[v], 0, 0, plan.steep.empty() ? std::uint8_t{0} : plan.steep[v]};
  mesh_.vertex = upload(vertex_[0], vertices);
  mesh_.units_per_cell = plan.units_per_cell;
  mesh_.cells_per_unit = 1 / plan.units_per_cell;

  const Triangle* const triangles = upload(triangle_, plan.triangles);
  std::uint32_t* const end = room(wedge_end_, count);
  RingFacts* const facts = room(facts_, 1);
  Wedge* const wedges = room(wedges_, 3 * plan.triangles.size());
  device_.zero(end, count);
  device_.zero(facts, 1);
  device_.each_counting(plan.triangles.size(), CountWedges{triangles, end});
  device_.each(count, WidestFan{end, facts});
  device_.exclusive_sum(end, end, count);
  device_.each_counting(plan.triangles.size(), PlaceWedges{triangles, end, wedges});
  RingFacts found;
  device_.copy_out(&found, facts, 1);
  const std::uint32_t widest = std::max(found.widest + 1, kMostNeighbours);
  mesh_.row_shift = std::bit_width(widest - 1);
  if (widest > kWidestRow || (count << mesh_.row_shift) >> 32) return false;  // places in rows have 32-bit numbers
  mesh_.rows = room(rows_[0], count << mesh_.row_shift);
  device_.each(count, ChainFan{mesh_, end, wedges, facts});
  device_.copy_out(&found, facts, 1);

  make_arrays(count);
  return found.broken == 0;
}

template <class Device>
void WorkMesh<Device>::load(const HeightGrid& grid, const PlanScale& scale, float* sample_z) {
  const TileOrder order{grid.columns, grid.rows};
  const std::size_t count = std::size_t{grid.columns} * grid.rows;
  ids_ = count;
  triangles_ = std::uint64_t{2} * (grid.columns - 1) * (grid.rows - 1);
  removed_ = 0;
  blocks_ = order.tiles();
  device_.each(blocks_ + 1, StartTile{order, static_cast<std::uint32_t>(count), room(block_start_, blocks_ + 1)});
  mesh_.vertex = room(vertex_[0], count);
  mesh_.units_per_cell = LatticeSamples::kStep;
  mesh_.cells_per_unit = 1 / mesh_.units_per_cell;
  mesh_.row_shift = std::bit_width(kMostNeighbours - 1);
  mesh_.rows = room(rows_[0], count << mesh_.row_shift);
  device_.each(count, TakeNode{mesh_, order, grid.z, scale.middle_z, scale.scale_z, sample_z});
  make_arrays(count);
}

/// What waves keep, and the spare ones.
template <class Device>
void WorkMesh<Device>::make_arrays(std::size_t count) {
  wave_ = {room(cost_[0], count), room(intent_[0], count), room(mark_[0], count), room(planes_[0], count),
           room(lock_, count),    room(spent_, count),     room(into_, count)};
  spare_mesh_ = mesh_;
  spare_wave_ = wave_;
  const std::size_t half = count / 2 + kLeastRoom;
  capacity_ = count;
  spare_capacity_ = half;
  spare_mesh_.vertex = room(vertex_[1], half);
  spare_mesh_.rows = room(rows_[1], half << mesh_.row_shift);
  spare_wave_.cost = room(cost_[1], half);
  spare_wave_.intent = room(intent_[1], half);
  spare_wave_.mark = room(mark_[1], half);
  spare_wave_.planes = room(planes_[1], half);
}

template <class Device>
bool WorkMesh<Device>::close_up() {
  if (ids_ - removed_ > crowded()) return false;
  const Vertices left = alive();
  const std::size_t count = left.count.most;
  std::uint32_t* const number = room(number_, ids_);
  device_.each(count, NumberSurvivor{left.list, number});
  device_.each(count, MoveSurvivor{mesh_, spare_mesh_, left.list, number});
  device_.each(count, MoveWave{wave_, spare_wave_, left.list});
  std::swap(mesh_, spare_mesh_);
  std::swap(wave_, spare_wave_);
  std::swap(capacity_, spare_capacity_);
  ids_ = count;
  removed_ = 0;
  device_.each(ids_, ForgetRounds{wave_});
  return true;
}

template <class Device>
void WorkMesh<Device>::make_room(std::size_t wanted) {
  if (removed_ >= wanted) return;
  const std::size_t more = std::min<std::size_t>(wanted - removed_, capacity_ - std::min(capacity_, ids_));
  device_.each(more, EmptyVertex{mesh_, wave_, static_cast<std::uint32_t>(ids_)});
  ids_ += more;
  removed_ += more;
}

template <class Device>
void WorkMesh<Device>::pack() {
  const Vertices left = alive();
  const std::size_t count = left.count.most;
  std::uint32_t* const number = room(number_, ids_);
  std::uint32_t* const first = room(first_, count);
  Triangle* const triangles = room(triangle_, triangles_);
  device_.each(count, NumberSurvivor{left.list, number});
  device_.each(count, CountOwnTriangles{mesh_, left.list, first});
  device_.exclusive_sum(first, first, count);
  device_.each(count, PackVertex{mesh_, left.list, number, first, room(at_, count), room(z_, count), triangles});
  packed_ = count;
}

template <class Device>
void WorkMesh<Device>::fetch(FittedMesh& to) {
  to.at.resize(packed_);
  to.z.resize(packed_);
  to.triangles.resize(triangles_);
  device_.copy_out(to.at.data(), at_.data(), packed_);
  device_.copy_out(to.z.data(), z_.data(), packed_);
  device_.copy_out(to.triangles.data(), triangle_.data(), triangles_);
}

}  // namespace cordillera::gpu::fit
