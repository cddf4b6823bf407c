#include "gpu/surface_error.h"

#include <algorithm>
#include <cmath>

#include "gpu/surface_error_triangle.h"
#include "gpu/surface_error_window.h"

namespace cordillera::gpu {
namespace {

class Measurement {
 public:
  Measurement(const SurfaceErrorInput& in, double limit_m)
      : in_(in), mesh_(*in.mesh), limit_m_(limit_m), window_(in, in.mesh->side), rims_(*in.mesh) {
    const auto frames = static_cast<std::size_t>(mesh_.side) + 1;
    if (in.row_frames.empty()) own_rows_ = proto::row_frames(*in.lattice, in.lattice->south(in.tile), frames);
    if (in.column_frames.empty()) own_columns_ = proto::column_frames(*in.lattice, in.lattice->west(in.tile), frames);
    rows_ = in.row_frames.empty() ? std::span<const proto::RowFrame>(own_rows_) : in.row_frames;
    columns_ = in.column_frames.empty() ? std::span<const proto::ColumnFrame>(own_columns_) : in.column_frames;
    sin_lon_.resize(frames);
    cos_lon_.resize(frames);
    for (std::size_t k = 0; k < frames; ++k) sin_lon_[k] = columns_[k].sin_lon, cos_lon_[k] = columns_[k].cos_lon;
    tile_.side = mesh_.side;
    tile_.unit_rad = M_PI / static_cast<double>(in.lattice->rows());
    tile_.step_m = in.ecef_step_m;
    tile_.rows = rows_.data();
  }

  SurfaceError run() {
    count_window();
    place_vertices();
    for (std::size_t t = 0; t < mesh_.triangles.size(); ++t) {
      const auto& v = mesh_.triangles[t];
      if (((mesh_.mark[v[0]] | mesh_.mark[v[1]] | mesh_.mark[v[2]]) & proto::kVoid) == 0) triangle(t);
    }
    measure_vertices();
    result_.sum_squared_m2 = sum_.value_m2();
    result_.samples = saturated(summed_);
    result_.uncovered = saturated(valid_ - covered_);
    result_.overcovered = saturated(overcovered_);
    return std::move(result_);
  }

 private:
  static constexpr std::size_t kBlock = 256;
  static constexpr std::size_t kLanes = 8;
  struct Best {
    std::int64_t x = 0, y = 0;
    double error_m = -1;
  };

  static std::uint32_t saturated(std::uint64_t n) { return static_cast<std::uint32_t>(std::min<std::uint64_t>(n, UINT32_MAX)); }

  void count_window() {
    const auto across = static_cast<std::uint64_t>(mesh_.side) + 1;
    for (std::int64_t y = window_.rows().first; y <= window_.rows().last; ++y)
      for (const auto& s : window_.stretches())
        valid_ += count_valid(window_.row(y) + s.columns.first + s.shift, static_cast<std::size_t>(length(s.columns)));
    all_valid_ = valid_ == across * across;
  }

  void place_vertices() {
    corners_.resize(mesh_.vertices());
    published_.assign(mesh_.vertices(), 0);
    double low_m = proto::kMaxHeight_m, high_m = -proto::kMaxHeight_m;
    for (std::size_t v = 0; v < corners_.size(); ++v) {
      const double h = mesh_.height[v] * proto::kHeightStep_m;
      const proto::Vec3 p = proto::ecef(rows_[mesh_.y[v]], columns_[mesh_.x[v]], h);
      corners_[v] = {mesh_.x[v], mesh_.y[v], h, p, round_to(p, tile_.step_m)};
      low_m = std::min(low_m, h);
      high_m = std::max(high_m, h);
    }
    tile_.small_units = small_units(tile_, std::min(low_m, high_m), std::max(low_m, high_m));
  }

  bool on_border(const Corner& a, const Corner& b) const {
    return (a.x == b.x && (a.x == 0 || a.x == mesh_.side)) || (a.y == b.y && (a.y == 0 || a.y == mesh_.side));
  }

  /// Of two triangles at an edge, the one that sees it run north (or due east) counts its samples.
  unsigned owned_edges(const std::array<std::uint32_t, 3>& t, const Corner (&c)[3]) const {
    unsigned owned = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned n = k == 2 ? 0 : k + 1;
      const bool first = c[n].y > c[k].y || (c[n].y == c[k].y && c[n].x > c[k].x);
      if (first || on_border(c[k], c[n]) || rims_.contains(t[k], t[n])) owned |= 1u << k;
    }
    return owned;
  }

