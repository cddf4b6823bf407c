// The driver of the engine; included by engine_host.cpp and engine_cuda.cu only.
#include <algorithm>

#include "gpu/exact/above_blocks.inl"
#include "gpu/exact/engine.h"
#include "gpu/exact/level_results.inl"
#include "gpu/exact/shared_sides.inl"

namespace cordillera::gpu::exact {

inline constexpr int kPasses = 3;
/// Waves of all passes but the last end when fewer than one vertex in so many goes: the next pass has other windows.
inline constexpr int kIdleShare = 64;

template <class Executor>
proto::Result<std::vector<std::vector<BlockMesh>>> Engine<Executor>::simplify(std::span<const Block> blocks,
                                                                              const BlockPlan& plan, const Watch& follow) {
  if (auto problem = check_call(blocks, plan)) return *problem;
  executor_->use(follow.stop);
  proto::StopWatch watch;
  begin(blocks, plan, watch);
  hand_out_squares(follow);
  return run_levels(plan, follow, watch);
}

template <class Executor>
proto::Result<std::vector<std::vector<BlockMesh>>> Engine<Executor>::run_levels(const BlockPlan& plan, const Watch& follow,
                                                                                proto::StopWatch& watch) {
  const auto stopped = [&follow] { return follow.stop && *follow.stop; };
  const proto::Problem cancelled{"cancelled", "the call was stopped", "", ""};
  const std::size_t blocks = blocks_.size();
  const bool has_samples = blocks_[0].field.height != nullptr;
  std::vector<std::vector<BlockMesh>> results(blocks, std::vector<BlockMesh>(plan.levels.size()));
  std::vector<BlockMesh> meshes(blocks);
  for (std::size_t l = 0; l < plan.levels.size(); ++l) {
    LevelTime time;
    if (stopped()) return cancelled;
    const double tolerance = plan.levels[l].tolerance_m / proto::kHeightStep_m;
    if (!has_samples) fit_bins();
    run_level(plan, l);
    executor_->wait();
    if (stopped()) return cancelled;
    time.simplify_s = watch.lap();
    const OwnTriangles own{mesh_.view(), block_array_.data(), finder()};
    const std::size_t triangles = list_triangles(own);
    const std::vector<ErrorSums> errors =
        plan.measured && has_samples ? measure(own, triangles, tolerance) : std::vector<ErrorSums>(blocks);
    if (!has_samples) bound_triangles(own, triangles, static_cast<float>(tolerance));
    time.measure_s = watch.lap();
    download(triangles, errors, tolerance, meshes);
    if (follow.level) follow.level(l, meshes);
    for (std::size_t b = 0; b < blocks; ++b) results[b][l] = std::move(meshes[b]);
    if (has_shared_sides_) end_strips();
    time.download_s = watch.lap();
    times_.levels.push_back(time);
  }
  return results;
}

/// All that comes before the first level.
template <class Executor>
void Engine<Executor>::begin(std::span<const Block> blocks, const BlockPlan& plan, proto::StopWatch& watch) {
  times_ = {};
  lay_out_blocks(blocks, plan, Holds::samples);
  load(blocks);
  load_curves(blocks);
  // What is next to a rim is asked everywhere.
  find_depths(std::max({0, plan.levels.back().rim_reach, plan.known_reach}));
  executor_->wait();
  times_.load_s = watch.lap();
  bound(0);
  executor_->wait();
  times_.bounds_s = watch.lap();
  start(plan);
  executor_->wait();
  times_.start_s = watch.lap();
  times_.start_vertices = vertices_;
}

// ---- samples and what is known of them

template <class Executor>
void Engine<Executor>::lay_out_blocks(std::span<const Block> blocks, const BlockPlan& plan, Holds holds) {
  blocks_.assign(blocks.size(), {});
  places_.assign(blocks.size(), {});
  largest_square_.assign(blocks.size(), 1);
  lattice_period_ = std::int64_t{plan.tile_side} << (plan.levels.size() - 1);
  samples_ = 0;
  std::size_t squares = 0;
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    BlockView& view = blocks_[b];
    Field& field = view.field;
    field.columns = blocks[b].columns;
    field.rows = blocks[b].rows;
    field.stride = (field.columns + 7) / 8 * 8;
    view.east = field.columns - 1;
    view.north = field.rows - 1;
    for (std::size_t side = 0; side < 4; ++side) view.sides_held |= blocks[b].sides[side] == SideKind::shared ? 1u << side : 0u;
    view.sample_m = blocks[b].sample_m;
    view.lattice_x = static_cast<std::int32_t>(proto::modulo(blocks[b].west, lattice_period_));
    view.lattice_y = static_cast<std::int32_t>(proto::modulo(blocks[b].south, lattice_period_));
    places_[b].sample = samples_;
    if (holds == Holds::samples) samples_ += static_cast<std::size_t>(field.stride) * static_cast<std::size_t>(field.rows);
    for (int tier = 0; tier < kTiers; ++tier) {
      field.tier_stride[tier] = ((field.columns - 1) >> tier_shift(tier)) + 1;
      places_[b].square[tier] = squares;
      squares += field.squares(tier);
    }
    // Squares of the start lie within tiles and fill the block.
    const std::int32_t sides =
        (field.columns - 1) | (field.rows - 1) | view.lattice_x | view.lattice_y | plan.tile_side | kLargestSquare;
    largest_square_[b] = sides & -sides;
  }
  bin_shift_ = kBinShift;
  choose_bin_bits();
  heights_.reserve(samples_ + kReadBeyond);
  depths_.reserve(samples_);
  planes_.reserve(squares);
  tier_depths_.reserve(squares);
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (holds == Holds::samples) blocks_[b].field.height = heights_.data() + places_[b].sample;
    for (int tier = 0; tier < kTiers; ++tier) blocks_[b].field.plane[tier] = planes_.data() + places_[b].square[tier];
  }
}

