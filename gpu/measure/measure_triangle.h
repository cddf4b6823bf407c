#pragma once
// One triangle of a tile against the samples under it, by as many threads as there are: SurfaceMeter::worst for a GPU. The same
// functions of a triangle and the same sums of whole numbers, so the same bits.
#include <cstdint>

#include "gpu/device/bits.h"
#include "gpu/measure/surface_error_apart.h"
#include "gpu/measure/surface_error_triangle.h"
#include "gpu/measure/surface_error_window.h"
#include "gpu/mesh/mesh_point.h"

namespace cordillera::gpu {

/// A tile, and where its samples lie in those on the device; see SampleWindow.
struct MeteredTile {
  TileFacts facts;
  Span rows;
  std::int64_t row_shift = 0;
  SampleWindow::Stretch stretch[2];
};

/// What is asked of a triangle.
struct AskedTriangle {
  static constexpr std::uint32_t kNone = UINT32_MAX;
  MeshPoint corners[3];     ///< in rows and columns that the samples have
  std::uint32_t owned = 0;  ///< see measured_triangle
  std::uint32_t tile = kNone;
};

/// And what it is: see SurfaceMemory::Triangle.
struct FoundTriangle {
  double error_m = -1;
  SquareSum squares;
  std::uint32_t covered = 0, summed = 0, overcovered = 0;
};

struct MeasureTriangle {
  const std::int32_t* samples = nullptr;
  std::int64_t columns = 0;                    ///< of the samples
  const proto::RowFrame* row_frame = nullptr;  ///< indexed by sample row
  const proto::ColumnFrame* column_frame = nullptr;
  const MeteredTile* tiles = nullptr;
  const AskedTriangle* asked = nullptr;
  FoundTriangle* found = nullptr;

  template <class Lanes>
  CORDILLERA_HD void operator()(std::size_t i, const Lanes& lanes) const {
    const AskedTriangle& a = asked[i];
    if (a.tile == AskedTriangle::kNone) return;
    const MeteredTile& tile = tiles[a.tile];
    const Corner corners[3] = {corner(tile, a.corners[0]), corner(tile, a.corners[1]), corner(tile, a.corners[2])};
    const MeasuredTriangle triangle = measured_triangle(tile.facts, corners, a.owned);
    Seen seen;
    seen.apart_m = decodings_apart_m(triangle, tile.facts.unit_rad);
    for (std::int64_t y = triangle.plan.rows.first + lanes.row(); y <= triangle.plan.rows.last; y += lanes.rows())
      row(tile, triangle, y, lanes, seen);
    sum_up(triangle, seen, lanes, found[i]);
  }

 private:
  /// By one of the threads.
  struct Seen {
    double apart_m = 0;   ///< see decodings_apart_m
    double error_m = -1;  ///< none
    SquareSum squares;
    std::uint64_t covered = 0, overcovered = 0;  ///< the latter is less than nothing on the way

    CORDILLERA_HD void raise(double m) { error_m = m > error_m ? m : error_m; }
  };

  CORDILLERA_HD Corner corner(const MeteredTile& tile, const MeshPoint& p) const {
    const SampleWindow::Stretch& first = tile.stretch[0];
    const bool in_first = p.x >= first.columns.first && p.x <= first.columns.last;
    const double height_m = p.height * proto::kHeightStep_m;
    const proto::RowFrame row = row_frame[p.y + tile.row_shift];
    const proto::Vec3 at = proto::ecef(row, column_frame[p.x + (in_first ? first.shift : tile.stretch[1].shift)], height_m);
    return {p.x, p.y, height_m, at, tile.facts.ecef_steps.rounded(at, height_m), row};
  }

  template <class Lanes>
  CORDILLERA_HD void row(const MeteredTile& tile, const MeasuredTriangle& t, std::int64_t y, const Lanes& lanes,
                         Seen& seen) const {
    const RowSpans spans = t.plan.row(y);
    if (lanes.column() == 0) seen.overcovered += length(spans.strict);
    if (y < tile.rows.first || y > tile.rows.last) return;
    for (const SampleWindow::Stretch& stretch : tile.stretch) {
      const Line line(*this, tile, stretch, y);
      inside(t, spans, line, lanes, seen);
      if (!t.plan.slack) continue;
      const Span shown = intersection(spans.shown, stretch.columns);
      if (length(spans.closed) == 0) {
        beyond(t, shown, line, lanes, seen);
        continue;
      }
      beyond(t, intersection(shown, {shown.first, spans.closed.first - 1}), line, lanes, seen);
      beyond(t, intersection(shown, {spans.closed.last + 1, shown.last}), line, lanes, seen);
    }
  }

