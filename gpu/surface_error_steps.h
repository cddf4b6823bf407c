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

/// What a row needs to know of its triangle, small enough to be kept for all of them.
struct alignas(16) MeteredTriangle {
  struct Edge {
    std::int32_t x, y, dx, dy;
  };
  Plane exact, rounded;
  HeightRange exact_range, rounded_range;
  double place_m;              ///< see place_error_m()
  std::int64_t slack[3];
  Edge edge[3];
  std::int32_t west, east;     ///< of the plan's columns
  std::int32_t first_row;
  std::uint32_t tile;
  std::uint32_t owned, slacks; ///< bit k: edge k is; 1: some edge has slack

  CORDILLERA_HD void set(const MeasuredTriangle& t, std::uint32_t its_tile) {
    exact = t.exact;
    rounded = t.rounded;
    exact_range = t.exact_range;
    rounded_range = t.rounded_range;
    place_m = place_error_m(t);
    owned = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const PlanEdge& e = t.plan.edge[k];
      edge[k] = {static_cast<std::int32_t>(e.x), static_cast<std::int32_t>(e.y), static_cast<std::int32_t>(e.dx), static_cast<std::int32_t>(e.dy)};
      slack[k] = e.slack;
      owned |= e.owned ? 1u << k : 0u;
    }
    west = static_cast<std::int32_t>(t.plan.columns.first);
    east = static_cast<std::int32_t>(t.plan.columns.last);
    first_row = static_cast<std::int32_t>(t.plan.rows.first);
    tile = its_tile;
    slacks = t.plan.slack;
  }
  /// with_slack: `shown` is wanted, too.
  CORDILLERA_HD RowSpans row(std::int64_t y, bool with_slack) const {
    PlanTriangle plan;
    for (unsigned k = 0; k < 3; ++k) {
      const Edge e = edge[k];
      plan.edge[k] = {e.x, e.y, e.dx, e.dy, with_slack ? slack[k] : 0, (owned >> k & 1u) != 0};
    }
    plan.columns = {west, east};
    return plan.row(y);
  }
};

/// The same, known to be `from` or later.
template <class First>
CORDILLERA_HD std::uint32_t owner_from(std::uint32_t from, std::uint32_t i, std::uint32_t count, const First& first) {
  std::uint32_t low = from, step = 1;
  while (low + step < count && first(low + step) <= i) {
    low += step;
    step *= 2;
  }
  std::uint32_t high = low + step < count ? low + step : count;
  while (high - low > 1) {
    const std::uint32_t middle = low + (high - low) / 2;
    (first(middle) <= i ? low : high) = middle;
  }
  return low;
}

/// A row of samples of a triangle. The closed triangle's, from which the ends of the others are a sample or none away.
struct MeteredRow {
  enum Ends : std::uint32_t {
    kOwnedWest = 1, kOwnedEast = 2, kStrictWest = 4, kStrictEast = 8,  ///< the end sample is among them
    kOwned = 16, kStrict = 32,                                         ///< there are any
  };
  std::uint32_t triangle;
  std::int32_t y, first, last;  ///< tile-local; first > last: none
  std::uint32_t ends;

  CORDILLERA_HD void set(std::uint32_t t, std::int64_t row, const RowSpans& spans) {
    triangle = t;
    y = static_cast<std::int32_t>(row);
    first = 0;
    last = -1;
    ends = 0;
    if (length(spans.closed) == 0) return;
    first = static_cast<std::int32_t>(spans.closed.first);
    last = static_cast<std::int32_t>(spans.closed.last);
    if (length(spans.owned) > 0)
      ends |= kOwned | (spans.owned.first == first ? kOwnedWest : 0u) | (spans.owned.last == last ? kOwnedEast : 0u);
    if (length(spans.strict) > 0)
      ends |= kStrict | (spans.strict.first == first ? kStrictWest : 0u) | (spans.strict.last == last ? kStrictEast : 0u);
  }
  CORDILLERA_HD bool owns(std::int32_t x) const { return holds(x, kOwned, kOwnedWest, kOwnedEast); }
  CORDILLERA_HD bool is_strict(std::int32_t x) const { return holds(x, kStrict, kStrictWest, kStrictEast); }
  CORDILLERA_HD std::int32_t strict_count() const {
    return ends & kStrict ? last - first - 1 + (ends & kStrictWest ? 1 : 0) + (ends & kStrictEast ? 1 : 0) : 0;
  }

 private:
  CORDILLERA_HD bool holds(std::int32_t x, std::uint32_t any, std::uint32_t west, std::uint32_t east) const {
    return (ends & any) != 0 && (x > first || (ends & west) != 0) && (x < last || (ends & east) != 0);
  }
};

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
  MeteredTriangle* metered = nullptr;             ///< indexed by triangle
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
    in.metered[t].set(triangle, at);
    in.rows[t] = static_cast<std::uint32_t>(length(triangle.plan.rows));
  }
};

/// What a thread finds out about one tile.
struct RowTally {
  std::uint64_t max_bits = 0;
  SquareSum squares;
  std::uint32_t covered = 0, summed = 0;
  std::int32_t overcovered = 0;

