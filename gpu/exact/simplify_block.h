#pragma once
// Blocks of terrain simplified so that no sample is farther than a level's tolerance from the level's mesh, measured, before and
// after every step: there is nothing to check and nothing to repair afterwards. One source for CPU and CUDA, the same bits from
// both.
#include <array>
#include <atomic>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "gpu/exact/steps/field.h"
#include "gpu/simplify.h"
#include "proto/mesh.h"
#include "proto/result.h"

namespace cordillera::gpu::exact {

/// Sides of a block, in this order wherever there are four of something.
enum Side { kSouth, kEast, kNorth, kWest };

/// What lies beyond a side.
enum class SideKind : std::uint8_t {
  outer,   ///< nothing: the side is simplified along itself, like a tile's side
  shared,  ///< another block, of which it is one whole side too: both get the same vertices there, bit for bit, without seeing
           ///< each other
};

/// A rectangle of lattice samples. Borrowed for the call.
struct Block {
  /// Holds the rectangle, and three rows more beyond every shared side.
  const proto::Samples* samples = nullptr;
  std::int64_t west = 0, south = 0;    ///< its first sample, on the lattice
  std::int32_t columns = 0, rows = 0;  ///< samples, 2 .. kMostSamples each, ends included
  /// South, east, north, west. A block with a shared side has 17 samples or more each way, and shared sides are sides of tiles of
  /// level 0.
  std::array<SideKind, 4> sides{};
  /// What the curvature of the earth is to a flat triangle: over (u, v) samples from a corner its height is that of a plane, and
  /// along * u * u + up * v * v (kHeightStep_m, not below 0), but for what its edges sway from their lines on the lattice.
  /// Indexed by row, functions of the row's latitude alone, so that blocks that share a side agree; empty: flat.
  std::span<const CurveRow> curve{};
  float curve_up = 0;
  double sample_m = 1;  ///< from row to row, at the least: what a level's rounding is measured in
};
inline constexpr std::int32_t kMostSamples = 16385;  ///< each way
inline constexpr std::int32_t kMostAbove = 65536;    ///< likewise, of a ground
inline constexpr int kMostRimReach = 12;

enum class Quality { fast, standard, best };  ///< heights of vertices are fitted never, once, twice a pass

/// A level of all blocks of a call; index 0 is the finest.
struct BlockLevel {
  /// Metres, > 0: no valid sample is farther from the level's mesh, along the vertical. At least that of the finer level, plus
  /// half of height_step where that grows.
  double tolerance_m = 0;
  std::int32_t height_step = 1;  ///< of vertices, in proto::kHeightStep_m: a power of two, at most a quarter of the tolerance, no
                                 ///< less than the finer level's
  /// Rims may move by 2^rim_reach samples, in columns and in rows; -1: not at all. No less than the finer level's, up to
  /// kMostRimReach.
  int rim_reach = -1;
  /// On shared sides, where it is another one than inside; 0: the same. Blocks that share a side must be given the same one.
  double side_tolerance_m = 0;
  /// Collapses leave no triangle that is narrower than this across its longest extent, in metres: what rounding of corners may
  /// turn over.
  double rounding_m = 0;
  bool operator==(const BlockLevel&) const = default;
};

/// What the level above `finer` may ask at the least, with this height step.
inline double least_tolerance_m(const BlockLevel& finer, std::int32_t height_step) {
  return finer.tolerance_m + (height_step > finer.height_step ? 0.5 * height_step * proto::kHeightStep_m : 0);
}

struct BlockPlan {
  std::int32_t tile_side = 256;    ///< samples from side to side of a tile of level 0, a power of two; doubled a level
  std::vector<BlockLevel> levels;  ///< 1 .. 22
  Quality quality = Quality::standard;
  int known_reach =
      -1;  ///< of rims, for the squares that are handed out: up to 2^known_reach samples, or what the last level asks
  bool measured = true;  ///< false: errors of meshes are left out, for whoever measures them otherwise
  bool operator==(const BlockPlan&) const = default;
};

/// A level of a block. Its triangles cover the rectangle exactly, counter-clockwise, all of positive area, none across a line
/// where tiles of the level meet (lattice multiples of tile_side << level). A triangle is to be published iff none of its corners
/// is void. Rims move as far as the level allows: every valid sample farther than that from a void one is
/// covered by published triangles, and no void sample farther than that from a valid one.
struct BlockMesh {
  std::vector<std::uint16_t> x, y;    ///< indexed by vertex: samples from the block's south-western one
  std::vector<std::int32_t> height;   ///< indexed by vertex, kHeightStep_m, a multiple of the level's height_step; void: 0
  std::vector<std::uint8_t> is_void;  ///< indexed by vertex, 0 or 1
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< in the order of their least vertex
  std::vector<float>
      bound;  ///< above blocks, indexed by triangle: no valid sample under it, if it is published, is farther, 2^-10 m
  double max_error_m = 0;      ///< of the valid samples under published triangles, in doubles; see BlockPlan::measured
  double rmse_m = 0;           ///< of the same, but for some on the rims of voids
  std::uint64_t measured = 0;  ///< how many those are

