#include "gpu/measure/surface_error.h"

#include <algorithm>
#include <cmath>

#include "gpu/measure/surface_memory.h"
#include "gpu/measure/surface_meter.h"
#include "gpu/measure/tile_triangles.h"

namespace cordillera::gpu {
namespace {

std::uint32_t saturated(std::uint64_t n) { return static_cast<std::uint32_t>(std::min<std::uint64_t>(n, UINT32_MAX)); }

/// Counts and sums while a triangle is measured.
struct Tally : SurfaceSums {
  static constexpr bool kSums = true;
  bool all_valid = false;

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
    if (length(owned) > 0) add_squares(out + (owned.first - first), static_cast<std::size_t>(length(owned)), squares);
  }
};

class Measurement {
 public:
  Measurement(const SurfaceErrorInput& in, double limit_m, SurfaceMemory& memory)
      : mesh_(*in.mesh), limit_m_(limit_m), meter_(in, gpu::height_range_m(*in.mesh)), triangles_(*in.mesh), memory_(memory) {}

  SurfaceError run() {
    if (!memory_.valid) memory_.valid = valid_in_window();
    const auto across = static_cast<std::uint64_t>(mesh_.side) + 1;
    all_valid_ = *memory_.valid == across * across;
    published_.assign(mesh_.vertices(), 0);
    remember();
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t)
      if (triangles_.is_published(t)) triangle(t);
    measure_vertices();
    result_.sum_squared_m2 = sums_.squares.value_m2();
    result_.samples = saturated(sums_.summed);
    result_.uncovered = saturated(*memory_.valid - sums_.covered);
    result_.overcovered = saturated(sums_.overcovered);
    return std::move(result_);
  }

 private:
  std::uint64_t valid_in_window() const {
    const SampleWindow& window = meter_.window();
    std::uint64_t valid = 0;
    for (std::int64_t y = window.rows().first; y <= window.rows().last; ++y)
      for (const auto& s : window.stretches())
        valid += count_valid(window.row(y) + s.columns.first + s.shift, static_cast<std::size_t>(length(s.columns)));
    return valid;
  }

  /// Forgets triangles that have changed. Below the greatest error of the others nothing has to be told apart.
  void remember() {
    memory_.triangles.resize(mesh_.triangles.size());
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      if (!triangles_.is_published(t)) continue;
      SurfaceMemory::Triangle &known = memory_.triangles[t], now;
      now.corners = triangles_.corners(t), now.owned = triangles_.owned_edges(t, now.corners);
      if (known.corners != now.corners || known.owned != now.owned)
        known = now;
      else
        result_.max_m = std::max(result_.max_m, known.error_m);
    }
  }

  void triangle(std::uint32_t index) {
    const auto& [a, b, c] = mesh_.triangles[index];
    published_[a] = published_[b] = published_[c] = 1;
    SurfaceMemory::Triangle& known = memory_.triangles[index];
    if (known.floor_m > std::max(result_.max_m, known.error_m)) measure(known);
    result_.max_m = std::max(result_.max_m, known.error_m);
    sums_.add(known.sums);
    if (known.error_m > limit_m_) result_.over_limit.push_back({index, known.x, known.y, known.error_m});
  }

  void measure(SurfaceMemory::Triangle& known) const {
    const auto corner = [&](std::size_t k) {
      return meter_.corner(known.corners[k].x, known.corners[k].y, known.corners[k].height);
    };
    const Corner corners[3] = {corner(0), corner(1), corner(2)};
    Tally tally;
    tally.all_valid = all_valid_;
    const TriangleWorst worst = meter_.worst(meter_.triangle(corners, known.owned), limit_m_, tally, result_.max_m);
    known.sums = tally;
    known.floor_m = result_.max_m;
    known.error_m = worst.any.error_m;
    const WorstSample& put = worst.inside.error_m > limit_m_ ? worst.inside : worst.any;
    known.x = static_cast<std::int32_t>(put.x), known.y = static_cast<std::int32_t>(put.y);
  }

  /// Corners count once each, whatever triangles meet there.
  void measure_vertices() {
    for (std::size_t v = 0; v < mesh_.vertices(); ++v) {
      const std::int32_t h = published_[v] != 0 ? meter_.window().at(mesh_.x[v], mesh_.y[v]) : proto::kNoHeight;
      if (h == proto::kNoHeight) continue;
      const double error_m = std::abs(mesh_.height[v] - static_cast<double>(h)) * proto::kHeightStep_m;
      sums_.squares.add(square_steps(error_m));
      ++sums_.covered;
      ++sums_.summed;
      result_.max_m = std::max(result_.max_m, error_m);
    }
  }

  const proto::TileMesh& mesh_;
  double limit_m_;
  SurfaceMeter meter_;
  TileTriangles triangles_;
  SurfaceMemory& memory_;
  bool all_valid_ = false;
  std::vector<std::uint8_t> published_;  ///< indexed by vertex: in a triangle that exists
  SurfaceSums sums_;
  SurfaceError result_;
};

}  // namespace

SurfaceError surface_error(const SurfaceErrorInput& input, double limit_m, SurfaceMemory& memory) {
  return Measurement(input, limit_m, memory).run();
}

SurfaceError surface_error(const SurfaceErrorInput& input, double limit_m) {
  SurfaceMemory memory;
  return surface_error(input, limit_m, memory);
}

std::vector<std::uint32_t> triangles_over(const SurfaceError& error) {
  std::vector<std::uint32_t> over;
  for (const SurfaceError::Worst& worst : error.over_limit) over.push_back(worst.triangle);
  return over;
}

}  // namespace cordillera::gpu
