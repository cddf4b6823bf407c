#include "pipeline/encode/region.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace cordillera::pipeline {
namespace {

using proto::Vec3;

constexpr double kPi = std::numbers::pi;
constexpr double kE2 = proto::kFlattening * (2 - proto::kFlattening);
constexpr double kSemiMinor_m = proto::kSemiMajor_m * (1 - proto::kFlattening);
// Least radius of curvature of the ellipsoid (meridian at the equator), less some for points below it.
constexpr double kLeastRadius_m = kSemiMinor_m * kSemiMinor_m / proto::kSemiMajor_m - 2e4;

// Triangles with shorter sides are bounded by a formula, others by a closer look.
constexpr double kShort_m = 2e4;

// Regions are rounded outward, to micrometres and millimetres, so that a library's last bit seldom shows.
constexpr double kAngleStep = 0x1p-36, kHeightStep_m = 0x1p-10;
double down(double value, double step) { return (std::floor(value / step) - 1) * step; }
double up(double value, double step) { return (std::ceil(value / step) + 1) * step; }

struct Raised {
  double latitude = 0, height_m = 0;
};

// Bowring's iteration on the reduced latitude; two rounds reach the last bits for anything near the surface. Angles are kept as
// (sine, cosine) up to a factor: each vertex of each tile comes by here.
Raised raised(Vec3 p) {
  const double r = std::sqrt(p.x * p.x + p.y * p.y);
  constexpr double kSecondE2 = kE2 / (1 - kE2);
  double up = p.z * proto::kSemiMajor_m, out = r * kSemiMinor_m;  // of the reduced latitude
  double north = 0, away = 0;                                     // of the latitude
  for (int k = 0; k < 2; ++k) {
    const double unit = 1 / std::sqrt(up * up + out * out), s = up * unit, c = out * unit;
    north = p.z + kSecondE2 * kSemiMinor_m * s * s * s;
    away = r - kE2 * proto::kSemiMajor_m * c * c * c;
    up = (1 - proto::kFlattening) * north, out = away;
  }
  const double unit = 1 / std::sqrt(north * north + away * away), s = north * unit, c = away * unit;
  return {std::atan2(north, away), r * c + p.z * s - proto::kSemiMajor_m * std::sqrt(1 - kE2 * s * s)};
}

struct RegionBounds {
  double west = 1e9, south = 1e9, east = -1e9, north = -1e9, low = 1e9, high = -1e9;
};

double middle_longitude(const proto::TileAddress& tile) { return -kPi + kPi * (tile.x + 0.5) / std::ldexp(1, tile.z); }

// Longitudes are taken from the middle of the tile, so that its western and eastern side never swap at the antimeridian.
void include_points(RegionBounds& e, const LitMesh::Surface& surface, const std::vector<Raised>& at, double middle) {
  const double c = std::cos(middle), s = std::sin(middle);
  for (std::size_t v = 0; v < at.size(); ++v) {
    const Vec3& p = surface.points[v];
    if (p.x != 0 || p.y != 0) {
      const double longitude = std::atan2(p.y * c - p.x * s, p.x * c + p.y * s);
      e.west = std::min(e.west, longitude);
      e.east = std::max(e.east, longitude);
    }
    e.south = std::min(e.south, at[v].latitude);
    e.north = std::max(e.north, at[v].latitude);
    e.low = std::min(e.low, at[v].height_m);
    e.high = std::max(e.high, at[v].height_m);
  }
}

double steepness(double latitude) { return 1 + std::tan(std::min(std::abs(latitude), 1.57)); }

void include_latitude(RegionBounds& e, double latitude, double bulge) {
  if (latitude > 0) e.north = std::max(e.north, latitude + bulge);
  if (latitude < 0) e.south = std::min(e.south, latitude - bulge);
}

// A chord between two points of one parallel bulges poleward, by L^2 tan(lat) / (8 R^2). Long ones are sampled in pieces of 20
// km, the bulge within a piece added by that formula, doubled. Inside a triangle latitude has no maximum of its own: {latitude >=
// c} is a cone.
void include_long_edge(RegionBounds& e, Vec3 a, Vec3 b) {
  const double edge = length(b - a);
  const int pieces = std::clamp(static_cast<int>(edge / kShort_m) + 1, 1, 256);
  const double part = edge / pieces / proto::kSemiMajor_m;
  for (int k = 0; k <= pieces; ++k) {
    const double latitude = raised(a + (static_cast<double>(k) / pieces) * (b - a)).latitude;
    include_latitude(e, latitude, part * part * steepness(latitude) / 4);
  }
}

// Least distance from the origin to triangle abc (C. Ericson, Real-Time Collision Detection, 5.1.5, done with barycentric signs).
double distance_from_origin(Vec3 a, Vec3 b, Vec3 c) {
  const auto to_segment = [](Vec3 p, Vec3 q) {
    const Vec3 d = q - p;
    const double d2 = dot(d, d);
    const double t = d2 > 0 ? std::clamp(-dot(p, d) / d2, 0.0, 1.0) : 0;
    return length(p + t * d);
  };
  const double sides = std::min({to_segment(a, b), to_segment(b, c), to_segment(c, a)});
  const Vec3 n = cross(b - a, c - a);
  const double n2 = dot(n, n);
  if (n2 == 0) return sides;
  const double height = dot(a, n);
  const Vec3 foot = (height / n2) * n;
  const bool inside =
      dot(cross(b - a, foot - a), n) >= 0 && dot(cross(c - b, foot - b), n) >= 0 && dot(cross(a - c, foot - c), n) >= 0;
  return inside ? std::abs(height) / std::sqrt(n2) : sides;
}

// The point of a triangle nearest to the earth's centre, with the ellipsoid scaled to a sphere: a point on r times the ellipsoid
// is at most (1 - r) a below it.
double lowest_in_large(Vec3 a, Vec3 b, Vec3 c) {
  const auto scaled = [](Vec3 p) { return Vec3{p.x / proto::kSemiMajor_m, p.y / proto::kSemiMajor_m, p.z / kSemiMinor_m}; };
  const double r = distance_from_origin(scaled(a), scaled(b), scaled(c));
  return r < 1 ? (r - 1) * proto::kSemiMajor_m : (r - 1) * kSemiMinor_m;
}

// For small triangles: the second derivative of the height along a line is at most 1/R, and for q = sum l_i p_i inside a triangle
// of longest side L the spread sum l_i |p_i - q|^2 is at most L^2 / 3. So q lies at most L^2 / (6 R) below its corners' mean;
// latitude likewise.
void include_triangles(RegionBounds& e, const LitMesh::Surface& surface, const std::vector<Raised>& at) {
  const double steepest = steepness(std::max(std::abs(e.south), std::abs(e.north)));
  for (const Triangle& t : surface.triangles) {
    const Vec3 a = surface.points[t[0]], b = surface.points[t[1]], c = surface.points[t[2]];
    const double longest2 = std::max({dot(b - a, b - a), dot(c - b, c - b), dot(a - c, a - c)});
    if (longest2 < kShort_m * kShort_m) {
      const double sag = longest2 / (6 * kLeastRadius_m);
      for (const std::uint32_t v : t) {
        e.low = std::min(e.low, at[v].height_m - sag);
        include_latitude(e, at[v].latitude, sag * steepest / kLeastRadius_m);
      }
      continue;
    }
    e.low = std::min(e.low, lowest_in_large(a, b, c));
    include_long_edge(e, a, b);
    include_long_edge(e, b, c);
    include_long_edge(e, c, a);
  }
}

}  // namespace

