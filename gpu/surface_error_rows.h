#pragma once
// Measuring the tiles of a batch: the rows of samples that triangles may show, found, cut into pieces, and compared with the triangles.
#include <cstdint>

#include "gpu/surface_error_arrays.h"

namespace cordillera::gpu {

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
  CORDILLERA_HD void measure(const MeteredTile& tile, const MeteredTriangle& triangle, const MeteredRow& row, std::uint32_t piece,
                             RowTally& tally) const {
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

}  // namespace cordillera::gpu