template <class Executor>
void Engine<Executor>::choose_bin_bits() {
  bin_bits_ = 1;
  for (BlockView& view : blocks_) {
    const int bits = bin_bits_of(view.field, bin_shift_);
    view.third = (1u << bits) / 3;
    bin_bits_ = std::max(bin_bits_, bits);
  }
}

template <class Executor>
void Engine<Executor>::load(std::span<const Block> blocks) {
  has_voids_.reserve(blocks.size());
  executor_->zero(has_voids_.data(), blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    const proto::Samples& samples = *blocks[b].samples;
    const Field& field = blocks_[b].field;
    const std::int32_t* const from =
        samples.height.data() + ((blocks[b].south - samples.south) * samples.columns + (blocks[b].west - samples.west));
    const SampleRows rows = executor_->rows(rows_, from, field.columns, field.rows, samples.columns);
    executor_->each_at(
        field.stride, field.rows,
        LoadSample{rows.first, rows.stride, heights_.data() + places_[b].sample, depths_.data() + places_[b].sample,
                   has_voids_.data() + b, field.columns, field.rows, field.stride});
  }
  std::vector<std::uint32_t> has_voids(blocks.size());
  executor_->copy_out(has_voids.data(), has_voids_.data(), blocks.size());
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    if (!has_voids[b]) continue;
    blocks_[b].field.depth = depths_.data() + places_[b].sample;
    for (int tier = 0; tier < kTiers; ++tier) blocks_[b].field.tier_depth[tier] = tier_depths_.data() + places_[b].square[tier];
  }
  read_sides(blocks);
  whole_blocks_ = blocks_;
  for (BlockView& own : blocks_) {
    const auto inset = [&own](Side side) { return (own.sides_held >> side & 1) != 0 ? kHemRow : 0; };
    own.south += inset(kSouth);
    own.east -= inset(kEast);
    own.north -= inset(kNorth);
    own.west += inset(kWest);
  }
}

template <class Executor>
void Engine<Executor>::load_curves(std::span<const Block> blocks) {
  std::vector<CurveRow> all;
  for (const Block& block : blocks) all.insert(all.end(), block.curve.begin(), block.curve.end());
  curves_.reserve(all.size());
  executor_->copy_in(curves_.data(), all.data(), all.size());
  const CurveRow* row = curves_.data();
  for (std::size_t b = 0; b < blocks.size(); ++b) {
    blocks_[b].field.curve = whole_blocks_[b].field.curve = {blocks[b].curve.empty() ? nullptr : row, blocks[b].curve_up};
    row += blocks[b].curve.size();
  }
  executor_->wait();  // what was copied is this function's
}

template <class Executor>
void Engine<Executor>::find_depths(int rim_reach) {
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Field& field = blocks_[b].field;
    if (!field.depth) continue;
    const std::size_t samples = static_cast<std::size_t>(field.stride) * static_cast<std::size_t>(field.rows);
    near_.reserve(samples / 8);
    near_in_row_.reserve(samples / 8);
    const int words = field.stride / 8;
    Depth* const depth = depths_.data() + places_[b].sample;
    executor_->each(samples, MarkKinds{depth, reinterpret_cast<std::uint8_t*>(near_.data())});
    for (int r = 0; r <= rim_reach; ++r) {
      const int reach = r == 0 ? 1 : 1 << (r - 1);
      executor_->each_at(words, field.rows, NearInRow{field, reach, false, near_.data(), near_in_row_.data()});
      executor_->each_at(words, field.rows, NearInRow{field, reach, true, near_in_row_.data(), near_.data()});
      executor_->each(samples / 8, LowerDepth{near_.data(), r, depth});
    }
  }
}

