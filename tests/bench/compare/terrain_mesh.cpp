// terrain_mesh COLUMNS ROWS OUT.ply [SPACING_M=30] [SEED=1]: a mountain range between a flat sea and gentle hills, as a grid
// mesh. A place has its height whatever the spacing: the same terrain at half the spacing has the samples in between.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdio>
#include <cstdlib>

#include "proto/mesh_file/mesh_file.h"

namespace {

using namespace cordillera;

constexpr double kFeature_m = 14000;  // across a massif

std::uint32_t mixed(std::int32_t i, std::int32_t j, std::uint32_t layer) {
  std::uint32_t h =
      static_cast<std::uint32_t>(i) * 0x8da6b343u ^ static_cast<std::uint32_t>(j) * 0xd8163841u ^ layer * 0xcb1ab31fu;
  h ^= h >> 16;
  h *= 0x7feb352du;
  h ^= h >> 15;
  h *= 0x846ca68bu;
  return h ^ (h >> 16);
}

/// Gradient noise, about -1 to 1, over cells of length 1.
double noise(double x, double y, std::uint32_t layer) {
  const double west = std::floor(x), south = std::floor(y), u = x - west, v = y - south;
  const auto slope = [&](int di, int dj) {
    // One of 16 directions in the circle, without trigonometry: points of a square, each as long as it is.
    static constexpr double kAlong[16] = {1, 1, 1, 1, 1, .5, 0, -.5, -1, -1, -1, -1, -1, -.5, 0, .5};
    const std::uint32_t k = mixed(static_cast<std::int32_t>(west) + di, static_cast<std::int32_t>(south) + dj, layer) >> 28;
    return kAlong[(k + 2) % 16] * (u - di) + kAlong[(k + 14) % 16] * (v - dj);
  };
  const auto smooth = [](double t) { return t * t * t * (t * (t * 6 - 15) + 10); };
  const double a = smooth(u), b = smooth(v);
  const double below = slope(0, 0) + (slope(1, 0) - slope(0, 0)) * a, above = slope(0, 1) + (slope(1, 1) - slope(0, 1)) * a;
  return 1.2 * (below + (above - below) * b);
}

/// Octaves of noise, each a bit more than twice as fine and weaker by gain.
double hills(double x, double y, int octaves, double gain, std::uint32_t layer) {
  double sum = 0, weight = 1, whole = 0;
  for (int o = 0; o < octaves; ++o) {
    sum += weight * noise(x, y, layer + static_cast<std::uint32_t>(o));
    whole += weight;
    weight *= gain;
    x = x * 2.03 + 11.7;
    y = y * 2.03 - 5.3;
  }
  return sum / whole;
}

/// Ridges where noise changes its sign; fine ridges only on high ones, so that valleys are smooth. 0 to 1.
double ridges(double x, double y, int octaves, std::uint32_t layer) {
  double sum = 0, weight = 1, whole = 0, carried = 1;
  for (int o = 0; o < octaves; ++o) {
    double ridge = 1 - std::min(1.0, std::abs(noise(x, y, layer + static_cast<std::uint32_t>(o))));
    ridge *= ridge * carried;
    carried = std::clamp(ridge * 1.7, 0.0, 1.0);
    sum += weight * ridge;
    whole += weight;
    weight *= 0.45;
    x = x * 2.05 - 3.1;
    y = y * 2.05 + 7.9;
  }
  return sum / whole;
}

double height_m(double x_m, double y_m, std::uint32_t seed) {
  const std::uint32_t layer = seed * 1000;
  const double x = x_m / kFeature_m, y = y_m / kFeature_m;
  const double wx = x + 0.3 * hills(x + 3.7, y, 4, 0.5, layer + 100), wy = y + 0.3 * hills(x, y + 8.2, 4, 0.5, layer + 200);
  const double land = hills(wx * 0.7 + 1.9, wy * 0.7 + 6.4, 4, 0.5, layer + 300) + 0.25;
  double massif = std::clamp((land - 0.02) / 0.4, 0.0, 1.0);
  massif *= massif * (3 - 2 * massif);
  const double z = 500 * land + 45 * hills(wx * 4, wy * 4, 6, 0.5, layer + 400) + massif * 2600 * ridges(wx, wy, 9, layer + 500);
  return std::max(z, 0.0);
}

}  // namespace

int main(int count, char** words) {
  if (count < 4) {
    std::fprintf(stderr, "usage: %s COLUMNS ROWS OUT.ply [SPACING_M=30] [SEED=1]\n", words[0]);
    return 2;
  }
  const int columns = std::atoi(words[1]), rows = std::atoi(words[2]);
  const double spacing_m = count > 4 ? std::atof(words[4]) : 30;
  const auto seed = static_cast<std::uint32_t>(count > 5 ? std::atoi(words[5]) : 1);
  if (columns < 2 || rows < 2 || !(spacing_m > 0)) {
    std::fprintf(stderr, "%s: two columns and rows at least, a spacing above 0\n", words[0]);
    return 2;
  }
  proto::TriangleMesh mesh;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      mesh.x.push_back(c * spacing_m);
      mesh.y.push_back(r * spacing_m);
      mesh.z.push_back(static_cast<float>(height_m(c * spacing_m, r * spacing_m, seed)));
    }
  }
  const auto at = [columns](int c, int r) { return static_cast<std::uint32_t>(r * columns + c); };
  for (int r = 0; r + 1 < rows; ++r) {
    for (int c = 0; c + 1 < columns; ++c) {
      mesh.triangles.push_back({at(c, r), at(c + 1, r), at(c + 1, r + 1)});
      mesh.triangles.push_back({at(c, r), at(c + 1, r + 1), at(c, r + 1)});
    }
  }
  const auto written = proto::write_mesh_file(words[3], mesh, {});
  if (!written) std::fprintf(stderr, "%s\n", written.problem().line().c_str());
  const auto [low, high] = std::minmax_element(mesh.z.begin(), mesh.z.end());
  const auto sea = std::count(mesh.z.begin(), mesh.z.end(), 0.0);
  std::printf("%zu vertices, %zu triangles, %.0f to %.0f m, %.1f %% flat sea\n", mesh.vertices(), mesh.triangles.size(), *low,
              *high, 100.0 * static_cast<double>(sea) / static_cast<double>(mesh.vertices()));
  return written ? 0 : 1;
}
