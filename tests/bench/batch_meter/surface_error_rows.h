#pragma once
// Measuring the tiles of a batch: the rows of samples that triangles may show, found, cut into pieces, and compared with the
// triangles.
#include <cstdint>

#include "tests/bench/batch_meter/surface_error_arrays.h"

namespace cordillera::gpu {

/// Of all triangles' rows, those that are looked at together. Their samples are cut into pieces: rows differ in length, and a
/// thread that has more to do than others keeps all of them waiting.
struct RowRange {
  std::uint32_t begin = 0, count = 0;
  std::uint32_t piece = 1;  ///< samples in a piece, at most
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

/// An order of threads in which the first ones look at places all over the batch: what is known of a tile's error then spares the
/// others work.
class Scattered {
 public:
  /// in_step: threads that run in step; whole groups of them stay together.
  Scattered(std::size_t threads, std::uint32_t in_step) : block_(kGroups * in_step) {
    const std::size_t blocks = (threads + block_ - 1) / block_;
    apart_ = static_cast<std::uint32_t>((blocks + kPlaces - 1) / kPlaces);
  }
  std::size_t threads() const { return std::size_t{block_} * kPlaces * apart_; }
  CORDILLERA_HD std::size_t operator()(std::size_t i) const {
    const std::size_t block = i / block_;
    return ((block % kPlaces) * apart_ + block / kPlaces) * block_ + i % block_;
  }

 private:
  static constexpr std::uint32_t kGroups = 8, kPlaces = 512;
  std::uint32_t block_, apart_;
};

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
      row.find_samples(in.tiles[triangle.tile]);
      range.rows[at] = row;
      range.piece_start[at] = (static_cast<std::uint32_t>(row.last - row.first + 1) + range.piece - 1) / range.piece;
      if (triangle.slacks) range.beyond[fetch_add(range.beyond_count, 1)] = at;
    }
  }
};

/// The samples of a range, piece by piece.
struct MeasurePieces {
  static constexpr std::uint32_t kEach = 8;
  static constexpr int kBlocksAtOnce = 4;

  MeterArrays in;
  RowRange range;
  std::uint32_t pieces;
  Scattered order;

  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::uint32_t first = first_of(order(i), kEach);
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
      const std::uint64_t known = get_shared(&to->max_bits);
      measure(triangle, row, piece - range.piece_start[at], bits_double(found.max_bits > known ? found.max_bits : known), found);
    }
    add_together(to, found);
  }

 private:
  CORDILLERA_HD void measure(const MeteredTriangle& triangle, const MeteredRow& row, std::uint32_t piece, double found_m,
                             RowTally& tally) const {
    const auto begin = static_cast<std::int32_t>(row.first + piece * range.piece),
               end = begin + static_cast<std::int32_t>(range.piece) - 1;
    const std::int32_t last = end < row.last ? end : row.last;
    const bool plain = (row.ends & MeteredRow::kPlain) != 0;
    const MeteredTile& tile = in.tiles[triangle.tile];
    if (!plain && !tile.all_valid && piece == 0) tally.overcovered += row.strict_count();
    for (int k = 0; k < (plain ? 1 : 2); ++k) {
      Samples samples{row.sample_row, row.shift, begin, last, true};
      if (!plain && !samples.keep(tile, tile.stretch[k], row.y)) continue;
      inside(samples, triangle, row, found_m, tally);
    }
  }

  struct Samples {
    std::int64_t row, shift;
    std::int32_t first, last;  ///< tile-local columns
    bool all_valid;

    /// Only those of a stretch; false if there are none.
    CORDILLERA_HD bool keep(const MeteredTile& tile, const SampleWindow::Stretch& stretch, std::int32_t y) {
      const Span part = intersection({first, last}, stretch.columns);
      if (part.first > part.last || y < tile.rows.first || y > tile.rows.last) return false;
      row = y + tile.row_shift;
      shift = stretch.shift;
      first = static_cast<std::int32_t>(part.first);
      last = static_cast<std::int32_t>(part.last);
      all_valid = tile.all_valid != 0;
      return true;
    }
  };
  /// found_m: the tile is known to be so far off.
  CORDILLERA_HD void inside(const Samples& samples, const MeteredTriangle& t, const MeteredRow& row, double found_m,
                            RowTally& tally) const {
    const bool exact_shows = t.exact.shows();
    double worst_m = exact_shows ? exact(samples, t, row, tally) : 0;
    count(samples, row, exact_shows, tally);
    // As in SurfaceMeter: where the exact decoding is good enough, the rounded one cannot be the worst of the tile. Without it,
    // apart is infinite.
    const bool asks = worst_m + t.apart_m + t.place_m > found_m;
    if (asks && t.rounded.shows()) worst_m = detail::most(rounded(samples, t), worst_m);
    tally.raise(worst_m + t.place_m);
  }
  CORDILLERA_HD double exact(const Samples& samples, const MeteredTriangle& t, const MeteredRow& row, RowTally& tally) const {
    const MeteredRow::Part owned = row.owned();
    return worst(samples, t.exact, t.exact_range, [&](std::int32_t x, double e) {
      if (owned.holds(x)) tally.squares.add(square_steps(e));
    });
  }
  CORDILLERA_HD double rounded(const Samples& samples, const MeteredTriangle& t) const {
    return worst(samples, t.rounded, t.rounded_range, [](std::int32_t, double) {});
  }
  /// The greatest distance of a plane from the samples; each(x, distance) of all of them.
  template <class Each>
  CORDILLERA_HD double worst(const Samples& samples, const Plane& plane, const HeightRange& heights_m, const Each& each) const {
    const PlaneRow along(plane, in.row_frame[samples.row]);
    const std::int32_t* const heights = heights_of(samples);
    const proto::ColumnFrame* const frames = in.column_frame + samples.shift;
    double worst_m = 0;
    for (std::int32_t x = samples.first; x <= samples.last; ++x) {
      if (heights[x] == proto::kNoHeight) continue;
      const proto::ColumnFrame column = frames[x];
      const double e =
          distance(heights_m.clamp(along.height_m(column.sin_lon, column.cos_lon)), heights[x] * proto::kHeightStep_m);
      each(x, e);
      worst_m = detail::most(e, worst_m);
    }
    return worst_m;
  }
  CORDILLERA_HD void count(const Samples& samples, const MeteredRow& row, bool summed, RowTally& tally) const {
    const MeteredRow::Part owned = row.owned(), strict = row.strict();
    std::uint32_t covered = 0;
    if (samples.all_valid) {
      const std::int32_t first = owned.first > samples.first ? owned.first : samples.first;
      const std::int32_t last = owned.last < samples.last ? owned.last : samples.last;
      covered = last < first ? 0 : static_cast<std::uint32_t>(last - first + 1);
    } else {
      const std::int32_t* const heights = heights_of(samples);
      for (std::int32_t x = samples.first; x <= samples.last; ++x) {
        if (heights[x] == proto::kNoHeight) continue;
        covered += owned.holds(x);
        if (strict.holds(x)) tally.overcovered -= 1;
      }
    }
    tally.covered += covered;
    if (summed) tally.summed += covered;
  }
  CORDILLERA_HD const std::int32_t* heights_of(const Samples& samples) const {
    return in.samples + samples.row * in.columns + samples.shift;
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
      const double e =
          triangle.error_beyond(in.frame_of_row(tile, row.y), in.column_frame[x + s.shift], heights[x] * proto::kHeightStep_m);
      raise_to(&in.tally[metered.tile].max_bits, double_bits(e + metered.place_m));
    }
  }
};

}  // namespace cordillera::gpu
