#pragma once
// The tiles of a batch and their samples in the memory of a device, as the steps of measuring see them.
#include <cstdint>

#include "tests/bench/batch_meter/surface_error_records.h"

namespace cordillera::gpu {

/// What the steps read and write.
struct MeterArrays {
  const std::int32_t* samples = nullptr;
  std::int64_t columns = 0;                    ///< of the samples
  const proto::RowFrame* row_frame = nullptr;  ///< indexed by sample row
  const proto::ColumnFrame* column_frame = nullptr;

  const MeteredTile* tiles = nullptr;
  std::uint32_t tile_count = 0;
  const std::int32_t *x = nullptr, *y = nullptr, *height = nullptr;  ///< indexed by vertex of the batch
  const std::uint8_t* mark = nullptr;
  const std::uint32_t* corner = nullptr;  ///< three a triangle, vertices of its tile
  const std::uint64_t* rim = nullptr;     ///< see Rims::edges; of tile t from first_rim on

  std::uint8_t* published = nullptr;   ///< indexed by vertex: in a triangle that exists
  std::uint32_t* tile_of = nullptr;    ///< indexed by triangle
  MeteredTriangle* metered = nullptr;  ///< indexed by triangle
  std::uint32_t* rows = nullptr;       ///< indexed by triangle: that it may show
  std::uint32_t* row_start = nullptr;  ///< their exclusive sum
  std::uint64_t* tall_rows = nullptr;  ///< one: of triangles of more than kTall rows, together
  TileTally* tally = nullptr;          ///< indexed by tile

  CORDILLERA_HD std::uint32_t tile_of_vertex(std::uint32_t v) const {
    return owner_of(v, tile_count, [&](std::uint32_t t) { return tiles[t].first_vertex; });
  }
  /// Of the first sample in tile-local row y.
  CORDILLERA_HD const std::int32_t* sample_row(const MeteredTile& tile, std::int64_t row) const {
    return samples + (row + tile.row_shift) * columns;
  }
  CORDILLERA_HD const proto::RowFrame& frame_of_row(const MeteredTile& tile, std::int64_t row) const {
    return row_frame[row + tile.row_shift];
  }
  /// In the window of the samples.
  CORDILLERA_HD std::int64_t sample_column(const MeteredTile& tile, std::int64_t x_units) const {
    const SampleWindow::Stretch& first = tile.stretch[0];
    return x_units + (x_units >= first.columns.first && x_units <= first.columns.last ? first.shift : tile.stretch[1].shift);
  }

  CORDILLERA_HD Corner corner_at(const MeteredTile& tile, std::uint32_t v) const {
    const double h = height[v] * proto::kHeightStep_m;
    const proto::RowFrame row = frame_of_row(tile, y[v]);
    const proto::Vec3 p = proto::ecef(row, column_frame[sample_column(tile, x[v])], h);
    return {x[v], y[v], h, p, round_to(p, tile.facts.step_m), row};
  }
  CORDILLERA_HD bool has_rim(const MeteredTile& tile, std::uint32_t from, std::uint32_t to) const {
    if (tile.rims == 0) return false;
    const std::uint64_t edge = std::uint64_t{from} << 32 | to;
    const std::uint64_t* const edges = rim + tile.first_rim;
    std::uint32_t low = 0, high = tile.rims;
    while (low < high) {
      const std::uint32_t middle = (low + high) / 2;
      if (edges[middle] < edge)
        low = middle + 1;
      else
        high = middle;
    }
    return low < tile.rims && edges[low] == edge;
  }
  CORDILLERA_HD MeasuredTriangle triangle(std::uint32_t t) const {
    const MeteredTile& tile = tiles[tile_of[t]];
    const std::uint32_t* const v = corner + 3 * std::size_t{t};
    const Corner c[3] = {corner_at(tile, tile.first_vertex + v[0]), corner_at(tile, tile.first_vertex + v[1]),
                         corner_at(tile, tile.first_vertex + v[2])};
    unsigned owned = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned n = k == 2 ? 0 : k + 1;
      if (counts_edge(tile.facts.side, c[k], c[n]) || has_rim(tile, v[k], v[n])) owned |= 1u << k;
    }
    return measured_triangle(tile.facts, c, owned);
  }
};

}  // namespace cordillera::gpu
