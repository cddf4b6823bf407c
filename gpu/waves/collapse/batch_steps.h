#pragma once
// What is done to every vertex (or tile) of a batch before, between and after the passes.
#include "gpu/mesh/wedges.h"
#include "gpu/waves/collapse/batch_tile.h"
#include "gpu/waves/collapse/grid_rings.h"
#include "gpu/waves/collapse/sparse_start.h"
#include "gpu/waves/collapse/window_pass.h"

namespace cordillera::gpu {

/// What came to the device: the vertices of all inputs, and which of them the batch starts from.
struct BatchGiven {
  TileFinder tiles;                               ///< their vertices numbered as they came
  const std::int32_t *x = nullptr, *y = nullptr;  ///< read where a tile is no regular grid
  const float* elevation = nullptr;
  const std::uint8_t* mark = nullptr;
  const std::uint8_t* stays = nullptr;    ///< see SparseStart; this and the next two: null where all do
  const std::uint32_t* kept = nullptr;    ///< those that stay, ascending
  const std::uint32_t* number = nullptr;  ///< their places in `kept`

  CORDILLERA_HD std::uint32_t given(std::uint32_t vertex) const { return kept ? kept[vertex] : vertex; }
  CORDILLERA_HD std::uint32_t numbered(std::uint32_t given) const { return number ? number[given] : given; }
};

/// Every vertex before the first pass: its own marks, and in a regular grid its position and ring. The arrays of mesh may be
/// those given.
struct StartVertex {
  BatchGiven given;
  MeshView mesh;
  std::int32_t* x;
  std::int32_t* y;
  float* elevation;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t v = given.given(static_cast<std::uint32_t>(i));
    const BatchTile& tile = given.tiles.tiles[given.tiles.of(v)];
    if (tile.cells > 0) {
      const auto at = static_cast<std::int32_t>(v - tile.first);
      const std::int32_t row = at / (tile.cells + 1), column = at - row * (tile.cells + 1), step = tile.side / tile.cells;
      x[i] = column * step;
      y[i] = row * step;
      mesh.valence[i] = static_cast<std::uint8_t>(start_ring(tile, column, row, mesh.row + i * kRowWidth));
    } else {
      x[i] = given.x[v];
      y[i] = given.y[v];
    }
    elevation[i] = given.elevation[v];
    const bool side_x = x[i] == 0 || x[i] == tile.side, side_y = y[i] == 0 || y[i] == tile.side;
    const int side = (side_x || side_y ? kOnSide : 0) | (side_x && side_y ? kOnCorner : 0);
    const int marked = given.mark[v] & (proto::kVoid | proto::kKeep | proto::kRemove);
    // What may not go is not asked: on the border, only what the chain dropped.
    const bool keep = side && !(marked & proto::kRemove);
    mesh.mark[i] = static_cast<std::uint8_t>(marked | side | (keep ? proto::kKeep : 0));
    mesh.carried[i] = 0;
    mesh.spent[i] = 0;
    mesh.key[i] = 0;
  }

 private:
  CORDILLERA_HD int start_ring(const BatchTile& tile, std::int32_t column, std::int32_t row, std::uint32_t* ring) const {
    if (SparseStart::chooses(tile)) {
      const auto name = [&](std::uint32_t v) { return given.number[tile.first + v]; };
      return StartRing(given.stays + tile.first, tile.cells, column, row).write(name, ring);
    }
    const int valence = grid_ring(tile.cells, column, row, tile.first, ring);
    for (int k = 0; given.number && k < valence; ++k) ring[k] = given.number[ring[k]];
    return valence;
  }
};

/// Tiles that choose nothing; the others choose afterwards.
struct StartsWhole {
  std::uint8_t* stays;
  CORDILLERA_HD void operator()(std::size_t i) const { stays[i] = 1; }
};
struct StaysInStart {
  const std::uint8_t* stays;
  CORDILLERA_HD bool operator()(std::uint32_t v) const { return stays[v] != 0; }
};
/// number[kept[i]] = i
struct NumberKept {
  const std::uint32_t* kept;
  std::uint32_t* number;
  CORDILLERA_HD void operator()(std::size_t i) const { number[kept[i]] = static_cast<std::uint32_t>(i); }
};
/// A tile of the batch once vertices are numbered by what stays. Its first vertex always does.
struct NumberTile {
  BatchGiven given;
  BatchTile* tiles;
  std::uint32_t given_count, kept_count;
  CORDILLERA_HD void operator()(std::size_t t) const {
    tiles[t] = given.tiles.tiles[t];
    tiles[t].first = tiles[t].first < given_count ? given.number[tiles[t].first] : kept_count;
  }
};
struct NumberTriangle {
  const std::uint32_t* number;
  std::array<std::uint32_t, 3>* triangles;
  CORDILLERA_HD void operator()(std::size_t i) const {
    for (std::uint32_t& v : triangles[i]) v = number[v];
  }
};
/// Survivors as they came.
struct GivenSurvivor {
  const std::uint32_t *kept, *survivors;
  std::uint32_t* given;
  CORDILLERA_HD void operator()(std::size_t i) const { given[i] = kept[survivors[i]]; }
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

/// Before the first pass all are.
struct ListAll {
  std::uint32_t* list;
  CORDILLERA_HD void operator()(std::size_t i) const { list[i] = static_cast<std::uint32_t>(i); }
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