  /// The samples of a row in a stretch of columns.
  struct Line {
    const proto::RowFrame row;
    const proto::ColumnFrame* const column;  ///< indexed by column of the tile, as the heights
    const std::int32_t* const height;
    const Span columns;

    CORDILLERA_HD Line(const MeasureTriangle& m, const MeteredTile& tile, const SampleWindow::Stretch& stretch, std::int64_t y)
        : row(m.row_frame[y + tile.row_shift]),
          column(m.column_frame + stretch.shift),
          height(m.samples + (y + tile.row_shift) * m.columns + stretch.shift),
          columns(stretch.columns) {}
  };

  template <class Lanes>
  CORDILLERA_HD static void inside(const MeasuredTriangle& t, const RowSpans& spans, const Line& line, const Lanes& lanes,
                                   Seen& seen) {
    const Span closed = intersection(spans.closed, line.columns);
    if (closed.last < closed.first) return;
    seen.raise(0);
    const bool shows = t.exact.shows(), rounded_shows = t.rounded.shows();
    const PlaneRow exact(t.exact, line.row), rounded(t.rounded, line.row);
    for (std::int64_t x = closed.first + lanes.column(); x <= closed.last; x += lanes.columns()) {
      if (line.height[x] == proto::kNoHeight) continue;
      const double height_m = line.height[x] * proto::kHeightStep_m;
      const proto::ColumnFrame column = line.column[x];
      const bool owned = x >= spans.owned.first && x <= spans.owned.last;
      const double exact_m = shows ? distance(exact, t.exact_range, column, height_m) : 0;
      seen.raise(exact_m);
      // Where the exact decoding is good enough, the rounded one cannot be the worst.
      if (rounded_shows && exact_m + seen.apart_m > seen.error_m)
        seen.raise(distance(rounded, t.rounded_range, column, height_m));
      if (owned && shows) seen.squares.add(square_steps(exact_m));
      seen.covered += owned ? 1 : 0;
      seen.overcovered -= x >= spans.strict.first && x <= spans.strict.last ? 1 : 0;
    }
  }

  template <class Lanes>
  CORDILLERA_HD static void beyond(const MeasuredTriangle& t, const Span& span, const Line& line, const Lanes& lanes,
                                   Seen& seen) {
    for (std::int64_t x = span.first + lanes.column(); x <= span.last; x += lanes.columns()) {
      if (line.height[x] != proto::kNoHeight)
        seen.raise(t.error_beyond(line.row, line.column[x], line.height[x] * proto::kHeightStep_m));
    }
  }

  CORDILLERA_HD static double distance(const PlaneRow& plane, const HeightRange& range, const proto::ColumnFrame& column,
                                       double height_m) {
    const double d = range.clamp(plane.height_m(column.sin_lon, column.cos_lon)) - height_m;
    return d < 0 ? -d : d;
  }

  template <class Lanes>
  CORDILLERA_HD static void sum_up(const MeasuredTriangle& t, const Seen& seen, const Lanes& lanes, FoundTriangle& found) {
    // Bits of doubles that are not negative are in the order of these, but for those of -0; 0 is for none.
    const std::uint64_t error = lanes.max(seen.error_m < 0 ? 0 : double_bits(seen.error_m + 0.0) + 1);
    FoundTriangle all;
    if (error > 0) all.error_m = bits_double(error - 1) + place_error_m(t);
    all.squares = {lanes.sum(seen.squares.low), lanes.sum(seen.squares.high)};
    all.covered = static_cast<std::uint32_t>(lanes.sum(seen.covered));
    all.overcovered = static_cast<std::uint32_t>(lanes.sum(seen.overcovered));
    all.summed = t.exact.shows() ? all.covered : 0;
    if (lanes.index() == 0) found = all;
  }
};

}  // namespace cordillera::gpu
