#include "tests/bench/quality/dems.h"

#include <algorithm>

#include "tests/bench/terrain.h"

namespace cordillera::bench {
namespace {

using gpu::fit::HeightMesh;
using gpu::fit::Quality;

constexpr int kTerrains = 6;
constexpr std::string_view kNames[] = {"alpine", "rolling", "city",  "islands", "noise",  "plane",
                                       "ridge",  "cliff",   "faint", "high",    "extreme"};

double metres(Terrain kind, std::uint32_t x, std::uint32_t y) {
  const std::int32_t height = terrain_height(kind, x, y);
  return height == INT32_MIN ? 0 : height / 1024.0;
}

double height_at(std::string_view name, std::uint32_t x, std::uint32_t y, std::uint32_t side, std::uint32_t first) {
  if (name == "ridge") return x - first == side / 2 ? 80 : 0;
  if (name == "cliff") return 3 * (x - first) + (y - first) < 2 * side ? 0 : 10000;
  if (name == "faint") return 4000 + 1e-3 * smooth_noise(x, y, 4, 3);
  if (name == "high") return 9 * metres(Terrain::alpine, x, y);
  return 3e38 * smooth_noise(x, y, 4, 3);
}

}  // namespace

std::span<const std::string_view> dem_names() { return kNames; }

std::vector<float> dem_heights(std::string_view name, std::uint32_t side, std::uint32_t first) {
  const auto found = std::find(std::begin(kNames), std::end(kNames), name);
  if (found == std::end(kNames)) return {};
  const auto kind = found - std::begin(kNames);
  std::vector<float> heights;
  heights.reserve(std::size_t{side} * side);
  for (std::uint32_t y = first; y < first + side; ++y) {
    for (std::uint32_t x = first; x < first + side; ++x) {
      heights.push_back(
          static_cast<float>(kind < kTerrains ? metres(static_cast<Terrain>(kind), x, y) : height_at(name, x, y, side, first)));
    }
  }
  return heights;
}

std::vector<float> every_second(std::span<const float> heights, std::uint32_t columns) {
  std::vector<float> some;
  for (std::size_t row = 0; row < heights.size(); row += 2 * std::size_t{columns}) {
    for (std::size_t column = 0; column < columns; column += 2) some.push_back(heights[row + column]);
  }
  return some;
}

HeightMesh mesh_of(std::span<const float> heights, std::uint32_t columns, double cell_m) {
  HeightMesh mesh;
  const auto rows = static_cast<std::uint32_t>(heights.size() / columns);
  for (std::uint32_t i = 0; i < heights.size(); ++i) {
    mesh.x.push_back(i % columns * cell_m);
    mesh.y.push_back(i / columns * cell_m);
    mesh.z.push_back(static_cast<double>(heights[i]));
  }
  mesh.triangles = bench::grid_triangles(columns, rows);
  return mesh;
}

std::vector<Way> ways(const std::string& device, unsigned threads) {
  return {{"fast", {Quality::fast, device, threads}},
          {"fit", {Quality::fast, device, threads, 3, 0}},
          {"default", {Quality::default_, device, threads}},
          {"best", {Quality::best, device, threads}},
          {"minimax", {Quality::minimax, device, threads}}};
}

}  // namespace cordillera::bench
