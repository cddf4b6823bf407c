#pragma once
// The vertices of a side where two blocks meet. Both blocks find them without each other: they are a function of the side's
// samples, of the three rows on both sides of it, of the levels' rules and of the finer level's chain.
//
// Between two adjacent rows there are no samples. So wherever the chords of both rows keep the tolerance along their own rows,
// any triangulation between them keeps it: what is made of chords of rows 0 to 3 needs no measuring.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "gpu/exact/steps/mesh.h"
#include "proto/mesh.h"

namespace cordillera::gpu::exact {

/// Of a tile's side where all rows are void: what neighbours that are not there are taken to have.
inline constexpr int kVoidChords = 32;
inline constexpr int kSideReach = 3;            ///< rows on either side that a chain looks at
inline constexpr int kHemRow = kSideReach + 1;  ///< where a block's own mesh ends

/// Rows -3 .. 3 of a side, counted to the north or to the east; each from south or west.
struct SideSamples {
  static constexpr int kRows = 2 * kSideReach + 1;
  std::array<std::vector<std::int32_t>, kRows> row;  ///< proto::kNoHeight where void
  std::int64_t lattice = 0;                          ///< of the first sample, along the side
  double bend = 0;                                   ///< of a chord, see Curve
  double sway = 0;                                   ///< likewise; of a side along a meridian 0
  std::span<const CurveRow> meridian{};              ///< of a side along one: its rows. Borrowed
  bool on_pole = false;                              ///< the side is one point, and keeps one height

  int length() const { return static_cast<int>(row[0].size()) - 1; }
  bool is_void(int r, int s) const { return row[static_cast<std::size_t>(r)][static_cast<std::size_t>(s)] == proto::kNoHeight; }
  std::int32_t height(int r, int s) const { return row[static_cast<std::size_t>(r)][static_cast<std::size_t>(s)]; }
};

/// Vertices at the same places of all rows, the side's ends among them. On each row a chord has valid samples alone, or void ones
/// alone; one that is void on all rows is no longer than a 32nd of a tile's side, from a multiple of that.
struct SideChain {
  std::vector<int> place;                                            ///< ascending
  std::array<std::vector<std::int32_t>, SideSamples::kRows> height;  ///< indexed by row, then like place; void: 0

  /// On the chord over s, a multiple of step; of row r. bend: see SideSamples.
  std::int32_t height_at(int r, int s, double bend, std::int32_t step) const;
};

/// All samples of the side.
SideChain finest_chain(const SideSamples& samples);
/// What a level leaves of the finer level's chain (of the finest one, for level 0).
SideChain coarser_chain(const SideSamples& samples, const SideChain& finer, const LevelRules& rules);

}  // namespace cordillera::gpu::exact
