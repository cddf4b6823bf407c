// Levels above blocks, and what blocks hand out for them; included by engine.inl only.
#include <optional>

#include "gpu/exact/engine.h"

namespace cordillera::gpu::exact {

template <class Executor>
proto::Result<std::vector<BlockMesh>> Engine<Executor>::simplify_above(const Ground& ground, const BlockMesh& start,
                                                                       const BlockPlan& plan, const Watch& follow) {
  if (auto problem = check_call(ground, plan)) return *problem;
  executor_->use(follow.stop);
  proto::StopWatch watch;
  times_ = {};
  Block block;
  block.west = ground.west, block.south = ground.south;
  block.columns = ground.columns, block.rows = ground.rows;
  block.curve = ground.curve, block.curve_up = ground.curve_up;
  block.sample_m = ground.sample_m;
  for (std::size_t side = 0; side < 4; ++side) {  // a vertex there has neighbours on both sides
    if (ground.goes_on[side]) block.sides[side] = SideKind::shared;
  }
  lay_out_blocks({&block, 1}, plan, Holds::squares);
  blocks_[0].keeps_sides = true;
  blocks_[0].field.code_unit = ground.code_unit;
  if (ground.cut_column > 0) blocks_[0].cut_x = ground.cut_column;
  if (ground.cut_row > 0) blocks_[0].cut_y = ground.cut_row;
  std::optional<proto::Result<RingMesh>> rings;
  std::vector<std::uint16_t> to_valid, to_void;
  executor_->parallel(4, [&](std::size_t k) {
    if (k == 0) rings = ring_mesh(start, ground.columns, ground.rows);
    if (k == 1) to_valid = squares_to_valid(ground);
    if (k == 2) to_void = squares_to_void(ground);
    if (k == 3) executor_->use(follow.stop), load_squares(ground.squares);  // a thread of its own
  });
  if (!rings->ok()) return rings->problem();
  load_depths(joined_depths(ground, plan.levels.back().rim_reach, to_valid, to_void));
  sides_.assign(1, {});
  has_shared_sides_ = false;
  whole_blocks_ = blocks_;
  load_curves({&block, 1});
  bound(1);
  load_start(**rings);
  auto levels = run_levels(plan, follow, watch);
  if (!levels.ok()) return levels.problem();
  return std::move(levels->front());
}

/// A ground's. What is read without a copy stays the caller's.
template <class Executor>
void Engine<Executor>::load_squares(const Squares& squares) {
  executor_->copy_in(planes_.data() + places_[0].square[0], squares.plane.data(), squares.plane.size());
  blocks_[0].field.code = executor_->readable(codes_, squares.code.data(), squares.code.size());
  executor_->wait();
}

template <class Executor>
void Engine<Executor>::load_depths(const std::vector<Depth>& depths) {
  Field& field = blocks_[0].field;
  if (!depths.empty()) {
    for (int tier = 0; tier < kTiers; ++tier) field.tier_depth[tier] = tier_depths_.data() + places_[0].square[tier];
    executor_->copy_in(tier_depths_.data() + places_[0].square[0], depths.data(), depths.size());
  }
  executor_->wait();  // what was copied is the caller's
}

/// The blocks' meshes as one, in place of a start of its own.
template <class Executor>
void Engine<Executor>::load_start(const RingMesh& start) {
  vertices_ = start.position.size();
  first_vertex_ = {0, static_cast<std::uint32_t>(vertices_)};
  reserve_vertices();
  executor_->copy_in(mesh_.position.data(), start.position.data(), vertices_);
  executor_->copy_in(mesh_.height.data(), start.height.data(), vertices_);
  executor_->copy_in(mesh_.valence.data(), start.valence.data(), vertices_);
  executor_->copy_in(mesh_.mark.data(), start.mark.data(), vertices_);
  executor_->copy_in(mesh_.ring.data(), start.ring.data(), start.ring.size());
  first_array_.reserve(first_vertex_.size());
  executor_->copy_in(first_array_.data(), first_vertex_.data(), first_vertex_.size());
  times_.start_vertices = vertices_;
  executor_->wait();  // what was copied is the caller's
}

/// Above blocks vertices are few on much ground, and fewer with each level: most of the smallest bins would be empty.
template <class Executor>
void Engine<Executor>::fit_bins() {
  std::vector<std::uint32_t> position(vertices_);
  executor_->copy_out(position.data(), mesh_.position.data(), vertices_);
  bin_shift_ = bin_shift_for(blocks_[0].field, position);
  choose_bin_bits();
  executor_->copy_in(block_array_.data(), blocks_.data(), blocks_.size());
}

template <class Executor>
void Engine<Executor>::bound_triangles(const OwnTriangles& own, std::size_t triangles, float tolerance) {
  bounds_.reserve(triangles);
  executor_->each_run(triangles, BoundTriangle{own, corners_.data(), tolerance, bounds_.data()});
  bound_.resize(triangles);
  executor_->copy_out(bound_.data(), bounds_.data(), triangles);
}

/// Squares of 8 of all blocks, for whoever builds above them.
template <class Executor>
void Engine<Executor>::hand_out_squares(const Watch& follow) {
  if (!follow.squares) return;
  std::vector<std::size_t> first{0};  // of the codes
  for (const BlockView& block : blocks_) first.push_back(first.back() + block.field.squares(0));
  codes_.reserve(64 * first.back());
  std::vector<Squares> known(blocks_.size());
  for (std::size_t b = 0; b < known.size(); ++b)
    executor_->each(first[b + 1] - first[b], CodeSamples{blocks_[b].field, codes_.data() + 64 * first[b]});
  executor_->parallel(known.size(), [&](std::size_t b) {  // to have their memory takes longer than to fill it
    const std::size_t squares = first[b + 1] - first[b];
    known[b].plane.resize(squares);
    known[b].code.resize(64 * squares);
    if (blocks_[b].field.has_voids()) known[b].depth.resize(squares);
  });
  for (std::size_t b = 0; b < known.size(); ++b) {
    Squares& squares = known[b];
    const std::size_t square = places_[b].square[0];
    executor_->copy_out(squares.plane.data(), planes_.data() + square, squares.plane.size());
    executor_->copy_out(squares.code.data(), codes_.data() + 64 * first[b], squares.code.size());
    if (!squares.depth.empty()) executor_->copy_out(squares.depth.data(), tier_depths_.data() + square, squares.depth.size());
    follow.squares(b, std::move(squares));
  }
}

}  // namespace cordillera::gpu::exact
