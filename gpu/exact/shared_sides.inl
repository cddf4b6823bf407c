// The part of the driver that works on sides where blocks meet; included by engine.inl only.
namespace cordillera::gpu::exact {

template <class Executor>
void Engine<Executor>::read_sides(std::span<const Block> blocks) {
  sides_.assign(blocks.size(), {});
  has_shared_sides_ = false;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const Block& block = blocks[b];
    StripSides& sides = sides_[b];
    sides.columns = block.columns;
    sides.rows = block.rows;
    sides.lattice_x = blocks_[b].lattice_x;
    sides.lattice_y = blocks_[b].lattice_y;
    for (std::size_t side = 0; side < 4; ++side) sides.shared[side] = block.sides[side] == SideKind::shared;
    has_shared_sides_ = has_shared_sides_ || std::ranges::count(sides.shared, true) > 0;
  }
  if (!has_shared_sides_) return;
  executor_->parallel(4 * blocks.size(), [&](std::size_t k) {
    StripSides& sides = sides_[k / 4];
    const std::size_t side = k % 4;
    if (!sides.shared[side]) return;
    sides.samples[side] = side_samples(blocks[k / 4], static_cast<Side>(side));
    sides.chain[side] = finest_chain(sides.samples[side]);
  });
}

inline SideSamples side_samples(const Block& block, Side side) {
  const bool along_x = side == kSouth || side == kNorth;
  const std::int64_t x = block.west + (side == kEast ? block.columns - 1 : 0),
                     y = block.south + (side == kNorth ? block.rows - 1 : 0);
  SideSamples samples;
  samples.lattice = along_x ? x : y;
  if (!along_x) {
    samples.bend = block.curve_up;
    samples.meridian = block.curve;
  } else if (!block.curve.empty()) {
    const auto row = [&](std::int64_t at) { return block.curve[static_cast<std::size_t>(at - block.south)]; };
    samples.bend = row(y).along;
    samples.on_pole = row(y).is_pole();
    samples.sway = row(!samples.on_pole ? y : side == kNorth ? y - kSideReach : y + kSideReach).north(1);
  }
  for (int r = -kSideReach; r <= kSideReach; ++r) {
    std::vector<std::int32_t>& row = samples.row[static_cast<std::size_t>(r + kSideReach)];
    for (int s = 0; s < (along_x ? block.columns : block.rows); ++s)
      row.push_back(along_x ? block.samples->at(x + s, y + r) : block.samples->at(x + r, y + s));
  }
  return samples;
}

template <class Executor>
Hems Engine<Executor>::download_hems() {
  const CutView of = finder();
  const IsOnHem on_hem{mesh_.view(), block_array_.data(), of};
  const std::size_t count = executor_->select(vertices_, on_hem, vertices_by_number_.data());
  hem_.reserve(count);
  executor_->each(count, TakeHemVertex{mesh_.view(), block_array_.data(), of, vertices_by_number_.data(), hem_.data()});
  std::vector<std::uint32_t> numbers(count);
  Hems hems{std::vector<RingedVertex>(count), {}};
  executor_->copy_out(numbers.data(), vertices_by_number_.data(), count);
  executor_->copy_out(hems.vertices.data(), hem_.data(), count);
  for (const std::uint32_t first : first_vertex_)
    hems.first.push_back(static_cast<std::size_t>(std::ranges::lower_bound(numbers, first) - numbers.begin()));
  return hems;
}

/// Chains of the level, for all sides at once; then what of the hems has to stay.
template <class Executor>
void Engine<Executor>::hold_hems(const LevelRules& side_rules, int rim_reach) {
  executor_->parallel(4 * sides_.size(), [&](std::size_t k) {
    StripSides& sides = sides_[k / 4];
    if (sides.shared[k % 4]) sides.chain[k % 4] = coarser_chain(sides.samples[k % 4], sides.chain[k % 4], side_rules);
  });
  const Hems hems = download_hems();
  std::vector<std::vector<std::uint32_t>> held_of(sides_.size());
  executor_->parallel(sides_.size(), [&](std::size_t b) {
    std::vector<std::uint32_t>& held = held_of[b] = held_on_hem(sides_[b], hems.of(b), rim_reach);
    std::sort(held.begin(), held.end());
    held.erase(std::unique(held.begin(), held.end()), held.end());
  });
  std::vector<std::uint32_t> held;
  for (std::size_t b = 0; b < sides_.size(); ++b) {
    for (const std::uint32_t v : held_of[b]) held.push_back(first_vertex_[b] + v);
  }
  executor_->copy_in(vertices_by_number_.data(), held.data(), held.size());
  executor_->each(held.size(), HoldVertex{vertices_by_number_.data(), mesh_.view()});
  executor_->wait();  // the list is this function's
}

/// Puts the own meshes aside and makes the level's whole meshes of them.
template <class Executor>
void Engine<Executor>::begin_strips(const LevelRules& rules) {
  const Hems hems = download_hems();
  std::vector<Strip> strips(sides_.size());
  executor_->parallel(sides_.size(), [&](std::size_t b) {
    strips[b] = make_strip(sides_[b], hems.of(b), first_vertex_[b + 1] - first_vertex_[b], rules);
  });
  own_first_vertex_ = first_vertex_;
  std::vector<std::size_t> first_changed{0};
  for (std::size_t b = 0; b < strips.size(); ++b) {
    const std::uint32_t own = own_first_vertex_[b + 1] - own_first_vertex_[b];
    first_vertex_[b + 1] = first_vertex_[b] + own + static_cast<std::uint32_t>(strips[b].added.size());
    first_changed.push_back(first_changed.back() + strips[b].added.size() + strips[b].hem.size());
  }
  std::vector<RingedVertex> changed(first_changed.back());
  executor_->parallel(strips.size(), [&](std::size_t b) {
    std::size_t next = first_changed[b];
    for (const auto* list : {&strips[b].added, &strips[b].hem}) {
      for (RingedVertex v : *list) {
        v.vertex += first_vertex_[b];
        for (int k = 0; k < v.valence; ++k) v.ring[k] += first_vertex_[b];
        changed[next++] = v;
      }
    }
  });
  std::swap(mesh_, own_);
  const std::size_t own_vertices = vertices_;
  vertices_ = first_vertex_.back();
  reserve_vertices();
  hem_.reserve(changed.size());
  own_first_array_.reserve(first_vertex_.size());
  std::swap(first_array_, own_first_array_);
  first_array_.reserve(first_vertex_.size());
  executor_->copy_in(first_array_.data(), first_vertex_.data(), first_vertex_.size());
  executor_->copy_in(hem_.data(), changed.data(), changed.size());
  CutView of_own = finder();
  of_own.first_vertex = own_first_array_.data();
  executor_->each(own_vertices, CopyOwn{own_.view(), mesh_.view(), of_own, first_array_.data()});
  executor_->each(changed.size(), PlaceVertex{hem_.data(), mesh_.view()});
  executor_->each(changed.size(), WakeNeighbours{hem_.data(), mesh_.view()});
  executor_->copy_in(block_array_.data(), whole_blocks_.data(), whole_blocks_.size());
  executor_->wait();  // what was copied is this function's
}

template <class Executor>
void Engine<Executor>::end_strips() {
  std::swap(mesh_, own_);
  std::swap(first_array_, own_first_array_);
  first_vertex_ = own_first_vertex_;
  vertices_ = first_vertex_.back();
  executor_->copy_in(block_array_.data(), blocks_.data(), blocks_.size());
}

}  // namespace cordillera::gpu::exact
