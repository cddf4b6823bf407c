#pragma once
// Measures triangles of a tile, one at a time, against the finest samples below them.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <memory>
#include <utility>

#include "gpu/measure/sample_frames.h"
#include "gpu/measure/surface_error.h"
#include "gpu/measure/surface_error_apart.h"
#include "gpu/measure/surface_error_row.h"
#include "gpu/measure/surface_error_triangle.h"
#include "gpu/measure/surface_error_window.h"
#include "gpu/refine/refine.h"

namespace cordillera::gpu {

/// A sample and how far the triangle is from it; error_m < 0: none.
struct WorstSample {
  std::int64_t x = 0, y = 0;
  double error_m = -1;
};

struct TriangleWorst {
  WorstSample any;     ///< of all samples the triangle may show; where the error is within the limit, x is not looked for
  WorstSample inside;  ///< of rows over the limit: samples in the closed triangle that could become vertices
};

/// Of the mesh's vertices.
inline std::pair<double, double> height_range_m(const proto::TileMesh& mesh) {
  double low_m = proto::kMaxHeight_m, high_m = -proto::kMaxHeight_m;
  for (const std::int32_t h : mesh.height) {
    low_m = std::min(low_m, h * proto::kHeightStep_m);
    high_m = std::max(high_m, h * proto::kHeightStep_m);
  }
  return {std::min(low_m, high_m), std::max(low_m, high_m)};
}

/// range_m: no corner that will be measured is lower or higher.
inline TileFacts tile_facts(const SurfaceErrorInput& in, std::pair<double, double> range_m) {
  const proto::Lattice& lattice = *in.lattice;
  const std::int64_t south = in.lattice->south(in.tile);
  TileFacts tile;
  tile.side = in.mesh->side;
  tile.unit_rad = M_PI / static_cast<double>(lattice.rows());
  tile.ecef_steps = in.ecef_steps;
  tile.off_south_pole = proto::row_frame(lattice, 1);
  tile.off_north_pole = proto::row_frame(lattice, lattice.rows() - 1);
  tile.small_units = small_units(tile, proto::row_frame(lattice, south), proto::row_frame(lattice, south + tile.side),
                                 range_m.first, range_m.second);
  return tile;
}

/// Nothing is counted or summed.
struct NoTally {
  static constexpr bool kSums = false;
  void row(const RowSpans&) const {}
  void samples(const MeasuredTriangle&, const std::int32_t*, const Span&, const Span&) const {}
  void errors(std::int64_t, const Span&, const double*) const {}
};

class SurfaceMeter {
 public:
  /// Borrows what input points to. range_m: no corner that will be measured is lower or higher.
  SurfaceMeter(const SurfaceErrorInput& in, std::pair<double, double> range_m)
      : lattice_(*in.lattice),
        west_(in.lattice->west(in.tile)),
        south_(in.lattice->south(in.tile)),
        side_(in.mesh->side),
        window_(in, in.mesh->side),
        own_frames_(in.frames ? nullptr : std::make_unique<SampleFrames>(lattice_, *in.samples)),
        frames_(in.frames ? *in.frames : *own_frames_),
        tile_(tile_facts(in, range_m)) {
    for (std::size_t k = 0; k < strips_.size(); ++k) strips_[k] = {window_.stretches()[k].columns, window_.stretches()[k].shift};
  }

  const SampleWindow& window() const { return window_; }

  Corner corner(std::int32_t x, std::int32_t y, std::int32_t height) const {
    const double h = height * proto::kHeightStep_m;
    const bool within = y >= window_.rows().first && y <= window_.rows().last;
    const proto::RowFrame row = within ? frame(y) : proto::row_frame(lattice_, south_ + y);
    const proto::Vec3 p = proto::ecef(row, column_frame(x), h);
    return {x, y, h, p, tile_.ecef_steps.rounded(p, h), row};
  }
  /// owned: see measured_triangle.
  MeasuredTriangle triangle(const Corner (&corners)[3], unsigned owned) const { return measured_triangle(tile_, corners, owned); }

