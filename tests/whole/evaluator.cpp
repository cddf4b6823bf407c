#include "tests/whole/evaluator.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace cordillera::whole {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
constexpr double kA = 6378137.0, kF = 1 / 298.257223563, kE2 = kF * (2 - kF);

Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Point cross(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Geodetic latitude in degrees by fixed-point iteration; quick, since terrain is near the ellipsoid.
double latitude_deg(const Point& p) {
  const double r = std::hypot(p[0], p[1]);
  double lat = std::atan2(p[2], r * (1 - kE2));
  for (int k = 0; k < 3; ++k) {
    const double s = std::sin(lat), n = kA / std::sqrt(1 - kE2 * s * s);
    lat = std::atan2(p[2] + n * kE2 * s, r);
  }
  return lat / kDegree;
}

struct Box {
  double west = 1e9, east = -1e9, south = 1e9, north = -1e9;
};

/// Where a triangle can be seen: its edges followed in space, with room to spare. centre: longitudes are counted from there.
Box seen_box(const DecodedSurface& s, const std::array<std::uint32_t, 3>& t, double centre) {
  constexpr double kStraight_m = 10000;  // a longer edge bends by more than metres on its way
  Box box;
  for (unsigned k = 0; k < 3; ++k) {
    const Point &a = s.points[t[k]], &b = s.points[t[(k + 1) % 3]];
    const Point edge = minus(b, a);
    const int steps = dot(edge, edge) < kStraight_m * kStraight_m ? 1 : 8;
    for (int step = 0; step < steps; ++step) {
      const double w = static_cast<double>(step) / steps;
      const Point p = {a[0] + w * edge[0], a[1] + w * edge[1], a[2] + w * edge[2]};
      const double lat = latitude_deg(p);
      box.south = std::min(box.south, lat);
      box.north = std::max(box.north, lat);
      if (std::hypot(p[0], p[1]) < 1e-6) continue;  // a pole has every longitude
      const double lon = std::remainder(std::atan2(p[1], p[0]) / kDegree - centre, 360.0);
      box.west = std::min(box.west, lon);
      box.east = std::max(box.east, lon);
    }
  }
  const double room = 0.15 * std::max(box.east - box.west, box.north - box.south) + 1e-7;
  return {box.west - room, box.east + room, box.south - room, box.north + room};
}

/// Which triangles may be seen from a place of a square window of extent_deg from its south-western corner.
class Bins {
 public:
  Bins(const DecodedSurface& surface, double west_deg, double south_deg, double extent_deg)
      : extent_(extent_deg), centre_(west_deg + extent_deg / 2), south_(south_deg) {
    across_ = std::clamp(static_cast<int>(std::sqrt(static_cast<double>(surface.triangles.size()))), 1, 512);
    bins_.resize(static_cast<std::size_t>(across_) * static_cast<std::size_t>(across_));
    for (std::uint32_t t = 0; t < surface.triangles.size(); ++t) {
      const Box box = seen_box(surface, surface.triangles[t], centre_);
      if (box.west > extent_ / 2 || box.east < -extent_ / 2 || box.south > south_ + extent_ || box.north < south_) continue;
      for (int j = index(box.south - south_); j <= index(box.north - south_); ++j)
        for (int i = index(box.west + extent_ / 2); i <= index(box.east + extent_ / 2); ++i) bin(i, j).push_back(t);
    }
  }
  const std::vector<std::uint32_t>& at(double lon, double lat) {
    return bin(index(lon - centre_ + extent_ / 2), index(lat - south_));
  }

 private:
  int index(double from_edge) const { return static_cast<int>(std::clamp(from_edge / extent_ * across_, 0.0, across_ - 1.0)); }
  std::vector<std::uint32_t>& bin(int i, int j) { return bins_[static_cast<std::size_t>(j * across_ + i)]; }

  int across_ = 1;
  double extent_ = 0, centre_ = 0, south_ = 0;
  std::vector<std::vector<std::uint32_t>> bins_;
};

struct Ray {
  Point from, along;
  double grace = 0;  ///< in barycentric weights
};
constexpr double kEdgeGrace = 1e-7;  // a ray along an edge that two triangles share
// At most, for a sample on the tile's side, which chords leave: as little as finds a triangle. Of a needle beside a pole a
// fiftieth was far.
constexpr double kSideGrace = 0.002;

/// Distance along the ray, either way; none when it misses.
std::optional<double> hit_of(const Ray& ray, const Point& a, const Point& b, const Point& c) {
  constexpr double kFarSide_m = 4e6;
  const Point &from = ray.from, &along = ray.along;
  const Point e1 = minus(b, a), e2 = minus(c, a), p = cross(along, e2);
  const double det = dot(e1, p), size2 = std::max(dot(e1, e1), dot(e2, e2));
  if (std::abs(det) <= 1e-12 * size2) return std::nullopt;  // seen edge-on, or without area
  const Point s = minus(from, a), q = cross(s, e1);
  const double u = dot(s, p) / det, v = dot(along, q) / det;
  if (u < -ray.grace || v < -ray.grace || u + v > 1 + ray.grace) return std::nullopt;
  const double t = dot(e2, q) / det;
  if (std::abs(t) > kFarSide_m) return std::nullopt;
  return t;
}

struct Hits {
  double nearest_m = INFINITY, worst_m = -1;
};

Hits hits_of(const Ray& ray, const DecodedSurface& surface, const std::vector<std::uint32_t>& candidates) {
  Hits hits;
  for (const std::uint32_t t : candidates) {
    const auto& c = surface.triangles[t];
    const auto hit = hit_of(ray, surface.points[c[0]], surface.points[c[1]], surface.points[c[2]]);
    if (!hit) continue;
    hits.nearest_m = std::min(hits.nearest_m, std::abs(*hit));
    hits.worst_m = std::max(hits.worst_m, std::abs(*hit));
  }
  return hits;
}

}  // namespace

