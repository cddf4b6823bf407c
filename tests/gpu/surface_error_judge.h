#pragma once
// A tile's mesh between made samples, and its error by rays cast, sample by sample, at every triangle near it.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <random>
#include <vector>

#include "gpu/measure/surface_error.h"
#include "tests/gpu/grid_mesh.h"

namespace cordillera::gpu {

using Point = std::array<long double, 3>;

inline Point minus(const Point& a, const Point& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
inline Point cross_product(const Point& a, const Point& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline long double product(const Point& a, const Point& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

/// Textbook geodetic to ECEF, with the library's sines.
inline Point position(const proto::Lattice& lattice, std::int64_t i, std::int64_t j, long double h) {
  const long double lon = (-180 + 360.0L * i / lattice.columns()) * M_PIl / 180,
                    lat = (-90 + 180.0L * j / lattice.rows()) * M_PIl / 180;
  const long double f = 1 / 298.257223563L, e2 = f * (2 - f), n = 6378137 / std::sqrt(1 - e2 * std::sin(lat) * std::sin(lat));
  const long double r = 2 * std::abs(j - lattice.rows() / 2) == lattice.rows() ? 0 : (n + h) * std::cos(lat);
  return {r * std::cos(lon), r * std::sin(lon), (n * (1 - e2) + h) * std::sin(lat)};
}
inline Point up(const proto::Lattice& lattice, std::int64_t i, std::int64_t j) {
  return minus(position(lattice, i, j, 1), position(lattice, i, j, 0));
}

struct Scene {
  proto::Lattice lattice;
  proto::TileAddress tile;
  proto::TileMesh mesh;
  proto::Samples samples;
  EcefSteps steps;

  std::int64_t west() const { return lattice.west(tile); }
  std::int64_t south() const { return lattice.south(tile); }
  std::int32_t truth(std::int64_t x, std::int64_t y) const {
    const std::int64_t r = south() + y - samples.south, circle = lattice.columns();
    const std::int64_t c = (((west() + x - samples.west) % circle) + circle) % circle;
    if (r < 0 || r >= samples.rows) return proto::kNoHeight;
    for (const std::int64_t k : {c, c + circle})
      if (k < samples.columns) return samples.height[static_cast<std::size_t>(r * samples.columns + k)];
    return proto::kNoHeight;
  }
  bool published(const std::array<std::uint32_t, 3>& t) const { return is_published(mesh, t); }
  SurfaceErrorInput input() const {
    SurfaceErrorInput in;
    in.lattice = &lattice;
    in.tile = tile;
    in.mesh = &mesh;
    in.samples = &samples;
    in.ecef_steps = steps;
    return in;
  }
  SurfaceError measure(double limit_m = 1e9) const { return surface_error(input(), limit_m); }
};

using Terrain = std::function<std::int32_t(std::int64_t i, std::int64_t j)>;

/// A grid mesh of `cells` cells a side whose inner vertices are moved about, heights true, and diagonals turned at random.
inline Scene scene(int finest, proto::TileAddress tile, std::int32_t cells, const EcefSteps& steps, const Terrain& anywhere) {
  Scene s;
  s.lattice.finest_level = finest;
  s.tile = tile;
  s.steps = steps;
  const auto side = static_cast<std::int32_t>(s.lattice.tile_units(tile.z));
  const auto terrain = [&](std::int64_t i, std::int64_t j) {  // a pole is one point
    return anywhere(j == 0 || j == s.lattice.rows() ? 0 : i, j);
  };
  s.samples = {s.west(), s.south(), side + 1, side + 1, {}, {}};
  for (std::int64_t y = 0; y <= side; ++y)
    for (std::int64_t x = 0; x <= side; ++x) s.samples.height.push_back(terrain(s.west() + x, s.south() + y));
  const std::vector<std::int32_t> flat(static_cast<std::size_t>((cells + 1) * (cells + 1)), 0);
  const std::int32_t step = side / cells;
  s.mesh = grid_mesh(cells, step, flat);
  std::mt19937 random(static_cast<unsigned>(finest * 1000 + tile.x * 10 + tile.y));
  const auto jitter = [&](std::int32_t& at) {
    if (at > 0 && at < side && step > 3) at += static_cast<std::int32_t>(random() % static_cast<unsigned>(step / 2)) - step / 4;
  };
  for (std::size_t v = 0; v < s.mesh.vertices(); ++v) {
    jitter(s.mesh.x[v]);
    jitter(s.mesh.y[v]);
    const std::int32_t h = s.truth(s.mesh.x[v], s.mesh.y[v]);
    s.mesh.mark[v] = h == proto::kNoHeight ? proto::kVoid : 0;
    s.mesh.height[v] = h == proto::kNoHeight ? 0 : h;
  }
  for (std::size_t t = 0; t + 1 < s.mesh.triangles.size(); t += 2) {
    if (random() % 2) continue;
    const auto a = s.mesh.triangles[t];
    const auto nw = s.mesh.triangles[t + 1][2];
    const auto area = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
      const auto &x = s.mesh.x, &y = s.mesh.y;
      return std::int64_t{x[q] - x[p]} * (y[r] - y[p]) - std::int64_t{y[q] - y[p]} * (x[r] - x[p]);
    };
    if (area(a[0], a[1], nw) <= 0 || area(a[1], a[2], nw) <= 0) continue;
    s.mesh.triangles[t] = {a[0], a[1], nw};
    s.mesh.triangles[t + 1] = {a[1], a[2], nw};
  }
  return s;
}

struct Brute {
  double max_m = 0;                    ///< over both decodings and all hits
  double least_sum = 0, most_sum = 0;  ///< of squares; a sample on several triangles may take any of them
  std::uint32_t samples = 0, uncovered = 0, overcovered = 0, hits = 0;
};

/// Möller and Trumbore's ray and triangle; the ray both ways. infinity: no hit,
/// or one beyond the middle of the earth.
inline long double ray(const Point& from, const Point& along, const std::array<Point, 3>& t, long double grace) {
  const Point e1 = minus(t[1], t[0]), e2 = minus(t[2], t[0]), p = cross_product(along, e2);
  const long double det = product(e1, p);
  if (det == 0) return INFINITY;
  const Point s = minus(from, t[0]), q = cross_product(s, e1);
  const long double u = product(s, p) / det, v = product(along, q) / det;
  const long double hit = product(e2, q) / det;
  return u < -grace || v < -grace || u + v > 1 + grace || std::abs(hit) > 4e6 ? INFINITY : hit;
}

inline Brute brute(const Scene& s) {
  Brute b;
  const std::int32_t side = s.mesh.side;
  struct Shown {
    std::array<Point, 3> exact, rounded;
    std::array<std::int64_t, 3> x, y;
    bool area;
  };
  std::vector<Shown> shown;
  for (const auto& t : s.mesh.triangles) {
    if (!s.published(t)) continue;
    Shown one;
    for (unsigned k = 0; k < 3; ++k) {
      one.x[k] = s.mesh.x[t[k]];
      one.y[k] = s.mesh.y[t[k]];
      one.exact[k] = position(s.lattice, s.west() + one.x[k], s.south() + one.y[k], s.mesh.height[t[k]] / 1024.0L);
      const double height_m = s.mesh.height[t[k]] / 1024.0;
      const double apart_m = std::abs(height_m - s.steps.middle_m);
      double step_m = s.steps.finest_m;
      while (step_m < s.steps.coarsest_m && apart_m > s.steps.near_m * step_m / s.steps.finest_m) step_m *= 2;
      for (unsigned c = 0; c < 3; ++c) one.rounded[k][c] = std::nearbyint(static_cast<double>(one.exact[k][c]) / step_m) * step_m;
    }
    const Point n = cross_product(minus(one.exact[1], one.exact[0]), minus(one.exact[2], one.exact[0]));
    one.area = product(n, n) > 0;
    shown.push_back(one);
  }
  for (std::int64_t y = 0; y <= side; ++y) {
    for (std::int64_t x = 0; x <= side; ++x) {
      const std::int32_t h = s.truth(x, y);
      const bool valid = h != proto::kNoHeight;
      const Point from = position(s.lattice, s.west() + x, s.south() + y, valid ? h / 1024.0L : 0);
      const Point along = up(s.lattice, s.west() + x, s.south() + y);
      bool covered = false, summed = false, strictly = false;
      double least = INFINITY, most = 0;
      for (const Shown& t : shown) {
        const auto turn = [&](unsigned k) {
          const unsigned n = (k + 1) % 3;
          return (t.x[n] - t.x[k]) * (y - t.y[k]) - (t.y[n] - t.y[k]) * (x - t.x[k]);
        };
        const auto [west, east] = std::minmax({t.x[0], t.x[1], t.x[2]});
        const auto [south, north] = std::minmax({t.y[0], t.y[1], t.y[2]});
        const std::int64_t near = std::max(east - west, north - south);
        if (x < west - near || x > east + near || y < south - near || y > north + near) continue;
        const std::int64_t inside = std::min({turn(0), turn(1), turn(2)});
        strictly |= inside > 0;
        if (!valid) continue;
        for (const auto* corners : {&t.exact, &t.rounded}) {
          const long double hit = ray(from, along, *corners, 0);
          if (std::isinf(hit) || !t.area) continue;
          ++b.hits;
          b.max_m = std::max(b.max_m, static_cast<double>(std::abs(hit)));
        }
        if (inside < 0) continue;
        covered = true;
        if (!t.area) continue;
        summed = true;
        const double e = static_cast<double>(std::abs(ray(from, along, t.exact, 1e9L)));
        least = std::min(least, e);
        most = std::max(most, e);
      }
      if (!valid) b.overcovered += strictly;
      if (valid && !covered) ++b.uncovered;
      if (!summed) continue;
      ++b.samples;
      b.least_sum += least * least;
      b.most_sum += most * most;
    }
  }
  return b;
}

}  // namespace cordillera::gpu
