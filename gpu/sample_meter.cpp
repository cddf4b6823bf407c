#include "gpu/sample_meter.h"

namespace cordillera::gpu {
namespace {

// Of all that may become a corner: the mesh's vertices and the tile's samples.
std::pair<double, double> height_range_m(const SurfaceErrorInput& in) {
  std::int32_t low = INT32_MAX, high = -INT32_MAX;
  const auto see = [&](std::int32_t h) {
    if (h == proto::kNoHeight) return;
    low = std::min(low, h);
    high = std::max(high, h);
  };
  for (const std::int32_t h : in.mesh->height) see(h);
  const SampleWindow window(in, in.mesh->side);
  for (std::int64_t y = window.rows().first; y <= window.rows().last; ++y)
    for (const auto& s : window.stretches())
      for (std::int64_t x = s.columns.first; x <= s.columns.last; ++x) see(window.row(y)[x + s.shift]);
  return {std::min(low, high) * proto::kHeightStep_m, std::max(low, high) * proto::kHeightStep_m};
}

struct NoTally {
  void row(const RowSpans&) const {}
  void samples(const MeasuredTriangle&, const std::int32_t*, const Span&, const Span&) const {}
  void errors(std::int64_t, const Span&, const double*) const {}
};

}  // namespace

SampleMeter::SampleMeter(const SurfaceErrorInput& input)
    : meter_(input, height_range_m(input).first, height_range_m(input).second) {}

TriangleError SampleMeter::measure(const std::array<MeshPoint, 3>& corners, double limit_m) const {
  const auto corner = [&](std::size_t k) { return meter_.corner(corners[k].x, corners[k].y, corners[k].height); };
  const Corner three[3] = {corner(0), corner(1), corner(2)};
  const MeasuredTriangle triangle = meter_.triangle(three, 0);
  NoTally tally;
  TriangleWorst worst = meter_.worst(triangle, limit_m, tally);
  TriangleError error;
  error.error_m = std::max(worst.any.error_m, 0.0);
  if (error.error_m <= limit_m) return error;
  // Where only samples beyond its edges are too far, any corner more makes the triangle smaller.
  if (worst.inside.error_m < 0) worst = meter_.worst(triangle, -1, tally);
  if (worst.inside.error_m >= 0) {
    error.offer({static_cast<std::int32_t>(worst.inside.x), static_cast<std::int32_t>(worst.inside.y), meter_.window().at(worst.inside.x, worst.inside.y)});
  }
  return error;
}

}  // namespace cordillera::gpu