  CORDILLERA_HD void raise(double error_m) {
    const std::uint64_t bits = double_bits(error_m);
    max_bits = bits > max_bits ? bits : max_bits;
  }
  CORDILLERA_HD void add_to(TileTally* to) const {
    raise_to(&to->max_bits, max_bits);
    gpu::add_to(&to->square_low, squares.low);
    gpu::add_to(&to->square_high, squares.high);
    gpu::add_to(&to->covered, covered);
    gpu::add_to(&to->summed, summed);
    gpu::add_to(&to->overcovered, static_cast<std::uint64_t>(std::int64_t{overcovered}));
  }
};

/// Threads of a device that run in step; one on a host.
#ifdef __CUDA_ARCH__
inline constexpr std::uint32_t kInStep = 32;
#else
inline constexpr std::uint32_t kInStep = 1;
#endif

/// Adds what a thread found; called by all that run in step. Where they all speak of one tile they add up first: else they would queue for it.
CORDILLERA_HD inline void add_together(TileTally* to, const RowTally& found) {
#ifdef __CUDA_ARCH__
  constexpr unsigned kAll = 0xffffffffu;
  using Word = unsigned long long;
  int alike = 0;
  __match_all_sync(kAll, reinterpret_cast<Word>(to), &alike);
  if (alike) {
    RowTally sum = found;
    for (int d = 16; d > 0; d /= 2) {
      const std::uint64_t other = __shfl_xor_sync(kAll, static_cast<Word>(sum.max_bits), d);
      sum.max_bits = other > sum.max_bits ? other : sum.max_bits;
      sum.squares.low += __shfl_xor_sync(kAll, static_cast<Word>(sum.squares.low), d);
      sum.squares.high += __shfl_xor_sync(kAll, static_cast<Word>(sum.squares.high), d);
      sum.covered += __shfl_xor_sync(kAll, sum.covered, d);
      sum.summed += __shfl_xor_sync(kAll, sum.summed, d);
      sum.overcovered += __shfl_xor_sync(kAll, sum.overcovered, d);
    }
    if (to && (threadIdx.x & 31u) == 0) sum.add_to(to);
    return;
  }
#endif
  if (to) found.add_to(to);
}

/// Of all triangles' rows, those that are looked at together. Their samples are cut into pieces: rows differ in length, and a thread that has
/// more to do than others keeps all of them waiting.
struct RowRange {
  std::uint32_t begin = 0, count = 0;
  std::uint32_t piece = 1;               ///< samples in a piece, at most
  MeteredRow* rows = nullptr;
  std::uint32_t* piece_start = nullptr;  ///< indexed by row of the range, one more at the end: its first piece
  std::uint32_t* beyond = nullptr;       ///< rows of the range whose triangle may show samples beyond its edges, in any order
  std::uint32_t* beyond_count = nullptr;
};

/// Threads that take `each` of n things, one after the other, as many apart as threads run in step; for whole groups of these.
inline std::size_t threads_for(std::uint32_t n, std::uint32_t each, std::uint32_t in_step) {
  const std::size_t together = std::size_t{in_step} * each;
  return (n + together - 1) / together * in_step;
}
/// The first of them, of thread i.
CORDILLERA_HD inline std::uint32_t first_of(std::size_t i, std::uint32_t each) {
  return static_cast<std::uint32_t>(i / kInStep) * kInStep * each + static_cast<std::uint32_t>(i % kInStep);
}

/// Which samples every row of a range has.
struct PlaceRows {
  static constexpr std::uint32_t kEach = 8;
  static constexpr int kBlocksAtOnce = 4;

  MeterArrays in;
  std::uint32_t triangles;
  RowRange range;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t first = first_of(i, kEach);
    const auto start = [&](std::uint32_t k) { return in.row_start[k]; };
    std::uint32_t t = owner_of(range.begin + first, triangles, start);
    for (std::uint32_t at = first; at < range.count && at < first + kEach * kInStep; at += kInStep) {
      t = owner_from(t, range.begin + at, triangles, start);
      const MeteredTriangle& triangle = in.metered[t];
      const std::int64_t y = triangle.first_row + static_cast<std::int64_t>(range.begin + at - in.row_start[t]);
      MeteredRow row;
      row.set(t, y, triangle.row(y, false));
      range.rows[at] = row;
      range.piece_start[at] = (static_cast<std::uint32_t>(row.last - row.first + 1) + range.piece - 1) / range.piece;
      if (triangle.slacks) range.beyond[fetch_add(range.beyond_count, 1)] = at;
    }
  }
};

/// The samples of a range, piece by piece.
struct MeasurePieces {
  static constexpr std::uint32_t kEach = 4;
  static constexpr int kBlocksAtOnce = 2;

