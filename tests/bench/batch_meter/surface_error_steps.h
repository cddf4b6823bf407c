#pragma once
// Measuring the tiles of a batch, as steps over arrays: what is done to every triangle and to every vertex; rows of samples are
// in surface_error_rows.h. The same functions of a triangle as in surface_meter.h, and sums of integers, so that order does not
// show.
#include <cstdint>

#include "tests/bench/batch_meter/surface_error_arrays.h"

namespace cordillera::gpu {

/// Which triangles exist, and how many rows of samples each may show.
struct CountRows {
  static constexpr std::uint32_t kTall = 512;
  static constexpr int kBlocksAtOnce = 2;
  MeterArrays in;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto t = static_cast<std::uint32_t>(i);
    const std::uint32_t at = owner_of(t, in.tile_count, [&](std::uint32_t k) { return in.tiles[k].first_triangle; });
    in.tile_of[t] = at;
    const std::uint32_t first = in.tiles[at].first_vertex;
    const std::uint32_t v[3] = {first + in.corner[3 * i], first + in.corner[3 * i + 1], first + in.corner[3 * i + 2]};
    in.rows[t] = 0;
    if ((in.mark[v[0]] | in.mark[v[1]] | in.mark[v[2]]) & proto::kVoid) return;
    for (const std::uint32_t corner : v) set_shared(in.published + corner, std::uint8_t{1});
    const MeasuredTriangle triangle = in.triangle(t);
    in.metered[t].set(triangle, at, in.tiles[at].facts.unit_rad);
    const std::uint64_t rows = length(triangle.plan.rows);
    in.rows[t] = static_cast<std::uint32_t>(rows);
    if (rows > kTall) add_to(in.tall_rows, rows);
  }
};

/// Corners count once each, whatever triangles meet there. Over the vertices, and as many as threads in step ask for.
struct MeasureVertex {
  MeterArrays in;
  std::uint32_t vertices;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto v = static_cast<std::uint32_t>(i);
    TileTally* to = nullptr;
    RowTally found;
    if (v < vertices && in.published[v]) {
      const std::uint32_t at = in.tile_of_vertex(v);
      const MeteredTile& tile = in.tiles[at];
      const std::int32_t h = in.sample_row(tile, in.y[v])[in.sample_column(tile, in.x[v])];
      to = in.tally + at;
      if (h != proto::kNoHeight) {
        const double d = (in.height[v] - static_cast<double>(h)) * proto::kHeightStep_m, error_m = d < 0 ? -d : d;
        found.raise(error_m);
        found.squares.add(square_steps(error_m));
        found.covered = found.summed = 1;
      }
    }
    add_together(to, found);
  }
};

/// Of tile t, row by row of its samples. Row i of all, row_first(t) the first of tile t.
struct CountValid {
  MeterArrays in;
  const std::uint32_t* row_first;  ///< indexed by tile
  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t t = owner_of(static_cast<std::uint32_t>(i), in.tile_count, [&](std::uint32_t k) { return row_first[k]; });
    const MeteredTile& tile = in.tiles[t];
    const std::int64_t y = tile.rows.first + static_cast<std::int64_t>(i - row_first[t]);
    std::uint64_t valid = 0;
    for (const SampleWindow::Stretch& s : tile.stretch) {
      const std::int32_t* const heights = in.sample_row(tile, y) + s.shift;
      for (std::int64_t x = s.columns.first; x <= s.columns.last; ++x) valid += heights[x] != proto::kNoHeight;
    }
    add_to(&in.tally[t].valid, valid);
  }
};

}  // namespace cordillera::gpu
