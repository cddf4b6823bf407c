#pragma once
// Tiles to encode before there is a simplifier to make them: regular meshes of a height function on the lattice, voids where it
// says so.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/encode/draco_mesh.h"
#include "pipeline/encode/encode.h"
#include "pipeline/encode/published_mesh.h"
#include "proto/ellipsoid.h"
#include "tests/gpu/grid_mesh.h"

namespace cordillera::pipeline {

// What builds give to all three is made for each here.
inline std::string encode_drc(const EncodeInput& input) { return encode_drc(input, published_mesh(*input.mesh)); }
inline std::string encode_glb(const EncodeInput& input) { return encode_glb(input, published_mesh(*input.mesh)); }
inline std::array<double, 6> tile_region(const EncodeInput& input) { return tile_region(input, published_mesh(*input.mesh)); }

}  // namespace cordillera::pipeline

namespace cordillera::pipeline::testing {

/// Metres at lattice vertex (i, j); nullopt: no data. i is taken modulo the circle by the caller's own doing.
using Heights = std::function<std::optional<double>(std::int64_t, std::int64_t)>;

/// Hills of every size, some of them steep.
inline Heights hills() {
  return [](std::int64_t i, std::int64_t j) -> std::optional<double> {
    const double x = static_cast<double>(i), y = static_cast<double>(j);
    return 900 + 600 * std::sin(x / 71) * std::cos(y / 53) + 150 * std::sin(x / 11 + y / 17) + 20 * std::sin(x * 1.7 - y * 2.3);
  };
}

/// The same with round lakes of nothing and, along diagonals, pairs of single cells that touch in one corner.
inline Heights hills_with_voids() {
  return [base = hills()](std::int64_t i, std::int64_t j) -> std::optional<double> {
    const std::int64_t u = i % 64 - 32, v = j % 64 - 32;
    if (u * u + v * v < 120) return std::nullopt;
    if ((u == 20 && v == 20) || (u == 22 && v == 20) || (u == 20 && v == 22) || (u == 22 && v == 22)) return std::nullopt;
    return base(i, j);
  };
}

/// The regular mesh of a tile with `cells` cells a side.
inline proto::TileMesh synthetic_mesh(const proto::Lattice& lattice, const proto::TileAddress& tile, std::int32_t cells,
                                      const Heights& at) {
  const auto step = static_cast<std::int32_t>(lattice.tile_units(tile.z) / cells);
  std::vector<std::int32_t> heights;
  for (std::int32_t r = 0; r <= cells; ++r) {
    for (std::int32_t c = 0; c <= cells; ++c) {
      const auto h =
          at((lattice.west(tile) + std::int64_t{c} * step) % lattice.columns(), lattice.south(tile) + std::int64_t{r} * step);
      heights.push_back(h ? static_cast<std::int32_t>(std::lround(*h / proto::kHeightStep_m)) : proto::kNoHeight);
    }
  }
  return gpu::grid_mesh(cells, step, heights);
}

/// The finest ecef_step_m that holds any tile of a level: Draco keeps 23 bits of a coordinate exactly.
inline double smallest_ecef_step_m(int level) {
  // Half of a tile's diagonal on the equator plus heights, halved again; at levels 0 and 1 the earth itself bounds the box.
  const double half_m = std::min(6.42e6, 0.7072 * 20037508.4 / std::ldexp(1, level) + proto::kMaxHeight_m * 2);
  double step = std::ldexp(1, -20);
  while (half_m / step > std::ldexp(1, kMaxGridBits - 1) - 2) step *= 2;
  return step;
}

inline EncodeInput encode_input(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::TileMesh& mesh) {
  EncodeInput input;
  input.lattice = &lattice;
  input.tile = tile;
  input.mesh = &mesh;
  input.ecef_steps = smallest_ecef_step_m(tile.z);
  input.skirts.depth_m = 40;
  input.geometric_error_m = 1.5;
  input.attribution = "Made \"by\" hand";
  return input;
}

}  // namespace cordillera::pipeline::testing
