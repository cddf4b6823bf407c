#pragma once
// Which vertices of a grid a promised tile starts from, and their rings: a right-triangulated irregular network, made by steps
// over arrays. W. Evans, D. Kirkpatrick, G. Townsend, "Right-triangulated irregular networks", Algorithmica 30(2), 2001;
// dependencies as in P. Lindstrom et al., "Real-time, continuous level of detail rendering of height fields", 1996.
//
// Every vertex but the corners is the middle of one longest edge: the centre of a square, whose diagonal the edge is, or the
// middle of a square's side. It can be left out if nothing speaks for it and none of the vertices is there that would cut the
// halves of its triangles. So a vertex that is there has its neighbours in eight directions, at distances that halve as long as
// there is somebody half-way: no triangle needs to be made to find a ring.
#include <bit>
#include <cstdint>

#include "gpu/waves/collapse/batch_tile.h"
#include "proto/mesh.h"

namespace cordillera::gpu {

/// The grids of a batch before anything is left out; tiles that start from all they have are among them.
struct SparseStart {
  const BatchTile* tiles = nullptr;
  const float* elevation = nullptr;    ///< metres, indexed by vertex of the batch
  const std::uint8_t* mark = nullptr;  ///< likewise, as the caller set them
  std::uint8_t* stays = nullptr;       ///< likewise: 1 if the vertex is in the start

  CORDILLERA_HD static bool chooses(const BatchTile& tile) { return tile.start_tolerance_m > 0; }

  /// Is v, in the middle between a and b, off their edge? Where there is no data nothing is off.
  CORDILLERA_HD bool differs(std::uint32_t v, std::uint32_t a, std::uint32_t b, float tolerance_m) const {
    if ((mark[a] | mark[v] | mark[b]) & proto::kVoid) return false;
    const float off = elevation[v] - 0.5f * (elevation[a] + elevation[b]);
    return !((off < 0 ? -off : off) <= tolerance_m);
  }
};

/// A step over the points of the lattice of `half` cells in all tiles: step.choose(start, tile, x, y), which writes `stays` of
/// the points that are in the middle of something. An element is a point on a device, a row of points on a host.
template <class Step>
struct OverPoints {
  SparseStart start;
  std::uint32_t tiles;
  std::int32_t half, most_cells;  ///< cells of the largest tile
  Step step;

  /// How many elements, on a device whose threads run in_step.
  std::size_t count(std::uint32_t in_step) const {
    const auto across = static_cast<std::size_t>(most_cells / half + 1);
    return tiles * across * (in_step > 1 ? across : 1);
  }
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto across = static_cast<std::uint32_t>(most_cells / half + 1);
#ifdef __CUDA_ARCH__
    const bool small = i <= UINT32_MAX;  // a GPU divides 64-bit numbers slowly
    const auto row = small ? static_cast<std::uint32_t>(i) / across : static_cast<std::uint32_t>(i / across);
    const auto x = static_cast<std::int32_t>(i - std::size_t{row} * across) * half;
#else
    const auto row = static_cast<std::uint32_t>(i);
#endif
    const BatchTile& tile = start.tiles[row / across];
    const auto y = static_cast<std::int32_t>(row % across) * half;
    // In a tile smaller than the largest, steps so large have no middles: they would look beyond it.
    if (!SparseStart::chooses(tile) || 2 * half > tile.cells || y > tile.cells) return;
#ifdef __CUDA_ARCH__
    if (x <= tile.cells) step.choose(start, tile, x, y);
#else
    for (std::int32_t x = 0; x <= tile.cells; x += half) step.choose(start, tile, x, y);
#endif
  }
};

/// Number of the vertex at (x, y) of a grid.
CORDILLERA_HD inline std::uint32_t grid_vertex(const BatchTile& tile, std::int32_t x, std::int32_t y) {
  return tile.first + static_cast<std::uint32_t>(y) * (static_cast<std::uint32_t>(tile.cells) + 1) +
         static_cast<std::uint32_t>(x);
}