  void triangle(std::size_t index) {
    const auto& v = mesh_.triangles[index];
    for (const std::uint32_t i : v) published_[i] = 1;
    const Corner corners[3] = {corners_[v[0]], corners_[v[1]], corners_[v[2]]};
    const MeasuredTriangle t = measured_triangle(tile_, corners, owned_edges(v, corners));
    worst_ = inside_ = {};
    for (std::int64_t y = t.plan.rows.first; y <= t.plan.rows.last; ++y) row(t, y);
    result_.max_m = std::max(result_.max_m, worst_.error_m);
    if (worst_.error_m <= limit_m_) return;
    const Best& put = inside_.error_m > limit_m_ ? inside_ : worst_;
    result_.over_limit.push_back(
        {static_cast<std::uint32_t>(index), static_cast<std::int32_t>(put.x), static_cast<std::int32_t>(put.y), worst_.error_m});
  }

  void row(const MeasuredTriangle& t, std::int64_t y) {
    const RowSpans spans = t.plan.row(y);
    if (!all_valid_) overcovered_ += length(spans.strict);
    if (y < window_.rows().first || y > window_.rows().last) return;
    const std::int32_t* samples = window_.row(y);
    for (const auto& s : window_.stretches()) {
      const Span shown = intersection(spans.shown, s.columns), closed = intersection(spans.closed, s.columns);
      const std::int32_t* heights = samples + s.shift;
      if (length(closed) > 0) inside(t, y, heights, closed, spans, s.columns);
      if (!t.plan.slack) continue;
      const bool apart = length(spans.closed) == 0;
      beyond(t, y, heights, {shown.first, apart ? shown.last : std::min(shown.last, spans.closed.first - 1)});
      if (!apart) beyond(t, y, heights, {std::max(shown.first, spans.closed.last + 1), shown.last});
    }
  }

  void inside(const MeasuredTriangle& t, std::int64_t y, const std::int32_t* heights, const Span& closed, const RowSpans& spans,
              const Span& columns) {
    const Span owned = intersection(spans.owned, columns);
    count(t, heights, owned, intersection(spans.strict, columns));
    const double row_max = std::max(exact_row(t, y, heights, closed, owned), rounded_row(t, y, heights, closed));
    if (row_max > worst_.error_m) worst_ = {closed.first, y, row_max};
    if (row_max > limit_m_) find_worst(t, y, heights, closed);
  }

  /// Samples outside the plan triangle that its chords may show: few, so each is tried for itself.
  void beyond(const MeasuredTriangle& t, std::int64_t y, const std::int32_t* heights, const Span& span) {
    for (std::int64_t x = span.first; x <= span.last; ++x) {
      if (heights[x] == proto::kNoHeight) continue;
      const double e = t.error_beyond(rows_[y], columns_[x], heights[x] * proto::kHeightStep_m);
      if (e > worst_.error_m) worst_ = {x, y, e};
    }
  }

  void count(const MeasuredTriangle& t, const std::int32_t* heights, const Span& owned, const Span& strict) {
    std::uint64_t valid = length(owned);
    if (!all_valid_) {
      valid = count_valid(heights + owned.first, static_cast<std::size_t>(length(owned)));
      overcovered_ -= count_valid(heights + strict.first, static_cast<std::size_t>(length(strict)));
    }
    covered_ += valid;
    if (t.exact.shows()) summed_ += valid;
  }

  /// |plane - sample| for n columns from first; 0 where the sample is invalid. Returns the greatest.
  double errors(const PlaneRow& plane, const HeightRange& range, const std::int32_t* heights, std::int64_t first, std::size_t n,
                double* out) const {
    const double *s = sin_lon_.data() + first, *c = cos_lon_.data() + first;
    const std::int32_t* h = heights + first;
    for (std::size_t k = 0; k < n; ++k) {
      const double e = std::abs(range.clamp(plane.height_m(s[k], c[k])) - h[k] * proto::kHeightStep_m);
      out[k] = h[k] == proto::kNoHeight ? 0 : e;
    }
    double greatest = 0;
    std::size_t k = 0;
    if (n >= 2 * kLanes) {
      double lanes[kLanes] = {};
      for (; k + kLanes <= n; k += kLanes)
        for (std::size_t l = 0; l < kLanes; ++l) lanes[l] = out[k + l] > lanes[l] ? out[k + l] : lanes[l];
      greatest = *std::max_element(lanes, lanes + kLanes);
    }
    for (; k < n; ++k) greatest = std::max(greatest, out[k]);
    return greatest;
  }

