#pragma once
// Terrains for tests of gpu/exact: those of the benches, and some that are made to hurt.
#include <string>

#include "gpu/exact/simplify_block.h"
#include "tests/bench/terrain.h"

namespace cordillera::gpu::exact {

/// A sample's height in 2^-10 m, proto::kNoHeight where void. comb: upright teeth of one column; cliff: 2 km; sparse: single
/// valid samples among voids, and the other way round; tower: one sample of 8 km; shore: no data north of row 0.
inline std::int32_t made_height(const std::string& name, std::int64_t x, std::int64_t y) {
  const std::uint32_t random = bench::mixed(static_cast<std::uint32_t>(x), static_cast<std::uint32_t>(y), 7);
  if (name == "comb") return (x & 1) && (y & 31) > 3 ? 300 * 1024 : static_cast<std::int32_t>(y * 100);
  if (name == "cliff") return x + y / 3 > 90 ? 2000 * 1024 : static_cast<std::int32_t>(random % 512);
  if (name == "tower") return x == 40 && y == 41 ? 8000 * 1024 : 0;
  if (name == "sparse") {
    const bool rare = random % 97 == 0, inside = x > 40 && x < 100 && y > 20 && y < 90;
    return rare == inside ? static_cast<std::int32_t>(1024 * (x + y)) : proto::kNoHeight;
  }
  if (name == "shore") return y > 0 ? proto::kNoHeight : static_cast<std::int32_t>(1024 * (x + y) / 8 + random % 512);
  if (name == "void") return proto::kNoHeight;
  for (int kind = 0; kind < 6; ++kind) {
    if (name == bench::kTerrainNames[kind]) return bench::terrain_height(static_cast<bench::Terrain>(kind), x, y);
  }
  return 0;
}

struct Window {
  std::int64_t west = 0, south = 0;
  std::int32_t columns = 0, rows = 0;
};
inline proto::Samples made_samples(const std::string& name, const Window& window) {
  proto::Samples samples;
  samples.west = window.west;
  samples.south = window.south;
  samples.columns = window.columns;
  samples.rows = window.rows;
  for (std::int64_t y = 0; y < window.rows; ++y) {
    for (std::int64_t x = 0; x < window.columns; ++x)
      samples.height.push_back(made_height(name, window.west + x, window.south + y));
  }
  return samples;
}

}  // namespace cordillera::gpu::exact
