// tile_hashes [TERRAIN]...: small blocks, the way a build makes its tiles: simplified, cut, measured in space and refined where
// they are too far off. Prints a line a tile: its hash, with the bits of what it states. This program is built twice.
#include <algorithm>
#include <bit>
#include <cinttypes>
#include <cstdio>

#include "gpu/exact/simplify_block.h"
#include "gpu/measure/surface_memory.h"
#include "gpu/simplify.h"
#include "pipeline/build/exact/exact_block.h"
#include "pipeline/plan/plan.h"
#include "tests/bench/terrain.h"

using namespace cordillera;

namespace {

constexpr int kFinest = 14, kAcross = 2;
constexpr double kError_m = 4;
constexpr proto::TileAddress kCorner{kFinest, 16384 + 640, 12288};  // near 46 N 7 E; even, so that the four have one parent

proto::Plan plan_at(const proto::Lattice& lattice) {
  proto::Plan plan;
  plan.set_finest_level(kFinest);
  plan.set_min_level(kFinest - 1);
  plan.set_block_level(kFinest - 1);
  const auto west = static_cast<std::int32_t>(lattice.west(kCorner)), south = static_cast<std::int32_t>(lattice.south(kCorner));
  for (const std::int32_t side : {west, south, west + kAcross * proto::kTileCells, south + kAcross * proto::kTileCells})
    plan.add_window(side);
  for (int z = kFinest; z >= kFinest - 1; --z) {
    proto::LevelPlan* level = plan.add_levels();
    level->set_level(static_cast<std::uint32_t>(z));
    level->set_target(kError_m * static_cast<double>(lattice.cell_units(z)));
    pipeline::derive_level(plan, *level);
  }
  return plan;
}

proto::Samples samples_of(bench::Terrain kind, const pipeline::BlockPlace& place) {
  proto::Samples samples = place.empty_samples();
  for (int y = 0; y < samples.rows; ++y)
    for (int x = 0; x < samples.columns; ++x)
      samples.height[static_cast<std::size_t>(y * samples.columns + x)] = bench::terrain_height(kind, x, y);
  return samples;
}

/// FNV-1a.
struct Hash {
  std::uint64_t value = 14695981039346656037ull;
  void add(std::uint64_t bits) {
    for (int k = 0; k < 64; k += 8) value = (value ^ (bits >> k & 255)) * 1099511628211ull;
  }
  void add(double number) { add(std::bit_cast<std::uint64_t>(number)); }
};

std::uint64_t hash_of(const pipeline::BuiltTile& tile) {
  Hash hash;
  for (std::size_t v = 0; v < tile.mesh.vertices(); ++v) {
    for (const std::int32_t number : {tile.mesh.x[v], tile.mesh.y[v], tile.mesh.height[v]})
      hash.add(static_cast<std::uint64_t>(number));
    hash.add(std::uint64_t{tile.mesh.mark[v]});
  }
  for (const auto& triangle : tile.mesh.triangles)
    for (const std::uint32_t corner : triangle) hash.add(std::uint64_t{corner});
  for (const double number : {tile.max_error_m, tile.measured.max_m, tile.measured.sum_squared_m2}) hash.add(number);
  for (const std::uint32_t count : {tile.measured.samples, tile.measured.uncovered, tile.measured.overcovered})
    hash.add(std::uint64_t{count});
  return hash.value;
}

void print(bench::Terrain kind, const pipeline::BuiltTile& tile) {
  std::printf("%-8s %d/%d/%d %7zu triangles %10.4f m %016" PRIx64 "\n", bench::kTerrainNames[static_cast<int>(kind)].data(),
              tile.tile.z, tile.tile.x, tile.tile.y, tile.mesh.triangles.size(), tile.max_error_m, hash_of(tile));
}

/// The finest level is refined to half of its target, or a build's hand for walls would not be seen.
void run(bench::Terrain kind, gpu::exact::BlockSimplifier& simplifier) {
  const proto::Lattice lattice{kFinest};
  const proto::Plan plan = plan_at(lattice);
  const pipeline::BlockPlace place = pipeline::place_alone(plan, kCorner.parent());
  const proto::Samples samples = samples_of(kind, place);
  const pipeline::BlockCurve curve = pipeline::curve_of(plan, place);
  const gpu::exact::Block block = pipeline::block_at(plan, place, samples, curve);
  const auto levels = simplifier.simplify({&block, 1}, pipeline::levels_of_block(plan, kFinest - 1, place, samples));
  for (int z = kFinest; z >= kFinest - 1; --z) {
    proto::LevelPlan level = pipeline::level_plan(plan, z);
    if (z == kFinest) level.set_target(level.target() / 2);
    const pipeline::LevelContext context{&lattice, &level, &samples};
    const gpu::exact::BlockMesh& mesh = levels.value().front()[static_cast<std::size_t>(kFinest - z)];
    for (pipeline::BuiltTile& tile : pipeline::tiles_of_block(plan, place, z, mesh)) {
      gpu::SurfaceMemory memory;
      pipeline::measure_exact(context, tile, memory);
      print(kind, tile);
    }
  }
}

// Those asked for by name, else all but noise (which keeps half of its vertices and takes as long as all the others).
bool is_asked(bench::Terrain kind, int count, char** names) {
  if (count == 0) return kind != bench::Terrain::noise;
  return std::find(names, names + count, bench::kTerrainNames[static_cast<int>(kind)]) != names + count;
}

}  // namespace

int main(int count, char** words) {
  std::setvbuf(stdout, nullptr, _IOLBF, 4096);  // what was printed before a crash tells where
  const auto simplifier = gpu::exact::make_block_simplifier("cpu", gpu::one_after_the_other);
  for (int k = 0; k < 6; ++k) {
    const auto kind = static_cast<bench::Terrain>(k);
    if (is_asked(kind, count - 1, words + 1)) run(kind, **simplifier);
  }
  return 0;
}