template <class Executor>
void Engine<Executor>::bound(int first_tier) {
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Field& field = blocks_[b].field;
    for (int tier = first_tier; tier < kTiers; ++tier) {
      BoundingPlane* const plane = planes_.data() + places_[b].square[tier];
      Depth* const depth = field.has_voids() ? tier_depths_.data() + places_[b].square[tier] : nullptr;
      if (tier == 0)
        executor_->each(field.squares(tier), BoundSamples{field, plane, depth});
      else
        executor_->each(field.squares(tier), BoundSquares{field, tier, plane, depth});
    }
  }
  block_array_.reserve(blocks_.size());
  executor_->copy_in(block_array_.data(), blocks_.data(), blocks_.size());
}

// ---- the start

template <class Executor>
void Engine<Executor>::start(const BlockPlan& plan) {
  stays_.reserve(samples_);
  std::vector<Network> nets;
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const auto tolerance = static_cast<float>(plan.levels[0].tolerance_m / proto::kHeightStep_m);
    nets.push_back({blocks_[b].field,
                    nullptr,
                    stays_.data() + places_[b].sample,
                    largest_square_[b],
                    {kStartShare * tolerance, plan.levels[0].rim_reach, blocks_[b].field.curve},
                    static_cast<float>(plan.levels[0].height_step),
                    1 / static_cast<float>(plan.levels[0].height_step),
                    blocks_[b].west,
                    blocks_[b].east,
                    blocks_[b].south,
                    blocks_[b].north,
                    blocks_[b].sides_held});
    keep_network(nets.back());
  }
  take_network(nets);
}

template <class Executor>
void Engine<Executor>::keep_network(Network net) {
  const Field& field = net.field;
  const auto across = [&field](int shift) { return calm_squares(field.columns, shift); };
  const auto up = [&field](int shift) { return calm_squares(field.rows, shift); };
  calm_.reserve(static_cast<std::size_t>(across(kCalmShift)) * static_cast<std::size_t>(up(kCalmShift)));
  executor_->each_at(across(kCalmShift), up(kCalmShift), CalmSquares{net, calm_.data()});
  net.calm = calm_.data();
  executor_->each_at(field.stride, field.rows, MarkSquares{net});
  for (int half = 1; half < net.largest; half *= 2) {
    if (2 * half > 1 << net.calm_shift) {
      ++net.calm_shift;
      executor_->each_at(across(net.calm_shift), up(net.calm_shift), CalmAreas{net, net.calm_shift, calm_.data()});
    }
    const int columns = (field.columns - 1) / half + 1, rows = (field.rows - 1) / half + 1;
    executor_->each_at(columns, rows, KeepMiddles{net, half});
    executor_->each_at(columns, rows, KeepCentres{net, half});
  }
}

template <class Executor>
void Engine<Executor>::take_network(std::span<const Network> nets) {
  number_.reserve(samples_ + 1);
  for (std::size_t b = 0; b < nets.size(); ++b) {
    executor_->each_at(nets[b].field.stride, nets[b].field.rows, CountStays{nets[b], number_.data() + places_[b].sample});
  }
  executor_->zero(number_.data() + samples_, 1);
  executor_->exclusive_sum(number_.data(), number_.data(), samples_ + 1);
  first_vertex_.resize(nets.size() + 1);
  for (std::size_t b = 0; b <= nets.size(); ++b) {
    executor_->copy_out(&first_vertex_[b], number_.data() + (b < nets.size() ? places_[b].sample : samples_), 1);
  }
  vertices_ = first_vertex_.back();
  mesh_.reserve(vertices_);
  for (std::size_t b = 0; b < nets.size(); ++b) {
    executor_->each_at(nets[b].field.stride, nets[b].field.rows,
                       TakeVertex{nets[b], number_.data() + places_[b].sample, mesh_.view()});
  }
  first_array_.reserve(nets.size() + 1);
  executor_->copy_in(first_array_.data(), first_vertex_.data(), first_vertex_.size());
  for (auto* array : {&near_, &near_in_row_}) executor_->give_back(*array);
  for (auto* array : {&stays_, &calm_}) executor_->give_back(*array);
  executor_->give_back(number_);
  reserve_vertices();
}

