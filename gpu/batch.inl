// The batch of a device; included by waves.inl only.
#include "gpu/batch.h"
#include "gpu/waves.h"

namespace cordillera::gpu {

template <class Device>
void Batch<Device>::load(std::span<const SimplifyJob> jobs, const ParallelFor& parallel) {
  stage(jobs, parallel);
  const std::size_t n = vertices_, triangles = triangle_first_.back();
  device_tiles_.reserve(tiles_.size());
  device_.copy_in(device_tiles_.data(), tiles_.data(), tiles_.size());
  std::int32_t* const x = triangles ? upload(x_, host_x_, n) : room(x_, n);
  std::int32_t* const y = triangles ? upload(y_, host_y_, n) : room(y_, n);
  view_ = {x,
           y,
           upload(elevation_, host_elevation_, n),
           room(carried_, n),
           room(spent_, n),
           room(key_, n),
           room(row_, n * kRowWidth),
           room(valence_, n),
           upload(mark_, host_mark_, n),
           room(window_, n),
           room(local_, n)};
  device_.each(n, StartVertex{view_, x, y, tiles()});
  row_width_ = kInnerValence;
  if (triangles) chain_rings(jobs);
}

template <class Device>
void Batch<Device>::stage(std::span<const SimplifyJob> jobs, const ParallelFor& parallel) {
  tiles_.assign(jobs.size(), {});
  vertices_ = 0;
  for (std::size_t t = 0; t < jobs.size(); ++t) {
    tiles_[t].first = static_cast<std::uint32_t>(vertices_);
    tiles_[t].side = jobs[t].input->side;
    tiles_[t].rules = rules_of(jobs[t]);
    tiles_[t].schedule = schedule_of(jobs[t]);
    vertices_ += jobs[t].input->vertices();
  }
  host_elevation_.reserve(vertices_);
  host_mark_.reserve(vertices_);
  parallel(jobs.size(), [&](std::size_t t) {
    tiles_[t].cells = grid_cells(*jobs[t].input);
    std::copy_n(jobs[t].elevation.begin(), jobs[t].input->vertices(), host_elevation_.data() + tiles_[t].first);
    std::copy_n(jobs[t].input->mark.begin(), jobs[t].input->vertices(), host_mark_.data() + tiles_[t].first);
  });
  triangle_first_.assign(1, 0);
  for (std::size_t t = 0; t < jobs.size(); ++t) {
    triangle_first_.push_back(triangle_first_.back() + (tiles_[t].cells > 0 ? 0 : jobs[t].input->triangles.size()));
  }
  if (triangle_first_.back() == 0) return;
  host_x_.reserve(vertices_);
  host_y_.reserve(vertices_);
  host_triangles_.reserve(triangle_first_.back());
  parallel(jobs.size(), [&](std::size_t t) {
    if (tiles_[t].cells == 0) stage_triangles(*jobs[t].input, t);
  });
}

template <class Device>
void Batch<Device>::stage_triangles(const proto::TileMesh& mesh, std::size_t tile) {
  const std::uint32_t first = tiles_[tile].first;
  std::copy(mesh.x.begin(), mesh.x.end(), host_x_.data() + first);
  std::copy(mesh.y.begin(), mesh.y.end(), host_y_.data() + first);
  Triangle* to = host_triangles_.data() + triangle_first_[tile];
  for (const Triangle& t : mesh.triangles) *to++ = {t[0] + first, t[1] + first, t[2] + first};
}

template <class Device>
void Batch<Device>::chain_rings(std::span<const SimplifyJob> jobs) {
  const std::size_t count = triangle_first_.back();
  const Triangle* const triangles = upload(triangles_, host_triangles_, count);
  std::uint32_t* const end = room(wedge_end_, vertices_);
  RingFacts* const facts = room(facts_, 1);
  Wedge* const wedges = room(wedges_, 3 * count);
  device_.zero(end, vertices_);
  device_.zero(facts, 1);
  device_.each(count, CountWedges{triangles, end});
  device_.exclusive_sum(end, end, vertices_);
  device_.each(count, PlaceWedges{triangles, end, wedges});
  device_.each(vertices_, ChainWedges{view_, tiles(), end, wedges, facts});
  RingFacts found;
  device_.copy_out(&found, facts, 1);
  if (found.broken) refuse_broken(jobs);
  row_width_ = std::max(row_width_, found.widest);
}

template <class Device>
std::span<const std::uint32_t> Batch<Device>::alive() {
  std::uint32_t* const list = room(alive_, vertices_);
  return {list, device_.select(vertices_, IsAlive{view_.mark}, list)};
}

template <class Device>
void Batch<Device>::unload() {
  const std::span<const std::uint32_t> survivors = alive();
  const std::uint32_t* const list = survivors.data();
  const std::size_t count = survivors.size();
  std::uint32_t* const valences = room(valences_, count + 1);
  std::uint32_t* const row_start = room(row_start_, count + 1);
  device_.zero(valences + count, 1);
  device_.each(count, NumberSurvivor{view_, list, window_.data(), valences});
  device_.exclusive_sum(valences, row_start, count + 1);
  std::uint32_t neighbours = 0;
  device_.copy_out(&neighbours, row_start + count, 1);
  device_.each(count, PackRow{view_, list, window_.data(), row_start, room(neighbour_, neighbours)});
  host_survivors_.reserve(count);
  host_row_start_.reserve(count + 1);
  host_neighbour_.reserve(neighbours);
  device_.copy_out(host_survivors_.data(), list, count);
  device_.copy_out(host_row_start_.data(), row_start, count + 1);
  device_.copy_out(host_neighbour_.data(), neighbour_.data(), neighbours);
  survivors_count_ = count;
}

template <class Device>
Survivors Batch<Device>::survivors(std::size_t tile) const {
  const std::uint32_t* const all = host_survivors_.data();
  const auto place = [&](std::size_t t) {
    return t == tiles_.size() ? survivors_count_ : static_cast<std::size_t>(std::lower_bound(all, all + survivors_count_, tiles_[t].first) - all);
  };
  const std::size_t from = place(tile), to = place(tile + 1);
  return {{all + from, to - from}, host_row_start_.data() + from, host_neighbour_.data(), static_cast<std::uint32_t>(from), tiles_[tile].first};
}

}  // namespace cordillera::gpu
