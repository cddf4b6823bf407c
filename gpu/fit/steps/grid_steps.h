#pragma once
// A regular grid taken in: every vertex knows its number, its place and its ring by arithmetic.
#include "gpu/fit/steps/samples.h"
#include "gpu/fit/steps/wave_view.h"

namespace cordillera::gpu::fit {

/// Numbers of nodes: square tiles one after the other, lest neighbours lie far apart.
struct TileOrder {
  static constexpr std::uint32_t kTile = 32;
  std::uint32_t columns, rows;

  CORDILLERA_HD std::uint32_t number(std::uint32_t column, std::uint32_t row) const {
    const std::uint32_t west = column / kTile * kTile, south = row / kTile * kTile;
    const std::uint32_t wide = columns - west < kTile ? columns - west : kTile;
    const std::uint32_t high = rows - south < kTile ? rows - south : kTile;
    return south * columns + west * high + (row - south) * wide + column - west;
  }
  CORDILLERA_HD std::uint32_t tiles_across() const { return (columns + kTile - 1) / kTile; }
  CORDILLERA_HD std::uint32_t tiles() const { return tiles_across() * ((rows + kTile - 1) / kTile); }
};

/// Of heights: the least and the greatest, as ordered integers, the former upside down; ~ of the lowest index that is not finite.
struct HeightFacts {
  std::uint32_t high = 0, low = 0, bad = 0;
};
struct FindHeights {
  const float* z;
  HeightFacts* facts;  ///< zeroed
  CORDILLERA_HD void operator()(std::size_t i) const {
    const float value = z[i];
    if (!(value >= -kLargest && value <= kLargest)) return raise_to(&facts->bad, ~static_cast<std::uint32_t>(i));
    raise_to(&facts->high, ordered(value));
    raise_to(&facts->low, ~ordered(value));
  }

 private:
  static constexpr float kLargest = 3.402823466e38f;
};

struct StartTile {
  TileOrder order;
  std::uint32_t vertices;
  std::uint32_t* start;  ///< indexed by tile, one more at the end
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto tile = static_cast<std::uint32_t>(i), across = order.tiles_across();
    const std::uint32_t column = tile % across * TileOrder::kTile, row = tile / across * TileOrder::kTile;
    start[tile] = tile == order.tiles() ? vertices : order.number(column, row);
  }
};

/// Node i, row-major, as a vertex and as a sample. Cells are parted from south-west to north-east.
struct TakeNode {
  FitMesh mesh;
  TileOrder order;
  const float* from;
  double middle, scale;  ///< of heights
  float* z;              ///< of samples

  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto node = static_cast<std::uint32_t>(i);
    const std::uint32_t column = node % order.columns, row = node / order.columns;
    const std::uint32_t v = order.number(column, row);
    const auto height = static_cast<float>((static_cast<double>(from[i]) - middle) * scale);
    z[i] = height;
    std::uint32_t ring[kRing];
    const std::uint32_t count = ring_of(column, row, ring);
    mesh.vertex[v] = {static_cast<std::int32_t>(column) * LatticeSamples::kStep,
                      static_cast<std::int32_t>(row) * LatticeSamples::kStep,
                      height,
                      static_cast<std::uint16_t>(count),
                      static_cast<std::uint8_t>(count < kRing ? kOpen : 0),
                      0};
    std::uint32_t* const to = mesh.row(v);
    const std::uint32_t first = count < kRing ? 0 : lowest(ring);
    for (std::uint32_t k = 0; k < count; ++k) to[k] = ring[first + k < count ? first + k : first + k - count];
  }

 private:
  static constexpr std::uint32_t kRing = 6;

  /// From the east, counter-clockwise; at a border from one side of the gap to the other.
  CORDILLERA_HD std::uint32_t ring_of(std::uint32_t column, std::uint32_t row, std::uint32_t* ring) const {
    const bool east = column + 1 < order.columns, north = row + 1 < order.rows, west = column > 0, south = row > 0;
    const bool there[kRing] = {east, east && north, north, west, west && south, south};
    std::uint32_t first = 0;
    while (first < kRing - 1 && !(there[first] && !there[first == 0 ? kRing - 1 : first - 1])) ++first;
    if (east && north && west && south) first = 0;
    std::uint32_t count = 0;
    for (std::uint32_t k = 0; k < kRing; ++k) {
      const std::uint32_t way = first + k < kRing ? first + k : first + k - kRing;
      if (there[way]) ring[count++] = neighbour(column, row, way);
    }
    return count;
  }
  CORDILLERA_HD std::uint32_t neighbour(std::uint32_t column, std::uint32_t row, std::uint32_t way) const {
    const std::uint32_t x = way == 0 || way == 1 ? column + 1 : way == 3 || way == 4 ? column - 1 : column;
    const std::uint32_t y = way == 1 || way == 2 ? row + 1 : way == 4 || way == 5 ? row - 1 : row;
    return order.number(x, y);
  }
  CORDILLERA_HD static std::uint32_t lowest(const std::uint32_t* ring) {
    std::uint32_t first = 0;
    for (std::uint32_t k = 1; k < kRing; ++k) first = ring[k] < ring[first] ? k : first;
    return first;
  }
};

}  // namespace cordillera::gpu::fit
