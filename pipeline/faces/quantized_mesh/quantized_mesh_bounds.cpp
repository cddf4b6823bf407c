#include "pipeline/faces/quantized_mesh/quantized_mesh_bounds.h"

#include <algorithm>
#include <cmath>

namespace cordillera::pipeline::faces {
namespace {

using proto::Vec3;

// Sines may differ in their last bit from one library to another; what is made of them is rounded outward.
constexpr double kStep_m = 0x1p-6, kHorizonStep = 0x1p-28;
// A place that asks for a farther point is a quarter turn away or more: a hill there is in view from places to which no point of
// this direction is. A tile of a hemisphere has such places, and no point. Comparisons with no number are false, so nobody takes
// it for hidden.
constexpr double kFar = 0x1p20;

Vec3 rounded(Vec3 p) {
  return {std::nearbyint(p.x / kStep_m) * kStep_m, std::nearbyint(p.y / kStep_m) * kStep_m,
          std::nearbyint(p.z / kStep_m) * kStep_m};
}

Vec3 middle(const std::vector<Vec3>& points) {
  Vec3 low = points[0], high = low;
  for (const Vec3& p : points) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  return rounded(0.5 * (low + high));
}

// K. Ring, "Computing the horizon occlusion point", 2013: along one direction, the farthest of the points that each vertex asks
// for. Where vertices are below the ellipsoid, the horizon is that of a smaller one: whoever uses the full one culls less.
Vec3 horizon(const std::vector<Vec3>& points, Vec3 direction, double low_m) {
  const double a = proto::kSemiMajor_m + std::min(low_m, 0.0),
               b = proto::kSemiMajor_m * (1 - proto::kFlattening) + std::min(low_m, 0.0);
  const auto scaled = [&](Vec3 p) { return Vec3{p.x / a, p.y / a, p.z / b}; };
  const Vec3 to_centre = scaled(direction), along = (1 / length(to_centre)) * to_centre;
  double farthest = 0;
  for (const Vec3& point : points) {
    const Vec3 p = scaled(point);
    const double distance = length(p), out = std::max(distance, 1.0);
    const double cosine = dot(p, along) / distance, sine = length(cross(p, along)) / distance;
    const double share = cosine / out - sine * std::sqrt(out * out - 1) / out;
    if (!(share > 1 / kFar)) return {NAN, NAN, NAN};
    farthest = std::max(farthest, 1 / share);
  }
  return ((std::floor(farthest / kHorizonStep) + 2) * kHorizonStep) * along;
}

}  // namespace

std::vector<Vec3> positions(const QuantizedSurface& surface) {
  const auto& [west, south, width, height] = surface.angles;
  const double e2 = proto::kFlattening * (2 - proto::kFlattening);
  std::vector<Vec3> out;
  out.reserve(surface.vertices.size());
  for (const auto& vertex : surface.vertices) {
    const double longitude = west + width * vertex.u / kMostQuanta, latitude = south + height * vertex.v / kMostQuanta;
    const double sine = std::sin(latitude), height_m = vertex.height * surface.step_m;
    const double n = proto::kSemiMajor_m / std::sqrt(1 - e2 * sine * sine), out_m = (n + height_m) * std::cos(latitude);
    out.push_back({out_m * std::cos(longitude), out_m * std::sin(longitude), (n * (1 - e2) + height_m) * sine});
  }
  return out;
}

QuantizedBounds quantized_bounds(const QuantizedSurface& surface, const std::vector<Vec3>& positions) {
  QuantizedBounds out;
  const auto [low, high] = std::minmax_element(surface.vertices.begin(), surface.vertices.end(),
                                               [](const auto& a, const auto& b) { return a.height < b.height; });
  out.low_m = low->height * surface.step_m;
  out.high_m = high->height * surface.step_m;
  out.centre = middle(positions);
  for (const Vec3& p : positions) out.radius_m = std::max(out.radius_m, length(p - out.centre));
  out.radius_m = (std::floor(out.radius_m / kStep_m) + 2) * kStep_m;
  out.horizon = horizon(positions, out.centre, out.low_m);
  return out;
}

}  // namespace cordillera::pipeline::faces
