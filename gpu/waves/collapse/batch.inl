// The batch of a device; included by waves.inl only.
#include "gpu/waves/collapse/batch.h"
#include "gpu/waves/collapse/waves.h"

namespace cordillera::gpu {

template <class Device>
void Batch<Device>::load(std::span<const SimplifyJob> jobs, const ParallelFor& parallel) {
  stage(jobs, parallel);
  device_.copy_in(room(given_tiles_, tiles_.size()), tiles_.data(), tiles_.size());
  const bool meshes = triangle_first_.back() > 0;
  given_ = {};
  given_.tiles = {given_tiles_.data(), tiles_.size()};
  if (meshes) {
    given_.x = upload(given_x_, host_x_, given_count_);
    given_.y = upload(given_y_, host_y_, given_count_);
  }
  given_.elevation = upload(given_elevation_, host_elevation_, given_count_);
  given_.mark = upload(given_mark_, host_mark_, given_count_);
  if (meshes) upload(triangles_, host_triangles_, triangle_first_.back());
  BatchTile done;
  device_.copy_out(&done, given_tiles_.data(), 1);  // so that stages are told apart
}

template <class Device>
void Batch<Device>::start(std::span<const SimplifyJob> jobs) {
  vertices_ = given_count_;
  const bool all = std::none_of(tiles_.begin(), tiles_.end(), SparseStart::chooses);
  if (!all) choose();
  const std::size_t n = vertices_;
  std::int32_t* const x = room(all ? given_x_ : x_, n);
  std::int32_t* const y = room(all ? given_y_ : y_, n);
  float* const elevation = all ? given_elevation_.data() : room(elevation_, n);
  std::uint8_t* const mark = all ? given_mark_.data() : room(mark_, n);
  view_ = {x,
           y,
           elevation,
           room(carried_, n),
           room(spent_, n),
           room(key_, n),
           room(row_, n * kRowWidth),
           room(valence_, n),
           mark,
           room(window_, n),
           room(local_, n)};
  device_.each(n, StartVertex{given_, view_, x, y, elevation});
  row_width_ = kInnerValence;
  if (triangle_first_.back() > 0) chain_rings(jobs);
}

/// Which vertices the batch starts from, from the smallest triangles up; they are numbered anew.
template <class Device>
void Batch<Device>::choose() {
  std::int32_t most_cells = 0;
  for (const BatchTile& tile : tiles_) most_cells = std::max(most_cells, SparseStart::chooses(tile) ? tile.cells : 0);
  const SparseStart start{given_tiles_.data(), given_.elevation, given_.mark, room(stays_, given_count_)};
  const bool others =
      std::any_of(tiles_.begin(), tiles_.end(), [](const BatchTile& tile) { return !SparseStart::chooses(tile); });
  if (others) device_.each(given_count_, StartsWhole{start.stays});
  device_.each(tiles_.size(), KeepCorners{start});
  for (std::int32_t half = 1; half <= most_cells / 2; half *= 2) {
    over_points(start, half, most_cells, ChooseSides{half});
    over_points(start, half, most_cells, ChooseCentres{half});
  }
  std::uint32_t* const kept = room(kept_, given_count_);
  std::uint32_t* const number = room(number_, given_count_);
  vertices_ = device_.select(given_count_, StaysInStart{start.stays}, kept);
  device_.each(vertices_, NumberKept{kept, number});
  given_.stays = start.stays;
  given_.kept = kept;
  given_.number = number;
  device_.each(tiles_.size(), NumberTile{given_, room(numbered_tiles_, tiles_.size()), static_cast<std::uint32_t>(given_count_),
                                         static_cast<std::uint32_t>(vertices_)});
  device_.each(triangle_first_.back(), NumberTriangle{number, triangles_.data()});
}

template <class Device>
void Batch<Device>::stage(std::span<const SimplifyJob> jobs, const ParallelFor& parallel) {
  tiles_.assign(jobs.size(), {});
  given_count_ = 0;
  for (std::size_t t = 0; t < jobs.size(); ++t) {
    tiles_[t].first = static_cast<std::uint32_t>(given_count_);
    tiles_[t].side = jobs[t].input->side;
    tiles_[t].rules = rules_of(jobs[t]);
    given_count_ += jobs[t].input->vertices();
  }
  host_elevation_.reserve(given_count_);
  host_mark_.reserve(given_count_);
  parallel(jobs.size(), [&](std::size_t t) {
    tiles_[t].cells = grid_cells(*jobs[t].input);
    tiles_[t].start_tolerance_m = jobs[t].start_tolerance_m;
    tiles_[t].any_void = SparseStart::chooses(tiles_[t]) && has_voids(*jobs[t].input);
    std::copy_n(jobs[t].elevation.begin(), jobs[t].input->vertices(), host_elevation_.data() + tiles_[t].first);
    std::copy_n(jobs[t].input->mark.begin(), jobs[t].input->vertices(), host_mark_.data() + tiles_[t].first);
  });
  for (const BatchTile& tile : tiles_) {
    if (SparseStart::chooses(tile) && !std::has_single_bit(static_cast<std::uint32_t>(tile.cells)))
      throw std::invalid_argument("simplifier: start_tolerance_m asks for a full grid of a power of two of cells");
  }
  triangle_first_.assign(1, 0);
  for (std::size_t t = 0; t < jobs.size(); ++t) {
    triangle_first_.push_back(triangle_first_.back() + (tiles_[t].cells > 0 ? 0 : jobs[t].input->triangles.size()));
  }
  if (triangle_first_.back() == 0) return;
  host_x_.reserve(given_count_);
  host_y_.reserve(given_count_);
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
  const Triangle* const triangles = triangles_.data();
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
std::span<const std::uint32_t> Batch<Device>::alive(bool all) {
  std::uint32_t* const list = room(alive_, vertices_);
  if (!all) return {list, device_.select(vertices_, IsAlive{view_.mark}, list)};
  device_.each(vertices_, ListAll{list});
  return {list, vertices_};
}

template <class Device>
void Batch<Device>::unload() {
  const std::span<const std::uint32_t> survivors = alive(false);
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
  const std::uint32_t* original = list;
  if (given_.kept) {
    std::uint32_t* const given = room(given_survivors_, count);
    device_.each(count, GivenSurvivor{given_.kept, list, given});
    original = given;
  }
  device_.copy_out(host_survivors_.data(), original, count);
  device_.copy_out(host_row_start_.data(), row_start, count + 1);
  device_.copy_out(host_neighbour_.data(), neighbour_.data(), neighbours);
  survivors_count_ = count;
}

template <class Device>
Survivors Batch<Device>::survivors(std::size_t tile) const {
  const std::uint32_t* const all = host_survivors_.data();
  const auto place = [&](std::size_t t) {
    return t == tiles_.size() ? survivors_count_
                              : static_cast<std::size_t>(std::lower_bound(all, all + survivors_count_, tiles_[t].first) - all);
  };
  const std::size_t from = place(tile), to = place(tile + 1);
  return {{all + from, to - from},
          host_row_start_.data() + from,
          host_neighbour_.data(),
          static_cast<std::uint32_t>(from),
          tiles_[tile].first};
}

}  // namespace cordillera::gpu