  double exact_row(const MeasuredTriangle& t, std::int64_t y, const std::int32_t* heights, const Span& closed,
                   const Span& owned) {
    if (!t.exact.shows()) return 0;
    const PlaneRow plane(t.exact, rows_[y]);
    double out[kBlock], greatest = 0;
    for (std::int64_t x = closed.first; x <= closed.last; x += kBlock) {
      const std::int64_t last = std::min<std::int64_t>(x + kBlock - 1, closed.last);
      greatest = std::max(greatest, errors(plane, t.exact_range, heights, x, static_cast<std::size_t>(last - x + 1), out));
      const Span summed = intersection(owned, {x, last});
      for (std::int64_t i = summed.first; i <= summed.last; ++i) sum_.add(square_steps(out[i - x]));
    }
    return greatest;
  }

  double rounded_row(const MeasuredTriangle& t, std::int64_t y, const std::int32_t* heights, const Span& closed) const {
    if (!t.rounded.shows()) return 0;
    const PlaneRow plane(t.rounded, rows_[y]);
    double out[kBlock], greatest = 0;
    for (std::int64_t x = closed.first; x <= closed.last; x += kBlock) {
      const std::int64_t n = std::min<std::int64_t>(kBlock, closed.last - x + 1);
      greatest = std::max(greatest, errors(plane, t.rounded_range, heights, x, static_cast<std::size_t>(n), out));
    }
    return greatest;
  }

  /// The slow way, for rows above the limit only: which sample it is.
  void find_worst(const MeasuredTriangle& t, std::int64_t y, const std::int32_t* heights, const Span& closed) {
    const PlaneRow exact(t.exact, rows_[y]), rounded(t.rounded, rows_[y]);
    for (std::int64_t x = closed.first; x <= closed.last; ++x) {
      if (heights[x] == proto::kNoHeight) continue;
      const double h = heights[x] * proto::kHeightStep_m, s = sin_lon_[x], c = cos_lon_[x];
      double e = 0;
      if (t.exact.shows()) e = std::abs(t.exact_range.clamp(exact.height_m(s, c)) - h);
      if (t.rounded.shows()) e = std::max(e, std::abs(t.rounded_range.clamp(rounded.height_m(s, c)) - h));
      if (y == worst_.y && e == worst_.error_m) worst_.x = x;
      bool corner = false;
      for (const PlanEdge& edge : t.plan.edge) corner |= edge.x == x && edge.y == y;
      if (!corner && e > inside_.error_m) inside_ = {x, y, e};
    }
  }

  /// Corners count once each, whatever triangles meet there.
  void measure_vertices() {
    for (std::size_t v = 0; v < corners_.size(); ++v) {
      const std::int32_t h = published_[v] != 0 ? window_.at(mesh_.x[v], mesh_.y[v]) : proto::kNoHeight;
      if (h == proto::kNoHeight) continue;
      const double error_m = std::abs(mesh_.height[v] - static_cast<double>(h)) * proto::kHeightStep_m;
      sum_.add(square_steps(error_m));
      ++covered_;
      ++summed_;
      result_.max_m = std::max(result_.max_m, error_m);
    }
  }

  const SurfaceErrorInput& in_;
  const proto::TileMesh& mesh_;
  double limit_m_;
  SampleWindow window_;
  Rims rims_;
  std::vector<proto::RowFrame> own_rows_;
  std::vector<proto::ColumnFrame> own_columns_;
  std::span<const proto::RowFrame> rows_;
  std::span<const proto::ColumnFrame> columns_;
  std::vector<double> sin_lon_, cos_lon_;  ///< columns_, so that a row's loop reads them in order
  TileFacts tile_;
  std::vector<Corner> corners_;          ///< indexed by vertex
  std::vector<std::uint8_t> published_;  ///< indexed by vertex: in a triangle that exists
  std::uint64_t valid_ = 0, covered_ = 0, summed_ = 0, overcovered_ = 0;
  bool all_valid_ = false;
  SquareSum sum_;
  Best worst_, inside_;  ///< of the triangle at hand
  SurfaceError result_;
};

}  // namespace

SurfaceError surface_error(const SurfaceErrorInput& input, double limit_m) { return Measurement(input, limit_m).run(); }

}  // namespace cordillera::gpu
