#pragma once
// Measuring the tiles of a batch, as steps over arrays: what is done to every triangle, to every row of samples that a triangle may show, to
// every vertex. The same functions of a triangle as in surface_meter.h, and sums of integers, so that order does not show.
#include <cstdint>

#include "gpu/atomic.h"
#include "gpu/surface_error_triangle.h"
#include "gpu/surface_error_window.h"

namespace cordillera::gpu {

/// A number that is not negative, as bits that have its order; and back.
CORDILLERA_HD inline std::uint64_t double_bits(double d) {
  union { double d; std::uint64_t u; } bits{d};
  return bits.u;
}
CORDILLERA_HD inline double bits_double(std::uint64_t u) {
  union { std::uint64_t u; double d; } bits{u};
  return bits.d;
}

/// What is found out about a tile. Errors are not negative, so that the bits of the greatest have its order.
struct TileTally {
  std::uint64_t max_bits = 0, square_low = 0, square_high = 0, covered = 0, summed = 0, overcovered = 0, valid = 0;
};

/// A tile of the batch, on the device.
struct MeteredTile {
  TileFacts facts;
  std::uint32_t first_vertex = 0, first_triangle = 0, first_rim = 0, rims = 0;
  Span rows;                           ///< tile-local, of the samples
  SampleWindow::Stretch stretch[2];
  std::int64_t row_shift = 0;          ///< sample row = tile-local row + row_shift
  std::uint32_t all_valid = 0;         ///< 1: there is a sample everywhere under the tile
};

/// Where an exclusive sum tells to whom element i belongs: the last k with first(k) <= i.
template <class First>
CORDILLERA_HD std::uint32_t owner_of(std::uint32_t i, std::uint32_t count, const First& first) {
  std::uint32_t low = 0, high = count;
  while (high - low > 1) {
    const std::uint32_t middle = low + (high - low) / 2;
    (first(middle) <= i ? low : high) = middle;
  }
  return low;
}

/// What the steps read and write.
struct MeterArrays {
  const std::int32_t* samples = nullptr;
  std::int64_t columns = 0;                       ///< of the samples
  const proto::RowFrame* row_frame = nullptr;     ///< indexed by sample row
  const proto::ColumnFrame* column_frame = nullptr;

  const MeteredTile* tiles = nullptr;
  std::uint32_t tile_count = 0;
  const std::int32_t *x = nullptr, *y = nullptr, *height = nullptr;  ///< indexed by vertex of the batch
  const std::uint8_t* mark = nullptr;
  const std::uint32_t* corner = nullptr;          ///< three a triangle, vertices of its tile
  const std::uint64_t* rim = nullptr;             ///< see Rims::edges; of tile t from first_rim on

  std::uint8_t* published = nullptr;              ///< indexed by vertex: in a triangle that exists
  std::uint32_t* tile_of = nullptr;               ///< indexed by triangle
  std::int32_t* first_row = nullptr;              ///< indexed by triangle, tile-local
  std::uint32_t* rows = nullptr;                  ///< indexed by triangle: that it may show
  std::uint32_t* row_start = nullptr;             ///< their exclusive sum
  TileTally* tally = nullptr;                     ///< indexed by tile

  CORDILLERA_HD std::uint32_t tile_of_vertex(std::uint32_t v) const {
    return owner_of(v, tile_count, [&](std::uint32_t t) { return tiles[t].first_vertex; });
  }
  /// Of the first sample in tile-local row y.
  CORDILLERA_HD const std::int32_t* sample_row(const MeteredTile& tile, std::int64_t row) const {
    return samples + (row + tile.row_shift) * columns;
  }
  CORDILLERA_HD const proto::RowFrame& frame_of_row(const MeteredTile& tile, std::int64_t row) const { return row_frame[row + tile.row_shift]; }
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
      if (edges[middle] < edge) low = middle + 1;
      else high = middle;
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

/// Which triangles exist, and how many rows of samples each may show.
struct CountRows {
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
    const Span rows = in.triangle(t).plan.rows;
    in.first_row[t] = static_cast<std::int32_t>(rows.first);
    in.rows[t] = static_cast<std::uint32_t>(length(rows));
  }
};

/// What one row of one triangle gives.
struct RowTally {
  double worst_m = -1;  ///< < 0: it shows no sample
  SquareSum squares;
  std::uint64_t covered = 0, summed = 0, overcovered = 0;
};

/// Adds what a thread found. Threads of a warp that all speak of one tile add up first: else they would queue for it.
CORDILLERA_HD inline void add(TileTally* to, const RowTally& found, double place_m) {
  std::uint64_t bits = found.worst_m < 0 ? 0 : double_bits(found.worst_m + place_m);
  std::uint64_t sums[5] = {found.squares.low, found.squares.high, found.covered, found.summed, found.overcovered};
  std::uint64_t* const at[5] = {&to->square_low, &to->square_high, &to->covered, &to->summed, &to->overcovered};
#ifdef __CUDA_ARCH__
  constexpr unsigned kWarp = 0xffffffffu;
  int alike = 0;
  if (__activemask() == kWarp) __match_all_sync(kWarp, reinterpret_cast<unsigned long long>(to), &alike);
  if (alike) {
    for (int d = 16; d > 0; d /= 2) {
      const std::uint64_t other = __shfl_xor_sync(kWarp, static_cast<unsigned long long>(bits), d);
      bits = other > bits ? other : bits;
      for (std::uint64_t& sum : sums) sum += __shfl_xor_sync(kWarp, static_cast<unsigned long long>(sum), d);
    }
    if (threadIdx.x & 31u) return;
  }
#endif
  raise_to(&to->max_bits, bits);
  for (int k = 0; k < 5; ++k) add_to(at[k], sums[k]);
}

/// The i-th row of all triangles' rows.
struct MeasureRow {
  MeterArrays in;
  std::uint32_t triangles;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto place = static_cast<std::uint32_t>(i);
    const std::uint32_t t = owner_of(place, triangles, [&](std::uint32_t k) { return in.row_start[k]; });
    const MeteredTile& tile = in.tiles[in.tile_of[t]];
    const MeasuredTriangle triangle = in.triangle(t);
    const RowTally found = measure(tile, triangle, in.first_row[t] + static_cast<std::int64_t>(place - in.row_start[t]));
    add(in.tally + in.tile_of[t], found, found.worst_m < 0 ? 0.0 : place_error_m(triangle));
  }