  /// Tally: row(spans) for each row, samples(triangle, heights, owned, strict) and errors(first, owned, out) for each stretch of
  /// samples in it; kSums: out is wanted. Where the error is within the limit, those up to floor_m need not be told apart.
  template <class Tally>
  TriangleWorst worst(const MeasuredTriangle& t, double limit_m, Tally& tally, double floor_m = -1) const {
    TriangleWorst worst;
    const double place_m = place_error_m(t), apart_m = decodings_apart_m(t, tile_.unit_rad),
                 least_m = less_than(floor_m, place_m);
    const double within_m = std::min(limit_m, less_than(limit_m, place_m));  // with place_m on top, too
    for (std::int64_t y = t.plan.rows.first; y <= t.plan.rows.last; ++y) {
      row(t, y, {limit_m, apart_m, std::min(within_m, std::max(least_m, worst.any.error_m))}, tally, worst);
    }
    if (worst.any.error_m >= 0) worst.any.error_m += place_m;
    return worst;
  }

  /// any.error_m, as far as it is asked for.
  double greatest_m(const MeasuredTriangle& t, const Glance& asked) const {
    const double place_m = place_error_m(t), apart_m = decodings_apart_m(t, tile_.unit_rad),
                 least_m = less_than(asked.floor_m, place_m);
    TriangleWorst worst;
    NoTally tally;
    const auto passed = [&](std::int64_t y) {
      row(t, y, {INFINITY, apart_m, std::max(least_m, worst.any.error_m)}, tally, worst);
      return worst.any.error_m >= 0 && worst.any.error_m + place_m > asked.enough_m;
    };
    const auto each = [&](std::int64_t from, std::int64_t step) {
      for (std::int64_t y = t.plan.rows.first + from; y <= t.plan.rows.last; y += step)
        if (passed(y)) return true;
      return false;
    };
    // Then rows far apart: what is wrong with a triangle is seldom wrong in one row alone.
    constexpr std::int64_t kWidest = 16;
    bool over = asked.row >= t.plan.rows.first && asked.row <= t.plan.rows.last && passed(asked.row);
    over = over || each(0, kWidest);
    for (std::int64_t step = kWidest; step > 1 && !over; step /= 2) over = each(step / 2, step);
    return worst.any.error_m < 0 ? worst.any.error_m : worst.any.error_m + place_m;
  }

 private:
  static constexpr std::size_t kBlock = 256;

  /// Columns of the tile that have samples: sample column = column + shift.
  struct Strip {
    Span columns;
    std::int64_t shift = 0;
  };
  /// What of a triangle matters in a row.
  struct Asked {
    double limit_m;  ///< beyond it the worst sample is looked for
    double apart_m;  ///< see decodings_apart_m
    double known_m;  ///< a row whose samples are no farther off changes nothing
  };

  /// What, with place_m added, is rounded to no more than floor_m.
  static double less_than(double floor_m, double place_m) { return (floor_m - place_m) * (1 - 0x1p-40); }

  const proto::RowFrame& frame(std::int64_t y) const { return frames_.rows[static_cast<std::size_t>(y + window_.row_shift())]; }
  proto::ColumnFrame column_frame(std::int64_t x) const {
    for (const Strip& s : strips_)
      if (x >= s.columns.first && x <= s.columns.last) return column_frame(s, x);
    return proto::column_frame(lattice_, west_ + x);
  }
  proto::ColumnFrame column_frame(const Strip& s, std::int64_t x) const {
    return frames_.column(static_cast<std::size_t>(x + s.shift));
  }

  template <class Tally>
  void row(const MeasuredTriangle& t, std::int64_t y, const Asked& asked, Tally& tally, TriangleWorst& worst) const {
    const RowSpans spans = t.plan.row(y);
    tally.row(spans);
    if (y < window_.rows().first || y > window_.rows().last) return;
    const std::int32_t* samples = window_.row(y);
    for (const Strip& s : strips_) {
      const Span shown = intersection(spans.shown, s.columns), closed = intersection(spans.closed, s.columns);
      const std::int32_t* heights = samples + s.shift;
      if (length(closed) > 0) {
        const Span owned = intersection(spans.owned, s.columns);
        tally.samples(t, heights, owned, intersection(spans.strict, s.columns));
        double row_max = exact_row(t, s, y, heights, closed, owned, tally);
        if (row_max + asked.apart_m > asked.known_m) row_max = std::max(row_max, rounded_row(t, s, y, heights, closed));
        if (row_max > worst.any.error_m) worst.any = {closed.first, y, row_max};
        if (row_max > asked.limit_m) find_worst(t, s, y, heights, closed, worst);
      }
      if (!t.plan.slack) continue;
      const bool apart = length(spans.closed) == 0;
      beyond(t, s, y, heights, {shown.first, apart ? shown.last : std::min(shown.last, spans.closed.first - 1)}, worst);
      if (!apart) beyond(t, s, y, heights, {std::max(shown.first, spans.closed.last + 1), shown.last}, worst);
    }
  }

