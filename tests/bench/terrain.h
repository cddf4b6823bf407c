#pragma once
// Six kinds of terrain to measure and hash the simplifier on; integer arithmetic and + - x / only, so every machine makes the
// same.
#include <array>
#include <cstdint>
#include <string_view>
#include <vector>

namespace cordillera::bench {

enum class Terrain { alpine, rolling, city, islands, noise, plane };
inline constexpr std::string_view kTerrainNames[] = {"alpine", "rolling", "city", "islands", "noise", "plane"};

inline std::uint32_t mixed(std::uint32_t x, std::uint32_t y, std::uint32_t seed) {
  std::uint32_t h = x * 0x9e3779b1u ^ y * 0x85ebca77u ^ seed * 0xc2b2ae3du;
  h ^= h >> 15;
  h *= 0x2c1b3c6du;
  h ^= h >> 12;
  h *= 0x297a2d39u;
  return h ^ (h >> 15);
}

/// Smooth value noise in -1..1 with features of 2^shift samples.
inline double smooth_noise(std::int64_t x, std::int64_t y, int shift, std::uint32_t seed) {
  const std::int64_t cell = std::int64_t{1} << shift;
  const auto cx = static_cast<std::uint32_t>(x >> shift), cy = static_cast<std::uint32_t>(y >> shift);
  double fx = static_cast<double>(x & (cell - 1)) / static_cast<double>(cell),
         fy = static_cast<double>(y & (cell - 1)) / static_cast<double>(cell);
  fx = fx * fx * (3 - 2 * fx);
  fy = fy * fy * (3 - 2 * fy);
  const auto value = [&](std::uint32_t i, std::uint32_t j) { return static_cast<double>(mixed(i, j, seed) >> 8) * 0x1p-23 - 1; };
  const double south = value(cx, cy) * (1 - fx) + value(cx + 1, cy) * fx;
  const double north = value(cx, cy + 1) * (1 - fx) + value(cx + 1, cy + 1) * fx;
  return south * (1 - fy) + north * fy;
}

/// Of a grid of vertices, row by row: two a cell, counter-clockwise.
inline std::vector<std::array<std::uint32_t, 3>> grid_triangles(std::uint32_t columns, std::uint32_t rows) {
  std::vector<std::array<std::uint32_t, 3>> triangles;
  for (std::uint32_t row = 0; row + 1 < rows; ++row) {
    for (std::uint32_t column = 0; column + 1 < columns; ++column) {
      const std::uint32_t a = row * columns + column, b = a + 1, c = a + columns, d = c + 1;
      triangles.push_back({a, b, d});
      triangles.push_back({a, d, c});
    }
  }
  return triangles;
}

/// Height in 2^-10 m at a sample, INT32_MIN where there is no data.
inline std::int32_t terrain_height(Terrain kind, std::int64_t x, std::int64_t y) {
  double h = 0;
  switch (kind) {
    case Terrain::alpine: {
      double weight = 1;
      for (int o = 0; o < 8; ++o) {
        double ridge = smooth_noise(x, y, 9 - o, 11u + static_cast<std::uint32_t>(o));
        ridge = 1 - (ridge < 0 ? -ridge : ridge);
        ridge *= ridge * weight;
        h += ridge * 1400 / static_cast<double>(1 << o);
        weight = ridge * 1.7 > 1 ? 1 : ridge * 1.7;
      }
      h -= 700;
      if (h < 0) h = 0;
      break;
    }
    case Terrain::rolling:
      for (int o = 0; o < 5; ++o)
        h += 120 * smooth_noise(x, y, 8 - o, 31u + static_cast<std::uint32_t>(o)) / static_cast<double>(1 << o);
      break;
    case Terrain::city:
      h = 3 * smooth_noise(x, y, 6, 41);
      if (mixed(static_cast<std::uint32_t>(x >> 4), static_cast<std::uint32_t>(y >> 4), 42) % 3 == 0 && (x & 15) > 2 &&
          (y & 15) > 4) {
        h += 8 + mixed(static_cast<std::uint32_t>(x >> 4), static_cast<std::uint32_t>(y >> 4), 43) % 30;
      }
      break;
    case Terrain::islands:
      h = 300 * smooth_noise(x, y, 6, 51) + 60 * smooth_noise(x, y, 4, 52) + 15 * smooth_noise(x, y, 2, 53);
      if (h < 0) return INT32_MIN;
      break;
    case Terrain::noise: h = 30 * smooth_noise(x, y, 0, 61); break;
    case Terrain::plane: h = 0.25 * static_cast<double>(x) + 0.5 * static_cast<double>(y); break;
  }
  const double steps = h * 1024;
  return static_cast<std::int32_t>(steps < 0 ? steps - 0.5 : steps + 0.5);
}

}  // namespace cordillera::bench
