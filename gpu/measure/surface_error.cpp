#include "gpu/measure/surface_error.h"

#include <algorithm>
#include <cmath>

#include "gpu/measure/surface_meter.h"

namespace cordillera::gpu {
namespace {

std::uint32_t saturated(std::uint64_t n) { return static_cast<std::uint32_t>(std::min<std::uint64_t>(n, UINT32_MAX)); }

/// What is counted and summed while triangles are measured.
struct Tally {
  static constexpr bool kSums = true;
  bool all_valid = false;
  std::uint64_t valid = 0, covered = 0, summed = 0, overcovered = 0;
  SquareSum sum;

  void row(const RowSpans& spans) {
    if (!all_valid) overcovered += length(spans.strict);
  }
  void samples(const MeasuredTriangle& t, const std::int32_t* heights, const Span& owned, const Span& strict) {
    std::uint64_t n = length(owned);
    if (!all_valid) {
      n = count_valid(heights + owned.first, static_cast<std::size_t>(length(owned)));
      overcovered -= count_valid(heights + strict.first, static_cast<std::size_t>(length(strict)));
    }
    covered += n;
    if (t.exact.shows()) summed += n;
  }
  void errors(std::int64_t first, const Span& owned, const double* out) {
    if (length(owned) > 0) add_squares(out + (owned.first - first), static_cast<std::size_t>(length(owned)), sum);
  }
};

class Measurement {
 public:
  Measurement(const SurfaceErrorInput& in, double limit_m, std::pair<double, double> range_m)
      : mesh_(*in.mesh), limit_m_(limit_m), meter_(in, range_m), rims_(*in.mesh) {
    corners_.reserve(mesh_.vertices());
    for (std::size_t v = 0; v < mesh_.vertices(); ++v) corners_.push_back(meter_.corner(mesh_.x[v], mesh_.y[v], mesh_.height[v]));
  }

  std::vector<std::uint32_t> over() const {
    std::vector<std::uint32_t> found;
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (!is_published(t)) continue;
      const auto& [a, b, c] = mesh_.triangles[t];
      const MeasuredTriangle triangle = meter_.triangle({corners_[a], corners_[b], corners_[c]}, 0);
      if (meter_.greatest_m(triangle, {limit_m_, limit_m_}) > limit_m_) found.push_back(t);
    }
    return found;
  }

  SurfaceError run() {
    count_window();
    published_.assign(mesh_.vertices(), 0);
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      if (is_published(t)) triangle(t);
    measure_vertices();
    result_.sum_squared_m2 = tally_.sum.value_m2();
    result_.samples = saturated(tally_.summed);
    result_.uncovered = saturated(tally_.valid - tally_.covered);
    result_.overcovered = saturated(tally_.overcovered);
    return std::move(result_);
  }

 private:
  void count_window() {
    const SampleWindow& window = meter_.window();
    const auto across = static_cast<std::uint64_t>(mesh_.side) + 1;
    for (std::int64_t y = window.rows().first; y <= window.rows().last; ++y)
      for (const auto& s : window.stretches())
        tally_.valid += count_valid(window.row(y) + s.columns.first + s.shift, static_cast<std::size_t>(length(s.columns)));
    tally_.all_valid = tally_.valid == across * across;
  }

  unsigned owned_edges(const std::array<std::uint32_t, 3>& t, const Corner (&c)[3]) const {
    unsigned owned = 0;
    for (unsigned k = 0; k < 3; ++k) {
      const unsigned n = k == 2 ? 0 : k + 1;
      if (counts_edge(mesh_.side, c[k], c[n]) || rims_.contains(t[k], t[n])) owned |= 1u << k;
    }
    return owned;
  }

  bool is_published(std::uint32_t triangle) const {
    const auto& [a, b, c] = mesh_.triangles[triangle];
    return ((mesh_.mark[a] | mesh_.mark[b] | mesh_.mark[c]) & proto::kVoid) == 0;
  }

  void triangle(std::uint32_t index) {
    const auto& v = mesh_.triangles[index];
    for (const std::uint32_t i : v) published_[i] = 1;
    const Corner corners[3] = {corners_[v[0]], corners_[v[1]], corners_[v[2]]};
    const TriangleWorst worst = meter_.worst(meter_.triangle(corners, owned_edges(v, corners)), limit_m_, tally_, result_.max_m);
    result_.max_m = std::max(result_.max_m, worst.any.error_m);
    if (worst.any.error_m <= limit_m_) return;
    const WorstSample& put = worst.inside.error_m > limit_m_ ? worst.inside : worst.any;
    result_.over_limit.push_back({index, static_cast<std::int32_t>(put.x), static_cast<std::int32_t>(put.y), worst.any.error_m});
  }

  /// Corners count once each, whatever triangles meet there.
  void measure_vertices() {
    for (std::size_t v = 0; v < corners_.size(); ++v) {
      const std::int32_t h = published_[v] != 0 ? meter_.window().at(mesh_.x[v], mesh_.y[v]) : proto::kNoHeight;
      if (h == proto::kNoHeight) continue;
      const double error_m = std::abs(mesh_.height[v] - static_cast<double>(h)) * proto::kHeightStep_m;
      tally_.sum.add(square_steps(error_m));
      ++tally_.covered;
      ++tally_.summed;
      result_.max_m = std::max(result_.max_m, error_m);
    }
  }

  const proto::TileMesh& mesh_;
  double limit_m_;
  SurfaceMeter meter_;
  Rims rims_;
  std::vector<Corner> corners_;          ///< indexed by vertex
  std::vector<std::uint8_t> published_;  ///< indexed by vertex: in a triangle that exists
  Tally tally_;
  SurfaceError result_;
};

}  // namespace

SurfaceError surface_error(const SurfaceErrorInput& input, double limit_m) {
  return Measurement(input, limit_m, height_range_m(*input.mesh)).run();
}

std::vector<std::uint32_t> triangles_over(const SurfaceErrorInput& input, double limit_m) {
  return Measurement(input, limit_m, height_range_m(*input.mesh)).over();
}

}  // namespace cordillera::gpu