template <class Executor>
void Engine<Executor>::reserve_vertices() {
  mesh_.reserve(vertices_);
  for (auto* array : {&count_, &number_}) array->reserve(vertices_ + 1);
  for (auto* array : {&window_, &vertices_by_number_, &order_, &bin_}) array->reserve(vertices_);
  local_.reserve(vertices_);
}

// ---- a level

template <class Executor>
void Engine<Executor>::run_level(const BlockPlan& plan, std::size_t l) {
  const BlockLevel& level = plan.levels[l];
  const auto steps = [](double metres) { return static_cast<float>(metres / proto::kHeightStep_m); };
  const LevelRules rules{steps(level.tolerance_m), static_cast<float>(level.height_step), plan.tile_side << l, level.rim_reach,
                         level.rounding_m};
  executor_->each(vertices_, BeginLevel{mesh_.view(), rules.height_step});
  if (has_shared_sides_) {
    LevelRules of_sides = rules;
    if (level.side_tolerance_m > 0) of_sides.tolerance = steps(level.side_tolerance_m);
    hold_hems(of_sides, plan.levels.back().rim_reach);
  }
  run_passes(plan, rules, Windows::all);
  if (!has_shared_sides_) return;
  begin_strips(rules);
  run_passes(plan, rules, Windows::awake);
}

template <class Executor>
void Engine<Executor>::run_passes(const BlockPlan& plan, const LevelRules& rules, Windows which) {
  for (int number = 0; number < kPasses; ++number) {
    const std::uint32_t windows = cut(number);
    PassView pass;
    pass.mesh = mesh_.view();
    pass.blocks = block_array_.data();
    pass.window = window_.data();
    pass.local = local_.data();
    pass.order = order_.data();
    pass.first = window_first_.data();
    pass.block_of = window_block_.data();
    pass.rules = rules;
    pass.idle_share = number + 1 < kPasses ? kIdleShare : 0;
    pass.height_rounds = static_cast<int>(plan.quality);
    pass.rest = which == Windows::awake;
    executor_->windows(pass, windows);
    pack();
  }
}

template <class Executor>
CutView Engine<Executor>::finder() const {
  CutView cut;
  cut.mesh = mesh_.view();
  cut.first_vertex = first_array_.data();
  cut.blocks = static_cast<std::uint32_t>(blocks_.size());
  cut.bits = bin_bits_;
  cut.bin_shift = bin_shift_;
  return cut;
}

template <class Executor>
std::uint32_t Engine<Executor>::cut(int pass) {
  CutView cut = finder();
  cut.views = block_array_.data();
  cut.pass = pass;
  const std::size_t bins = cut.bins();
  for (auto* array : {&bin_count_, &bin_first_, &bin_start_, &bin_number_}) array->reserve(bins + 1);
  cut.bin = bin_.data();
  cut.count = bin_count_.data();
  cut.first = bin_first_.data();
  cut.start = bin_start_.data();
  cut.number = bin_number_.data();
  executor_->zero(cut.count, bins + 1);
  executor_->each(vertices_, SortIntoBins{cut});
  executor_->exclusive_sum(cut.count, cut.first, bins + 1);
  executor_->zero(cut.count, bins + 1);
  executor_->each(bins, FindStart{cut});
  executor_->exclusive_sum(cut.count, cut.number, bins + 1);
  std::uint32_t windows = 0;
  executor_->copy_out(&windows, cut.number + bins, 1);
  window_first_.reserve(windows + 1);
  window_block_.reserve(windows + 1);
  executor_->each(bins + 1, NumberWindows{cut, window_first_.data(), window_block_.data()});
  executor_->each(vertices_, NameWindow{cut, window_.data(), vertices_by_number_.data()});
  executor_->group({vertices_by_number_.data(), vertices_}, window_.data(), {window_first_.data(), std::size_t{windows} + 1},
                   order_.data());
  return windows;
}

template <class Executor>
void Engine<Executor>::pack() {
  executor_->each(vertices_ + 1, CountAlive{mesh_.view(), vertices_, count_.data()});
  executor_->exclusive_sum(count_.data(), number_.data(), vertices_ + 1);
  executor_->each(first_vertex_.size(), PackBlock{number_.data(), first_array_.data()});
  executor_->copy_out(first_vertex_.data(), first_array_.data(), first_vertex_.size());
  packed_.reserve(first_vertex_.back());
  executor_->each(vertices_, PackVertex{mesh_.view(), packed_.view(), number_.data()});
  vertices_ = first_vertex_.back();
  std::swap(mesh_, packed_);
}

}  // namespace cordillera::gpu::exact