 private:
  CORDILLERA_HD RowTally measure(const MeteredTile& tile, const MeasuredTriangle& triangle, std::int64_t y) const {
    RowTally tally;
    const RowSpans spans = triangle.plan.row(y);
    if (!tile.all_valid) tally.overcovered += length(spans.strict);
    if (y < tile.rows.first || y > tile.rows.last) return tally;
    for (const SampleWindow::Stretch& s : tile.stretch) {
      const Span shown = intersection(spans.shown, s.columns), closed = intersection(spans.closed, s.columns);
      if (length(closed) > 0) inside(tile, triangle, y, s, spans, tally);
      if (!triangle.plan.slack) continue;
      if (length(spans.closed) == 0) {
        beyond(tile, triangle, y, s, shown, tally);
      } else {
        const Span west{shown.first, shown.last < spans.closed.first - 1 ? shown.last : spans.closed.first - 1};
        const Span east{shown.first > spans.closed.last + 1 ? shown.first : spans.closed.last + 1, shown.last};
        beyond(tile, triangle, y, s, west, tally);
        beyond(tile, triangle, y, s, east, tally);
      }
    }
    return tally;
  }

  CORDILLERA_HD void inside(const MeteredTile& tile, const MeasuredTriangle& triangle, std::int64_t y, const SampleWindow::Stretch& s,
                            const RowSpans& spans, RowTally& tally) const {
    const Span closed = intersection(spans.closed, s.columns), owned = intersection(spans.owned, s.columns);
    const Span strict = intersection(spans.strict, s.columns);
    const bool exact_shows = triangle.exact.shows(), rounded_shows = triangle.rounded.shows();
    const proto::RowFrame row = in.frame_of_row(tile, y);
    const PlaneRow exact(triangle.exact, row), rounded(triangle.rounded, row);
    const std::int32_t* const heights = in.sample_row(tile, y) + s.shift;
    const proto::ColumnFrame* const frames = in.column_frame + s.shift;
    std::uint64_t covered = 0;
    if (tally.worst_m < 0) tally.worst_m = 0;
    for (std::int64_t x = closed.first; x <= closed.last; ++x) {
      const bool counts = x >= owned.first && x <= owned.last;
      if (heights[x] == proto::kNoHeight) continue;
      covered += counts;
      if (!tile.all_valid && x >= strict.first && x <= strict.last) tally.overcovered -= 1;
      const double h = heights[x] * proto::kHeightStep_m;
      const proto::ColumnFrame frame = frames[x];
      if (exact_shows) {
        const double e = distance(triangle.exact_range.clamp(exact.height_m(frame.sin_lon, frame.cos_lon)), h);
        if (counts) tally.squares.add(square_steps(e));
        tally.worst_m = detail::most(e, tally.worst_m);
      }
      if (rounded_shows) {
        tally.worst_m = detail::most(distance(triangle.rounded_range.clamp(rounded.height_m(frame.sin_lon, frame.cos_lon)), h), tally.worst_m);
      }
    }
    tally.covered += covered;
    if (exact_shows) tally.summed += covered;
  }

  /// Samples outside the plan triangle that its chords may show.
  CORDILLERA_HD void beyond(const MeteredTile& tile, const MeasuredTriangle& triangle, std::int64_t y, const SampleWindow::Stretch& s,
                            const Span& span, RowTally& tally) const {
    const std::int32_t* const heights = in.sample_row(tile, y) + s.shift;
    for (std::int64_t x = span.first; x <= span.last; ++x) {
      if (heights[x] == proto::kNoHeight) continue;
      const double e = triangle.error_beyond(in.frame_of_row(tile, y), in.column_frame[x + s.shift], heights[x] * proto::kHeightStep_m);
      tally.worst_m = detail::most(e, tally.worst_m);
    }
  }
  CORDILLERA_HD static double distance(double surface_m, double sample_m) {
    const double d = surface_m - sample_m;
    return d < 0 ? -d : d;
  }
};

/// Corners count once each, whatever triangles meet there.
struct MeasureVertex {
  MeterArrays in;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto v = static_cast<std::uint32_t>(i);
    const std::uint32_t at = in.tile_of_vertex(v);
    RowTally found;
    if (in.published[v]) {
      const MeteredTile& tile = in.tiles[at];
      const std::int32_t h = in.sample_row(tile, in.y[v])[in.sample_column(tile, in.x[v])];
      if (h != proto::kNoHeight) {
        const double d = (in.height[v] - static_cast<double>(h)) * proto::kHeightStep_m;
        found.worst_m = d < 0 ? -d : d;
        found.squares.add(square_steps(found.worst_m));
        found.covered = found.summed = 1;
      }
    }
    add(in.tally + at, found, 0);
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