Point ecef_point(double longitude_deg, double latitude_deg, double height_m) {
  const double lon = longitude_deg * kDegree, lat = latitude_deg * kDegree;
  const double n = kA / std::sqrt(1 - kE2 * std::sin(lat) * std::sin(lat));
  const double r = std::abs(latitude_deg) == 90 ? 0 : (n + height_m) * std::cos(lat);
  return {r * std::cos(lon), r * std::sin(lon), (n * (1 - kE2) + height_m) * std::sin(lat)};
}

Point up_at(const Point& p) {
  const double lat = latitude_deg(p) * kDegree, lon = std::atan2(p[1], p[0]);
  return {std::cos(lat) * std::cos(lon), std::cos(lat) * std::sin(lon), std::sin(lat)};
}

DecodedSurface surface_of(const DecodedTile& tile, double height_step_m) {
  DecodedSurface s;
  s.triangles = tile.triangles;
  const double extent = 180.0 / std::ldexp(1.0, tile.tile.z);
  for (std::size_t k = 0; k < tile.u.size(); ++k) {
    const double lon = -180 + (tile.tile.x + static_cast<double>(tile.u[k]) / tile.side) * extent;
    const double lat = -90 + (tile.tile.y + static_cast<double>(tile.v[k]) / tile.side) * extent;
    s.points.push_back(ecef_point(lon, lat, tile.h[k] * height_step_m));
  }
  return s;
}

Measured measure(const DecodedSurface& surface, const proto::Lattice& lattice, const proto::TileAddress& tile,
                 const TrueHeight& truth, const SampleWindow& window, std::int64_t stride) {
  const std::int64_t across = std::max({window.east - window.west, window.north - window.south, std::int64_t{1}});
  Bins bins(surface, lattice.longitude_deg(window.west), lattice.latitude_deg(window.south),
            static_cast<double>(across) * lattice.cell_deg());
  Measured result;
  double squares = 0;
  const std::int64_t west = lattice.west(tile), south = lattice.south(tile), side = lattice.tile_units(tile.z);
  for (std::int64_t j = window.south; j <= window.north; j += stride) {
    for (std::int64_t i = window.west; i <= window.east; i += stride) {
      const std::optional<double> height = truth(i, j);
      if (!height) continue;
      const double lon = lattice.longitude_deg(i), lat = lattice.latitude_deg(j);
      Ray ray{ecef_point(lon, lat, *height), minus(ecef_point(lon, lat, 1), ecef_point(lon, lat, 0)), kEdgeGrace};
      const auto& candidates = bins.at(lon, lat);
      Hits hits = hits_of(ray, surface, candidates);
      const bool in_tile = i >= west && j >= south && i <= west + side &&
                           j <= south + side;  // others are the neighbour's, but under this tile's bulge
      const bool on_side = in_tile && (i == west || j == south || i == west + side || j == south + side);
      while (on_side && hits.worst_m < 0 && ray.grace < kSideGrace) {
        ray.grace *= 2;
        hits = hits_of(ray, surface, candidates);
      }
      if (hits.worst_m < 0) {
        ++result.uncovered;
        continue;
      }
      ++result.samples;
      squares += hits.nearest_m * hits.nearest_m;
      if (hits.worst_m > result.max_m) result.max_m = hits.worst_m, result.worst_i = i, result.worst_j = j;
    }
  }
  if (result.samples > 0) result.rmse_m = std::sqrt(squares / static_cast<double>(result.samples));
  return result;
}

Measured measure(const DecodedSurface& surface, const proto::Lattice& lattice, const proto::TileAddress& tile,
                 const TrueHeight& truth, std::int64_t stride) {
  const std::int64_t west = lattice.west(tile), south = lattice.south(tile), side = lattice.tile_units(tile.z);
  return measure(surface, lattice, tile, truth, {west, south, west + side, south + side}, stride);
}

}  // namespace cordillera::whole