Geodetic geodetic(Vec3 p) {
  const Raised at = raised(p);
  return {std::atan2(p.y, p.x), at.latitude, at.height_m};
}

std::array<double, 6> region_of(const LitMesh& mesh, const proto::TileAddress& tile) {
  const double middle = middle_longitude(tile);
  RegionBounds e;
  for (const LitMesh::Surface* surface : {&mesh.terrain, &mesh.skirts}) {
    std::vector<Raised> at;
    at.reserve(surface->points.size());
    for (const Vec3& p : surface->points) at.push_back(raised(p));
    include_points(e, *surface, at, middle);
    include_triangles(e, *surface, at);
  }
  // A step's rounding may carry a point over the antimeridian; a region that wraps for its sake would help nobody.
  return {std::max(-kPi, down(middle + e.west, kAngleStep)),
          std::max(-kPi / 2, down(e.south, kAngleStep)),
          std::min(kPi, up(middle + e.east, kAngleStep)),
          std::min(kPi / 2, up(e.north, kAngleStep)),
          down(e.low, kHeightStep_m),
          up(e.high, kHeightStep_m)};
}

std::array<double, 6> tile_region(const EncodeInput& input, const PublishedMesh& published) {
  EncodeInput unlit = input;
  unlit.shading = {Normals::none};
  return region_of(lit_mesh(unlit, published), input.tile);
}

}  // namespace cordillera::pipeline