  MeterArrays in;
  RowRange range;
  std::uint32_t pieces;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t first = first_of(i, kEach);
    const auto start = [&](std::uint32_t k) { return range.piece_start[k]; };
    std::uint32_t at = owner_of(first < pieces ? first : pieces - 1, range.count, start);
    TileTally* to = nullptr;
    RowTally found;
    for (std::uint32_t piece = first; piece < pieces && piece < first + kEach * kInStep; piece += kInStep) {
      at = owner_from(at, piece, range.count, start);
      const MeteredRow row = range.rows[at];
      const MeteredTriangle& triangle = in.metered[row.triangle];
      TileTally* const its = in.tally + triangle.tile;
      if (to != its) {
        if (to) found.add_to(to);
        found = {};
        to = its;
      }
      measure(in.tiles[triangle.tile], triangle, row, piece - range.piece_start[at], found);
    }
    add_together(to, found);
  }

 private:
  CORDILLERA_HD void measure(const MeteredTile& tile, const MeteredTriangle& triangle, const MeteredRow& row, std::uint32_t piece, RowTally& tally) const {
    if (!tile.all_valid && piece == 0) tally.overcovered += row.strict_count();
    if (row.y < tile.rows.first || row.y > tile.rows.last) return;
    const std::int64_t begin = row.first + std::int64_t{piece} * range.piece, end = begin + range.piece - 1;
    const Span mine{begin, end < row.last ? end : row.last};
    for (const SampleWindow::Stretch& s : tile.stretch) {
      const Span part = intersection(mine, s.columns);
      if (part.first > part.last) continue;
      const Samples samples{in.sample_row(tile, row.y) + s.shift, in.column_frame + s.shift, static_cast<std::int32_t>(part.first),
                            static_cast<std::int32_t>(part.last), tile.all_valid != 0};
      inside(samples, triangle, row, in.frame_of_row(tile, row.y), tally);
    }
  }

  struct Samples {
    const std::int32_t* height;
    const proto::ColumnFrame* frame;
    std::int32_t first, last;
    bool all_valid;
  };
  CORDILLERA_HD static void inside(const Samples& samples, const MeteredTriangle& t, const MeteredRow& row, const proto::RowFrame& frame,
                                   RowTally& tally) {
    const bool exact_shows = t.exact.shows(), rounded_shows = t.rounded.shows();
    const PlaneRow exact(t.exact, frame), rounded(t.rounded, frame);
    std::uint32_t covered = 0;
    double worst_m = 0;
    for (std::int32_t x = samples.first; x <= samples.last; ++x) {
      const std::int32_t height = samples.height[x];
      if (height == proto::kNoHeight) continue;
      const bool counts = row.owns(x);
      covered += counts;
      if (!samples.all_valid && row.is_strict(x)) tally.overcovered -= 1;
      const double h = height * proto::kHeightStep_m;
      const proto::ColumnFrame column = samples.frame[x];
      if (exact_shows) {
        const double e = distance(t.exact_range.clamp(exact.height_m(column.sin_lon, column.cos_lon)), h);
        if (counts) tally.squares.add(square_steps(e));
        worst_m = detail::most(e, worst_m);
      }
      if (rounded_shows) worst_m = detail::most(distance(t.rounded_range.clamp(rounded.height_m(column.sin_lon, column.cos_lon)), h), worst_m);
    }
    tally.covered += covered;
    if (exact_shows) tally.summed += covered;
    tally.raise(worst_m + t.place_m);
  }
  CORDILLERA_HD static double distance(double surface_m, double sample_m) {
    const double d = surface_m - sample_m;
    return d < 0 ? -d : d;
  }
};

/// Samples outside plan triangles that chords may show: few triangles are so large. Over the rows of `beyond`.
struct MeasureBeyond {
  MeterArrays in;
  RowRange range;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const MeteredRow row = range.rows[range.beyond[i]];
    const MeteredTriangle& triangle = in.metered[row.triangle];
    const MeteredTile& tile = in.tiles[triangle.tile];
    if (row.y < tile.rows.first || row.y > tile.rows.last) return;
    const Span shown = triangle.row(row.y, true).shown;
    for (const SampleWindow::Stretch& s : tile.stretch) {
      const Span part = intersection(shown, s.columns);
      if (row.first > row.last) {
        measure(row, s, part);
        continue;
      }
      measure(row, s, {part.first, part.last < row.first - 1 ? part.last : row.first - 1});
      measure(row, s, {part.first > row.last + 1 ? part.first : row.last + 1, part.last});
    }
  }

 private:
  CORDILLERA_HD void measure(const MeteredRow& row, const SampleWindow::Stretch& s, const Span& span) const {
    if (span.first > span.last) return;
    const MeteredTriangle& metered = in.metered[row.triangle];
    const MeteredTile& tile = in.tiles[metered.tile];
    const MeasuredTriangle triangle = in.triangle(row.triangle);  // with its corners
    const std::int32_t* const heights = in.sample_row(tile, row.y) + s.shift;
    for (std::int64_t x = span.first; x <= span.last; ++x) {
      if (heights[x] == proto::kNoHeight) continue;
      const double e = triangle.error_beyond(in.frame_of_row(tile, row.y), in.column_frame[x + s.shift], heights[x] * proto::kHeightStep_m);
      raise_to(&in.tally[metered.tile].max_bits, double_bits(e + metered.place_m));
    }
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