/// The corners of tile i: no square has them in its middle.
struct KeepCorners {
  SparseStart start;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const BatchTile& tile = start.tiles[i];
    if (!SparseStart::chooses(tile)) return;
    for (int k = 0; k < 4; ++k) start.stays[grid_vertex(tile, k & 1 ? tile.cells : 0, k & 2 ? tile.cells : 0)] = 1;
  }
};

/// What stays whatever the terrain: what is marked, and every vertex of a cell that is partly void, so that the rest of a rim's
/// triangles are the smallest, whichever way their cell is cut.
CORDILLERA_HD inline bool always_stays(const SparseStart& start, const BatchTile& tile, std::int32_t x, std::int32_t y) {
  if (start.mark[grid_vertex(tile, x, y)] & proto::kKeep) return true;
  if (!tile.any_void) return false;
  unsigned labels = 0;
  for (std::int32_t row = y > 0 ? y - 1 : 0; row <= y + 1 && row <= tile.cells; ++row) {
    for (std::int32_t column = x > 0 ? x - 1 : 0; column <= x + 1 && column <= tile.cells; ++column)
      labels |= start.mark[grid_vertex(tile, column, row)] & proto::kVoid ? 1u : 2u;
  }
  return labels == 3;
}

/// Middles of the sides of squares of 2 * half cells. Their triangles' halves are cut by the centres of the squares half as large
/// around them.
struct ChooseSides {
  std::int32_t half;

  CORDILLERA_HD void choose(const SparseStart& start, const BatchTile& tile, std::int32_t x, std::int32_t y) const {
    const bool north = (y & half) != 0;  // the way the side runs; else east
    if (((x & half) != 0) == north) return;
    const std::uint32_t v = grid_vertex(tile, x, y);
    const auto across = static_cast<std::uint32_t>(tile.cells) + 1;
    const std::int32_t quarter = half / 2;
    bool needed = false;
    for (std::int32_t dy = -quarter; dy <= quarter && quarter > 0; dy += half) {
      if (y + dy < 0 || y + dy > tile.cells) continue;
      const std::uint32_t row = v + static_cast<std::uint32_t>(dy) * across;
      if (x > 0) needed |= start.stays[row - static_cast<std::uint32_t>(quarter)] != 0;
      if (x < tile.cells) needed |= start.stays[row + static_cast<std::uint32_t>(quarter)] != 0;
    }
    const std::uint32_t step = static_cast<std::uint32_t>(half) * (north ? across : 1);
    start.stays[v] = needed || start.differs(v, v - step, v + step, tile.start_tolerance_m) || always_stays(start, tile, x, y);
  }
};

/// Centres of squares of 2 * half cells. Diagonals meet in the centres of the squares twice as large; the halves are cut by the
/// sides' middles.
struct ChooseCentres {
  std::int32_t half;

  CORDILLERA_HD void choose(const SparseStart& start, const BatchTile& tile, std::int32_t x, std::int32_t y) const {
    if ((x & y & half) == 0) return;
    const std::uint32_t v = grid_vertex(tile, x, y);
    const auto east = static_cast<std::uint32_t>(half), north = east * (static_cast<std::uint32_t>(tile.cells) + 1);
    const bool needed = (start.stays[v - east] | start.stays[v + east] | start.stays[v - north] | start.stays[v + north]) != 0;
    const bool rises = ((x ^ y) & (2 * half)) == 0;  // from south-west to north-east
    const std::uint32_t step = rises ? north + east : north - east;
    start.stays[v] = needed || start.differs(v, v - step, v + step, tile.start_tolerance_m) || always_stays(start, tile, x, y);
  }
};

/// The neighbours of the vertex at (x, y) of a tile's start. Found in directions counted counter-clockwise from the east.
class StartRing {
  static constexpr unsigned kAxes = 0x55, kDiagonals = 0xaa, kAll = 0xff;

