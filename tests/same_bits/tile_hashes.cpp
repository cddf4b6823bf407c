// tile_hashes [TERRAIN]...: small pyramids, the way a build makes its tiles: chains, waves, refinement, true errors, welds, and a
// parent whose error is composed. Prints a line a tile: its hash, with the bits of what it states. This program is built twice.
#include <algorithm>
#include <bit>
#include <cinttypes>
#include <cstdio>
#include <map>

#include "gpu/simplify.h"
#include "pipeline/plan/plan.h"
#include "pipeline/tile/tile_mesh.h"
#include "tests/bench/pyramid/terrain.h"

using namespace cordillera;

namespace {

constexpr int kFinest = 14, kAcross = 2;
constexpr double kError_m = 4;
constexpr proto::TileAddress kCorner{kFinest, 16384 + 640, 12288};  // near 46 N 7 E; even, so that the four have one parent

using Tiles = std::map<proto::TileAddress, pipeline::BuiltTile>;

proto::Plan plan_at(const proto::Lattice& lattice) {
  proto::Plan plan;
  plan.set_finest_level(kFinest);
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

proto::Samples samples_of(bench::Terrain kind, const proto::Plan& plan) {
  proto::Samples samples;
  samples.west = plan.window(0);
  samples.south = plan.window(1);
  samples.columns = samples.rows = kAcross * proto::kTileCells + 1;
  for (int y = 0; y < samples.rows; ++y)
    for (int x = 0; x < samples.columns; ++x) samples.height.push_back(bench::terrain_height(kind, x, y));
  samples.flat_water.assign(samples.height.size(), 0);
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
  std::printf("%-8s %d/%d/%d %-8s %7zu triangles %10.4f m %016" PRIx64 "\n", bench::kTerrainNames[static_cast<int>(kind)].data(),
              tile.tile.z, tile.tile.x, tile.tile.y, tile.composed ? "composed" : "measured", tile.mesh.triangles.size(),
              tile.max_error_m, hash_of(tile));
}

void run(bench::Terrain kind, gpu::Simplifier& simplifier) {
  const proto::Lattice lattice{kFinest};
  const proto::Plan plan = plan_at(lattice);
  const proto::Samples samples = samples_of(kind, plan);
  Tiles finest;
  for (const proto::TileAddress& at : pipeline::touched_tiles(plan, kFinest, kCorner.parent())) {
    const pipeline::LevelContext context{&lattice, &plan.levels(0), true, &samples};
    auto prepared = pipeline::prepare_finest(context, at);
    if (!prepared) continue;
    const auto& tile = finest.emplace(at, pipeline::complete(context, *prepared, simplifier)).first->second;
    print(kind, tile);
  }
  std::array<const pipeline::BuiltTile*, 4> children{};
  for (std::size_t c = 0; c < 4; ++c) children[c] = &finest.at(kCorner.parent().child(static_cast<int>(c)));
  for (const proto::Samples* seen : {&samples, static_cast<const proto::Samples*>(nullptr)}) {
    // Refining rough terrain against its children's surfaces takes half a minute at -O0: there the bound alone is hashed.
    const bool promise = seen || kind == bench::Terrain::rolling;
    const pipeline::LevelContext context{&lattice, &plan.levels(1), promise, seen};
    auto prepared = pipeline::prepare_parent(context, kCorner.parent(), children);
    print(kind, pipeline::complete(context, *prepared, simplifier));
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
  const auto simplifier = gpu::make_simplifier("cpu");
  for (int k = 0; k < 6; ++k) {
    const auto kind = static_cast<bench::Terrain>(k);
    if (is_asked(kind, count - 1, words + 1)) run(kind, **simplifier);
  }
  return 0;
}
