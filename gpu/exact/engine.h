#pragma once
// The driver of the engine, written once in steps over arrays (engine.inl); an Executor runs the steps. Beyond those of
// gpu/device/host_steps.h (Array<T>, copy_in, copy_out, zero, each, exclusive_sum, group) it has:
//   rows(room, from, columns, rows, stride)   rows of a host's array, where the steps can read them
//   readable(room, from, n)                   likewise n values, until the call ends
//   each_at(columns, rows, f)                 f(x, y) for x in 0..columns-1, y in 0..rows-1
//   each_run(n, f)                            f(i, lanes) for i in 0..n-1, with as many lanes as the executor likes
//   windows(pass, count)                      the windows of a pass
//   select(n, keep, to)                       as in gpu/device/host_steps.h
//   parallel(n, work)                         work(i) on threads of the host
//   use(stop), wait(), name()            stop: windows are left out once it is true; may be null
//   give_back(array)                     what is not needed before the next call
#include "gpu/exact/engine_makers.h"
#include "gpu/exact/ground.h"
#include "gpu/exact/hem.h"
#include "gpu/exact/levels.h"
#include "gpu/exact/steps/bounds.h"
#include "gpu/exact/steps/eight_columns.h"
#include "proto/integers.h"
#include "proto/stop_watch.h"

namespace cordillera::gpu::exact {

/// A host's view of the rows of a block, for the steps.
struct SampleRows {
  const std::int32_t* first = nullptr;
  std::int64_t stride = 0;
};

SideSamples side_samples(const Block& block, Side side);

template <class Executor>
class Engine final : public BlockSimplifier {
 public:
  explicit Engine(std::unique_ptr<Executor> executor) : executor_(std::move(executor)) {}

  proto::Result<std::vector<std::vector<BlockMesh>>> simplify(std::span<const Block> blocks, const BlockPlan& plan,
                                                              const Watch& watch) override;
  proto::Result<std::vector<BlockMesh>> simplify_above(const Ground& ground, const BlockMesh& start, const BlockPlan& plan,
                                                       const Watch& watch) override;
  std::string device() const override { return executor_->name(); }
  const BlockTimes& times() const override { return times_; }

 private:
  template <class T>
  using Array = typename Executor::template Array<T>;

  struct MeshArrays {
    Array<std::uint32_t> position, ring;
    Array<float> height;
    Array<std::uint8_t> valence, mark;
    void reserve(std::size_t vertices) {
      position.reserve(vertices);
      ring.reserve(vertices * kRingWidth);
      height.reserve(vertices);
      valence.reserve(vertices);
      mark.reserve(vertices);
    }
    MeshView view() const { return {position.data(), height.data(), valence.data(), mark.data(), ring.data()}; }
  };
  /// Where a block's samples and squares lie in the arrays of all.
  struct Place {
    std::size_t sample = 0, square[kTiers] = {};
  };

  void begin(std::span<const Block> blocks, const BlockPlan& plan, proto::StopWatch& watch);
  enum class Holds { samples, squares };
  void lay_out_blocks(std::span<const Block> blocks, const BlockPlan& plan, Holds holds);
  void fit_bins();
  void choose_bin_bits();
  void load_squares(const Squares& squares);
  void load_depths(const std::vector<Depth>& depths);
  void load_start(const RingMesh& start);
  proto::Result<std::vector<std::vector<BlockMesh>>> run_levels(const BlockPlan& plan, const Watch& follow,
                                                                proto::StopWatch& watch);
  void hand_out_squares(const Watch& follow);
  void load(std::span<const Block> blocks);
  void load_curves(std::span<const Block> blocks);
  void find_depths(int rim_reach);
  void bound(int first_tier);
  void start(const BlockPlan& plan);
  void reserve_vertices();
  void keep_network(Network net);
  void take_network(std::span<const Network> nets);
  void run_level(const BlockPlan& plan, std::size_t level);
  enum class Windows { all, awake };
  void run_passes(const BlockPlan& plan, const LevelRules& rules, Windows which);
  void read_sides(std::span<const Block> blocks);
  Hems download_hems();
  void hold_hems(const LevelRules& side_rules, int rim_reach);
  void begin_strips(const LevelRules& rules);
  void end_strips();
  std::uint32_t cut(int pass);
  void pack();
  CutView finder() const;
  std::size_t list_triangles(const OwnTriangles& own);
  std::vector<ErrorSums> measure(const OwnTriangles& own, std::size_t triangles, double tolerance);
  void bound_triangles(const OwnTriangles& own, std::size_t triangles, float tolerance);
  void download(std::size_t triangles, std::span<const ErrorSums> errors, double tolerance, std::vector<BlockMesh>& meshes);

  std::unique_ptr<Executor> executor_;
  BlockTimes times_;
  std::vector<BlockView> blocks_;        ///< of the own meshes, which end at hems
  std::vector<BlockView> whole_blocks_;  ///< with the strips beyond
  std::vector<StripSides> sides_;        ///< of the blocks
  bool has_shared_sides_ = false;
  std::vector<Place> places_;
  std::vector<int> largest_square_;
  std::vector<std::uint32_t> first_vertex_, own_first_vertex_;  ///< of the blocks, one more at the end
  std::size_t samples_ = 0, vertices_ = 0;
  std::int64_t lattice_period_ = 1;
  int bin_bits_ = 1, bin_shift_ = kBinShift;
  std::vector<float> bound_;  ///< of the level's triangles, above blocks

  Array<std::int32_t> rows_;
  Array<float> heights_;
  Array<Depth> depths_, tier_depths_;
  Array<std::uint64_t> near_, near_in_row_;  ///< a byte a sample
  Array<std::uint8_t> stays_, calm_;
  Array<BoundingPlane> planes_;
  Array<CurveRow> curves_;
  Array<std::uint32_t> has_voids_, count_, number_;
  Array<BlockView> block_array_;
  MeshArrays mesh_, packed_, own_;
  Array<RingedVertex> hem_;
  Array<std::uint32_t> first_array_, own_first_array_, window_, vertices_by_number_, order_, bin_, bin_count_, bin_first_,
      bin_start_, bin_number_, window_first_, window_block_;
  Array<std::uint16_t> local_;
  Array<std::uint32_t> corners_;
  Array<ErrorSums> errors_;
  Array<float> bounds_;
  Array<std::uint8_t> codes_;
};

}  // namespace cordillera::gpu::exact