 public:
  /// stays: of the tile, indexed by vertex of its grid.
  CORDILLERA_HD StartRing(const std::uint8_t* stays, std::int32_t cells, std::int32_t x, std::int32_t y)
      : stays_(stays), cells_(cells), x_(x), y_(y) {
    const std::int32_t bits = x | y, size = bits & -bits;
    if (bits == 0 || size == cells) {
      size_ = cells;
      sure_ = x == y ? kAll : kAxes;  // the grid's first diagonal runs south-west to north-east
    } else {
      size_ = size;
      sure_ = ((x / size) & (y / size) & 1) != 0 ? kDiagonals : kAxes;
    }
  }

  /// Into row, in the order that rings.h asks for; name(k): what the k-th vertex of the grid is called there, in their order.
  /// Returns how many.
  template <class Name>
  CORDILLERA_HD int write(const Name& name, std::uint32_t* row) const {
    // Distances first, all eight of them, so that a device waits for its reads together: a byte each, 0 for nobody, else 1 + its
    // logarithm.
    std::uint64_t distances = 0;
    unsigned inside = 0;
    std::uint32_t lowest = UINT32_MAX;
    int from = 0;
    for (int k = 0; k < 8; ++k) {
      if (!is_inside(k, 1)) continue;
      inside |= 1u << k;
      const std::int32_t distance = distance_to(k);
      if (distance == 0) continue;
      distances |= static_cast<std::uint64_t>(logarithm(distance) + 1) << 8 * k;
      const std::uint32_t there = at(k, distance);
      if (there >= lowest) continue;
      lowest = there;
      from = k;
    }
    // An open fan starts at the border, where the direction before it leads outside.
    for (int k = 0; k < 8 && inside != kAll; ++k) {
      if ((inside >> k & 1u) && !(inside >> (k + 7) % 8 & 1u)) from = k;
    }
    int count = 0;
    for (int n = 0; n < 8; ++n) {
      const int k = (from + n) % 8;
      const auto found = static_cast<unsigned>(distances >> 8 * k & 0xffu);
      if (found) row[count++] = name(at(k, 1 << (found - 1)));
    }
    return count;
  }

 private:
  CORDILLERA_HD static std::int32_t dx(int k) { return k == 2 || k == 6 ? 0 : k < 2 || k == 7 ? 1 : -1; }
  CORDILLERA_HD static std::int32_t dy(int k) { return k % 4 == 0 ? 0 : k < 4 ? 1 : -1; }
  CORDILLERA_HD bool is_inside(int k, std::int32_t distance) const {
    const std::int32_t x = x_ + dx(k) * distance, y = y_ + dy(k) * distance;
    return x >= 0 && y >= 0 && x <= cells_ && y <= cells_;
  }
  CORDILLERA_HD std::uint32_t at(int k, std::int32_t distance) const {
    return static_cast<std::uint32_t>((y_ + dy(k) * distance) * (cells_ + 1) + x_ + dx(k) * distance);
  }
  CORDILLERA_HD bool stays(int k, std::int32_t distance) const { return stays_[at(k, distance)] != 0; }

  /// 0: nobody there.
  CORDILLERA_HD std::int32_t distance_to(int k) const {
    std::int32_t distance = sure_ == kAxes && k % 2 != 0 ? size_ / 2 : size_;
    if (!(sure_ >> k & 1u) && (distance == 0 || !stays(k, distance))) return 0;
    while (distance > 1 && stays(k, distance / 2)) distance /= 2;
    return distance;
  }
  CORDILLERA_HD static int logarithm(std::int32_t power_of_two) {
#ifdef __CUDA_ARCH__
    return __ffs(power_of_two) - 1;
#else
    return std::countr_zero(static_cast<std::uint32_t>(power_of_two));
#endif
  }

  const std::uint8_t* stays_;
  std::int32_t cells_, x_, y_;
  std::int32_t size_;  ///< to the neighbours that came with this vertex
  unsigned sure_;  ///< bit k: they lie in direction k. Between two such there is somebody once the triangle between them is cut
};

}  // namespace cordillera::gpu