  std::size_t vertices() const { return x.size(); }
};

/// Of every square of 8 samples, row-major from the south-western one: a plane, how far its samples are from it, and from a rim.
struct Squares {
  std::vector<BoundingPlane> plane;
  std::vector<std::uint8_t> code;  ///< 64 each, see coded.h
  std::vector<Depth> depth;        ///< empty: there are no voids
};
/// A rectangle of the lattice above blocks, in place of its samples. Squares of the last columns and rows reach beyond it.
struct Ground {
  std::int64_t west = 0, south = 0;
  std::int32_t columns = 0, rows = 0;  ///< samples, 2 .. kMostAbove each
  /// Sides beyond which the mesh goes on, in another call or around the earth: the start has the same vertices on both sides of
  /// them. These keep their places, so that they stay the same. South, east, north, west.
  std::array<bool, 4> goes_on{};
  /// A column and a row inside of it where other calls will be cut; 0: none. Vertices there stay so few-edged that the line can
  /// become a side. Sides of tiles of all levels lie on these lines, and on sides that go on; samples from the first ones are
  /// multiples of 8.
  std::int32_t cut_column = 0, cut_row = 0;
  Squares squares;
  float code_unit = 0;  ///< of their codes, 2^-10 m: what they were made coarser by (coarser_code); 0: they were not
  std::span<const CurveRow> curve{};  ///< see Block, as what follows
  float curve_up = 0;
  double sample_m = 1;

  std::size_t across() const { return static_cast<std::size_t>((columns - 1) / 8 + 1); }
  std::size_t up() const { return static_cast<std::size_t>((rows - 1) / 8 + 1); }
};

/// How a call is followed while it runs.
struct Watch {
  const std::atomic<bool>* stop = nullptr;  ///< once true, the call ends soon, with the problem "cancelled"
  /// A level is done, the finest first; called by the caller's thread. What it takes out of meshes, indexed by block, is not in
  /// the result.
  std::function<void(std::size_t level, std::vector<BlockMesh>& meshes)> level;
  /// Squares of a block, before its first level.
  std::function<void(std::size_t block, Squares&& squares)> squares;
};

/// What a level cost, all blocks together.
struct LevelTime {
  double simplify_s = 0, measure_s = 0, download_s = 0;
};
struct BlockTimes {
  double load_s = 0, bounds_s = 0, start_s = 0;
  std::vector<LevelTime> levels;
  std::uint64_t start_vertices = 0;
};

/// One thread at a time; keeps its memory from call to call.
class BlockSimplifier {
 public:
  virtual ~BlockSimplifier() = default;
  /// result[b][l] is level l of blocks[b]. It depends on the block and the plan alone: not on what else is in the call, the
  /// device or the number of threads. A plan or block outside of its ranges is a Problem ("option-invalid"). A GPU that fails is
  /// a DeviceLost: ask another simplifier.
  virtual proto::Result<std::vector<std::vector<BlockMesh>>> simplify(std::span<const Block> blocks, const BlockPlan& plan,
                                                                      const Watch& watch = {}) = 0;
  /// result[l] is a level above blocks, from their meshes as one, `start`. What is known of the ground is all that is asked:
  /// triangles that the start has may be farther from samples than the first level's tolerance only if they were in it.
  virtual proto::Result<std::vector<BlockMesh>> simplify_above(const Ground& ground, const BlockMesh& start,
                                                               const BlockPlan& plan, const Watch& watch = {}) = 0;
  virtual std::string device() const = 0;       ///< "cpu" or "cuda:0 (NVIDIA …)"
  virtual const BlockTimes& times() const = 0;  ///< of the last call
};

/// "auto", "cpu", "cuda", "cuda:N", as for make_simplifier. parallel: for loops on the host.
proto::Result<std::unique_ptr<BlockSimplifier>> make_block_simplifier(const std::string& device,
                                                                      ParallelFor parallel = one_after_the_other);

}  // namespace cordillera::gpu::exact
