#pragma once
// What is done to every vertex (or tile) of a batch before, between and after the passes.
#include "gpu/batch_tile.h"
#include "gpu/grid_rings.h"
#include "gpu/wedges.h"
#include "gpu/window_pass.h"

namespace cordillera::gpu {

/// Every vertex before the first pass: its own marks, and in a regular grid its position and ring.
struct StartVertex {
  MeshView mesh;
  std::int32_t* x;
  std::int32_t* y;
  TileFinder tiles;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto v = static_cast<std::uint32_t>(i);
    const BatchTile& tile = tiles.tiles[tiles.of(v)];
    if (tile.cells > 0) {
      const auto at = static_cast<std::int32_t>(v - tile.first);
      const std::int32_t row = at / (tile.cells + 1), column = at - row * (tile.cells + 1), step = tile.side / tile.cells;
      x[v] = column * step;
      y[v] = row * step;
      mesh.valence[v] = static_cast<std::uint8_t>(grid_ring(tile.cells, column, row, tile.first, mesh.row + i * kRowWidth));
    }
    const bool side_x = x[v] == 0 || x[v] == tile.side, side_y = y[v] == 0 || y[v] == tile.side;
    const int side = (side_x || side_y ? kOnSide : 0) | (side_x && side_y ? kOnCorner : 0);
    const int given = mesh.mark[v] & (proto::kVoid | proto::kKeep | proto::kRemove);
    // What may not go is not asked: on the border, only what the chain dropped.
    const bool keep = side && !(given & proto::kRemove);
    mesh.mark[v] = static_cast<std::uint8_t>(given | side | (keep ? proto::kKeep : 0));
    mesh.carried[v] = 0;
    mesh.spent[v] = 0;
    mesh.key[v] = 0;
  }
};

/// What is found out while rings are made.
struct RingFacts {
  std::uint32_t broken = 0;  ///< 1: some vertex has no single fan
  std::uint32_t widest = 0;  ///< greatest valence
};

/// The ring of a vertex whose tile came as triangles.
struct ChainWedges {
  MeshView mesh;
  TileFinder tiles;
  const std::uint32_t* end;  ///< indexed by vertex, of its wedges
  Wedge* wedges;
  RingFacts* facts;

  CORDILLERA_HD void operator()(std::size_t i) const {
    if (tiles.tiles[tiles.of(static_cast<std::uint32_t>(i))].cells > 0) return;
    const std::uint32_t begin = i == 0 ? 0 : end[i - 1], count = end[i] - begin;
    mesh.valence[i] = 0;
    if (count == 0) return;
    const Fan fan = chain_wedges(wedges + begin, count, mesh.row + i * kRowWidth, mesh.valence[i]);
    if (fan == Fan::broken || (fan == Fan::open) != ((mesh.mark[i] & kOnSide) != 0)) facts->broken = 1;
    raise_to(&facts->widest, mesh.valence[i]);
  }
};

struct IsAlive {
  const std::uint8_t* mark;
  CORDILLERA_HD bool operator()(std::uint32_t v) const { return !(mark[v] & kGone); }
};

/// Survivors are numbered anew, in their old order.
struct NumberSurvivor {
  MeshView mesh;
  const std::uint32_t* survivors;
  std::uint32_t* number;   ///< indexed by vertex
  std::uint32_t* valence;  ///< indexed by survivor
  CORDILLERA_HD void operator()(std::size_t i) const {
    number[survivors[i]] = static_cast<std::uint32_t>(i);
    valence[i] = mesh.valence[survivors[i]];
  }
};

struct PackRow {
  MeshView mesh;
  const std::uint32_t* survivors;
  const std::uint32_t* number;
  const std::uint32_t* row_start;
  std::uint32_t* neighbour;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t* row = mesh.row + std::size_t{survivors[i]} * kRowWidth;
    for (std::uint32_t k = row_start[i]; k < row_start[i + 1]; ++k) neighbour[k] = number[*row++];
  }
};

}  // namespace cordillera::gpu
