#pragma once
// Border chains of waves and other strategies that simplify tile by tile. The default, exact, chooses its own in
// gpu/exact/side_chain.h; of what stands here it uses the types and void_chain, to join blocks.
//
// What stays of a tile edge is a function of that edge alone, so that both tiles on it keep the same vertices.
//
// An edge at level z is a straight run of tile_units(z) + 1 lattice vertices, counted from its western or southern end. Its chain
// at the finest level is chosen among all samples, at every other level among the survivors of its two child edges (chains are
// nested).
#include <cstdint>
#include <span>
#include <vector>

#include "proto/lattice.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// The four sides of a tile.
enum class Side : std::uint8_t { west, east, south, north };

/// Which way an edge runs on the lattice.
enum class Along : std::uint8_t { east, north };

struct Edge {
  const proto::Lattice* lattice = nullptr;
  std::int64_t column = 0;  ///< lattice vertex of the western or southern end
  std::int64_t row = 0;
  Along along = Along::east;
  std::int64_t units = 0;  ///< lattice cells from end to end
};
Edge edge_of(const proto::Lattice& lattice, const proto::TileAddress& tile, Side side);

/// How far beside an edge of a level rims are looked for: a cell that it may be moved by, and one more. So far a block reads
/// around itself.
inline std::int64_t rim_reach(const proto::Lattice& lattice, int level) { return 2 * lattice.cell_units(level); }

/// The vertices that stay on an edge. Both ends are always there.
struct Chain {
  std::vector<std::int32_t> position;  ///< strictly ascending, first 0, last Edge::units
  std::vector<std::int32_t> height;    ///< indexed as position: kHeightStep_m, kNoHeight where void
  std::uint32_t dropped_runs = 0;      ///< runs too short for this level, see ChainRule::rim_units
  friend bool operator==(const Chain& a, const Chain& b) { return a.position == b.position && a.height == b.height; }
};

/// What a level asks of its chains.
struct ChainRule {
  double tolerance_m = 0;          ///< no sample may be farther from its chord, along the ellipsoid's normal
  std::int32_t rim_units = 0;      ///< runs of data or of void shorter than this vanish, unless they touch an end; 0: none do
  std::int32_t max_gap_units = 0;  ///< longest chord between two valid vertices where something lies between; 0: any
  /// Void vertices at multiples of this stay: nobody sees them, and dense rims beside an edge need something to hold on to. Twice
  /// as much a level upwards, so that chains stay nested. 0: one vertex a run.
  std::int32_t void_gap_units = 0;
  /// The same on a pole's row, which is one point, for all vertices: the row beside it is all around it, and no vertex can have
  /// it all.
  std::int32_t pole_gap_units = 1;
};

/// Finest samples that significance is measured against, at positions first, first + 1, ...; kNoHeight where void, and there is
/// no data beyond them; empty: not at hand. Lines beside the edge are witnesses: where terrain next to a plain edge is rough, the
/// edge keeps vertices for the triangles that must end there. Both tiles on the edge see the same lines.
struct EdgeHeights {
  struct Line {
    std::int64_t offset = 0;            ///< units north (east) of the edge, or south (west) when negative
    std::vector<std::int32_t> heights;  ///< as many as the edge's
  };
  std::int64_t first = 0;
  std::span<const std::int32_t> edge;
  std::span<const Line> beside;
  /// As many as the edge's: how far it is straight across the edge, on either side, to where there is no data; more than reach:
  /// farther than was looked. Empty: nowhere. Vertices stay where that falls below a cell of the level, below two, four, ..., and
  /// below reach: from a chord that ran on, a slit would go along the edge to the rim beside it. Chains are nested, so a level
  /// keeps what coarser levels of its block will need.
  std::span<const std::int32_t> to_void;
  std::int64_t cell = 1, reach = 0;

  EdgeHeights() = default;
  EdgeHeights(std::span<const std::int32_t> line) : edge(line) {}     // NOLINT: implicit on purpose
  EdgeHeights(const std::vector<std::int32_t>& line) : edge(line) {}  // NOLINT: implicit on purpose
};

/// From every sample of the edge: heights.first is 0, and there are units + 1.
Chain chain_finest(const Edge& edge, const EdgeHeights& heights, const ChainRule& rule);

/// From the chains of both halves of the edge, end to end, as a welded mesh has them. heights: all finest samples of the edge,
/// against which the significance is measured; empty: measured against the vertices of the candidates.
Chain simplify_chain(const Edge& edge, const Chain& candidates, const EdgeHeights& heights, const ChainRule& rule);

/// The chain of an edge without any data; gap 0: its two ends.
Chain void_chain(std::int32_t units, std::int32_t void_gap_units = 0);

}  // namespace cordillera::pipeline