  /// Samples outside the plan triangle that its chords may show: few, so each is tried for itself.
  void beyond(const MeasuredTriangle& t, const Strip& s, std::int64_t y, const std::int32_t* heights, const Span& span,
              TriangleWorst& worst) const {
    for (std::int64_t x = span.first; x <= span.last; ++x) {
      if (heights[x] == proto::kNoHeight) continue;
      const double e = t.error_beyond(frame(y), column_frame(s, x), heights[x] * proto::kHeightStep_m);
      if (e > worst.any.error_m) worst.any = {x, y, e};
    }
  }

  RowRun run(const Strip& strip, const std::int32_t* heights, std::int64_t first, std::uint64_t count) const {
    const auto k = static_cast<std::size_t>(first + strip.shift);
    return {frames_.sin_lon.data() + k, frames_.cos_lon.data() + k, heights + first, static_cast<std::size_t>(count)};
  }

  template <class Tally>
  double exact_row(const MeasuredTriangle& t, const Strip& s, std::int64_t y, const std::int32_t* heights, const Span& closed,
                   const Span& owned, Tally& tally) const {
    if (!t.exact.shows()) return 0;
    const PlaneRow plane(t.exact, frame(y));
    if constexpr (!Tally::kSums) return greatest_row_error(plane, t.exact_range, run(s, heights, closed.first, length(closed)));
    double out[kBlock], greatest = 0;
    for (std::int64_t x = closed.first; x <= closed.last; x += kBlock) {
      const std::int64_t last = std::min<std::int64_t>(x + kBlock - 1, closed.last);
      greatest = std::max(greatest, row_errors(plane, t.exact_range, run(s, heights, x, length({x, last})), out));
      tally.errors(x, intersection(owned, {x, last}), out);
    }
    return greatest;
  }

  double rounded_row(const MeasuredTriangle& t, const Strip& s, std::int64_t y, const std::int32_t* heights,
                     const Span& closed) const {
    if (!t.rounded.shows()) return 0;
    return greatest_row_error(PlaneRow(t.rounded, frame(y)), t.rounded_range, run(s, heights, closed.first, length(closed)));
  }

  /// The slow way, for rows above the limit only: which sample it is.
  void find_worst(const MeasuredTriangle& t, const Strip& strip, std::int64_t y, const std::int32_t* heights, const Span& closed,
                  TriangleWorst& worst) const {
    const PlaneRow exact(t.exact, frame(y)), rounded(t.rounded, frame(y));
    for (std::int64_t x = closed.first; x <= closed.last; ++x) {
      if (heights[x] == proto::kNoHeight) continue;
      const auto [s, c] = column_frame(strip, x);
      const double h = heights[x] * proto::kHeightStep_m;
      double e = 0;
      if (t.exact.shows()) e = std::abs(t.exact_range.clamp(exact.height_m(s, c)) - h);
      if (t.rounded.shows()) e = std::max(e, std::abs(t.rounded_range.clamp(rounded.height_m(s, c)) - h));
      if (y == worst.any.y && e == worst.any.error_m) worst.any.x = x;
      // The tile's border is for its chain to choose, and corners are vertices already.
      bool taken = x == 0 || x == side_ || y == 0 || y == side_;
      for (const PlanEdge& edge : t.plan.edge) taken |= edge.x == x && edge.y == y;
      if (!taken && e > worst.inside.error_m) worst.inside = {x, y, e};
    }
  }

  const proto::Lattice& lattice_;
  std::int64_t west_, south_;
  std::int32_t side_;
  SampleWindow window_;
  std::unique_ptr<SampleFrames> own_frames_;
  const SampleFrames& frames_;
  TileFacts tile_;
  std::array<Strip, 2> strips_;
};

}  // namespace cordillera::gpu
