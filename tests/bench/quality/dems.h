#pragma once
// Elevation models to measure and hash the mesh simplifier on: the six terrains of the pyramid bench, and five that hurt. Integer
// arithmetic and + - x only, so every machine makes the same.
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gpu/fit/simplify_height_mesh.h"

namespace cordillera::bench {

/// alpine, rolling, city, islands, noise, plane, and
///   ridge    one row of samples, 80 m high, in a plain
///   cliff    10 km, slanting
///   faint    a relief of a millimetre, 4 km up
///   high     alpine stretched to 9 km
///   extreme  heights of both signs near the end of what a float holds
std::span<const std::string_view> dem_names();
/// side * side heights in metres, row by row from sample (first, first) of the terrain in the south-west. Holes are 0. Empty if
/// the name is not one of the above. The first 200 samples of the alpine kind are sea.
std::vector<float> dem_heights(std::string_view name, std::uint32_t side, std::uint32_t first = 0);

/// Every second sample of every second row; of an even number of columns or rows, the last is left out.
std::vector<float> every_second(std::span<const float> heights, std::uint32_t columns);

/// Two triangles in every cell, parted from the south-west to the north-east.
gpu::fit::HeightMesh mesh_of(std::span<const float> heights, std::uint32_t columns, double cell_m);

struct Way {
  const char* name;
  gpu::fit::MeshOptions options;
};
/// fast, fit (fast and three sweeps), default, best, minimax.
std::vector<Way> ways(const std::string& device, unsigned threads);

}  // namespace cordillera::bench
