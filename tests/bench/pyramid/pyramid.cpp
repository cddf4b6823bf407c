#include "tests/bench/pyramid/pyramid.h"

#include <algorithm>
#include <bit>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <map>
#include <stdexcept>
#include <string>

#include "gpu/measure/sample_frames.h"
#include "gpu/measure/surface_memory.h"
#include "pipeline/tile/border.h"
#include "pipeline/tile/chain.h"
#include "pipeline/tile/weld.h"

namespace cordillera::bench {
namespace {

using pipeline::Along;
using pipeline::ChainRule;
using pipeline::Edge;
using pipeline::Side;
using proto::TileAddress;
using proto::TileMesh;

constexpr int kFinest = 14;

double seconds() { return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count(); }

struct Pyramid {
  Terrain kind;
  int across;
  float tolerance_m;
  proto::Lattice lattice{kFinest};
  TileAddress corner{kFinest, 16384 + 640, 12288};  ///< divisible by every `across` in use

  std::int32_t height(std::int64_t column, std::int64_t row) const {
    const std::int64_t x = column - lattice.west(corner), y = row - lattice.south(corner);
    const std::int64_t end = std::int64_t{across} * proto::kTileCells;
    if (x < 0 || y < 0 || x > end || y > end) return proto::kNoHeight;
    return terrain_height(kind, x, y);
  }

  ChainRule rule(int z) const {
    const auto cell = static_cast<std::int32_t>(lattice.cell_units(z));
    return {0.5 * tolerance_m * cell, cell, 0};
  }

  /// All there are.
  proto::Samples samples() const {
    const auto side = static_cast<std::int32_t>(across * proto::kTileCells + 1);
    proto::Samples samples{lattice.west(corner), lattice.south(corner), side, side, {}, {}};
    for (std::int32_t y = 0; y < side; ++y) {
      for (std::int32_t x = 0; x < side; ++x) samples.height.push_back(terrain_height(kind, x, y));
    }
    return samples;
  }

  void chains(TileMesh& mesh, const TileAddress& tile) const {
    for (const Side side : {Side::west, Side::east, Side::south, Side::north}) {
      const Edge edge = pipeline::edge_of(lattice, tile, side);
      std::vector<std::int32_t> heights;
      for (std::int64_t k = 0; k <= edge.units; ++k) {
        heights.push_back(
            height(edge.column + (edge.along == Along::east ? k : 0), edge.row + (edge.along == Along::north ? k : 0)));
      }
      const auto chain = tile.z == kFinest
                             ? pipeline::chain_finest(edge, heights, rule(tile.z))
                             : pipeline::simplify_chain(edge, pipeline::border_chain(mesh, side), heights, rule(tile.z));
      const auto applied = pipeline::apply_chain(mesh, side, chain);
      if (!applied.ok()) throw std::logic_error(applied.problem().detail);
    }
  }

  TileMesh grid(const TileAddress& tile) const {
    std::vector<std::int32_t> heights;
    for (std::int64_t r = 0; r <= proto::kTileCells; ++r) {
      for (std::int64_t c = 0; c <= proto::kTileCells; ++c)
        heights.push_back(height(lattice.west(tile) + c, lattice.south(tile) + r));
    }
    return gpu::grid_mesh(proto::kTileCells, 1, heights);
  }

  proto::Result<TileMesh> welded(const TileAddress& tile, const std::map<TileAddress, TileMesh>& below) const {
    pipeline::WeldInput input;
    input.child_side = static_cast<std::int32_t>(lattice.tile_units(tile.z + 1));
    for (int c = 0; c < 4; ++c) {
      const auto found = below.find(tile.child(c));
      if (found != below.end()) input.children[static_cast<std::size_t>(c)] = &found->second;
    }
    return pipeline::weld(input);
  }
};

void add(std::uint64_t& hash, std::uint64_t value) {
  for (int k = 0; k < 8; ++k) hash = (hash ^ ((value >> (8 * k)) & 255)) * 1099511628211ull;
}

void add_mesh(std::uint64_t& hash, const TileMesh& mesh) {
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    add(hash, static_cast<std::uint32_t>(mesh.x[v]) | static_cast<std::uint64_t>(static_cast<std::uint32_t>(mesh.y[v])) << 32);
    add(hash, static_cast<std::uint32_t>(mesh.height[v]) | static_cast<std::uint64_t>(mesh.mark[v]) << 32);
  }
  for (const auto& t : mesh.triangles) {
    add(hash, t[0] | static_cast<std::uint64_t>(t[1]) << 32);
    add(hash, t[2]);
  }
}

std::vector<TileMesh> simplified(gpu::Simplifier& simplifier, std::span<const gpu::SimplifyJob> jobs, bool alone) {
  if (!alone) return simplifier.simplify(jobs);
  std::vector<TileMesh> meshes;
  for (std::size_t k = 0; k < jobs.size(); ++k) meshes.push_back(std::move(simplifier.simplify(jobs.subspan(k, 1)).front()));
  return meshes;
}

/// Of all tiles of a level, the fastest of some times.
void measure_level(const std::map<TileAddress, TileMesh>& meshes, const proto::Lattice& lattice, const proto::Samples& truth,
                   const PyramidRun& run, LevelFigures& level) {
  const gpu::SampleFrames frames(lattice, truth);
  std::vector<gpu::SurfaceErrorInput> tiles;
  for (const auto& [tile, mesh] : meshes) tiles.push_back({&lattice, tile, &mesh, &truth, 1.0 / 256, &frames});
  std::vector<gpu::SurfaceError> errors(tiles.size());
  for (int k = 0; k < run.repeats; ++k) {
    const double begin = seconds();
    std::vector<gpu::SurfaceMemory> memories(tiles.size());
    if (run.meter) run.meter->measure(tiles, INFINITY, memories);
    run.parallel(tiles.size(), [&](std::size_t t) { errors[t] = gpu::surface_error(tiles[t], INFINITY, memories[t]); });
    const double took = seconds() - begin;
    if (k == 0 || took < level.measure_s) level.measure_s = took;
  }
  double squares_m2 = 0, samples = 0;
  for (const gpu::SurfaceError& error : errors) {
    level.max_error_m = std::max(level.max_error_m, error.max_m);
    squares_m2 += error.sum_squared_m2;
    samples += error.samples;
  }
  level.rmse_m = std::sqrt(squares_m2 / samples);
}

}  // namespace

std::vector<LevelFigures> run_pyramid(Terrain kind, int across, float tolerance_m, gpu::Simplifier& simplifier,
                                      const PyramidRun& run) {
  const Pyramid pyramid{kind, across, tolerance_m};
  const int top = kFinest - std::countr_zero(static_cast<unsigned>(across));
  std::map<TileAddress, TileMesh> below;
  std::vector<LevelFigures> figures;
  proto::Samples samples;
  if (run.errors) samples = pyramid.samples();
  for (int z = kFinest; z >= top && kFinest - z < run.levels; --z) {
    LevelFigures level;
    level.level = z;
    const double start = seconds();
    std::map<TileAddress, TileMesh> input;
    const int down = kFinest - z;
    for (int y = 0; y < across >> down; ++y) {
      for (int x = 0; x < across >> down; ++x) {
        const TileAddress tile{z, (pyramid.corner.x >> down) + x, (pyramid.corner.y >> down) + y};
        proto::Result<TileMesh> mesh = z == kFinest ? pyramid.grid(tile) : pyramid.welded(tile, below);
        if (!mesh.ok()) {
          // Some vertex could not leave its border. A build asks such a tile again with more of its inside left, the bench does
          // not.
          std::fprintf(stderr, "%s ends below level %d: %s\n", std::string(kTerrainNames[static_cast<int>(kind)]).c_str(), z,
                       mesh.problem().detail.c_str());
          return figures;
        }
        pyramid.chains(*mesh, tile);
        level.vertices_in += mesh->vertices();
        input.emplace(tile, std::move(*mesh));
      }
    }
    level.tiles = input.size();
    std::vector<std::vector<float>> elevations;
    std::vector<gpu::SimplifyJob> jobs;
    const auto cell = static_cast<float>(pyramid.lattice.cell_units(z));
    for (const auto& [tile, mesh] : input) {
      elevations.emplace_back(mesh.vertices());
      for (std::size_t v = 0; v < mesh.vertices(); ++v) elevations.back()[v] = static_cast<float>(mesh.height[v]) / 1024.0f;
    }
    for (const auto& [tile, mesh] : input) {
      jobs.push_back(
          {&mesh, elevations[jobs.size()], cell, tolerance_m * cell, tolerance_m * cell * (z == kFinest ? 1.0f : 0.5f), cell});
      if (z == kFinest) jobs.back().start_tolerance_m = run.start_share * tolerance_m;
    }
    const double ready = seconds();
    level.prepare_s = ready - start;
    std::vector<TileMesh> meshes;
    for (int k = 0; k < run.repeats; ++k) {
      const double begin = seconds();
      meshes = simplified(simplifier, jobs, run.alone);
      const double took = seconds() - begin;
      if (k > 0 && took >= level.simplify_s) continue;
      level.simplify_s = took;
      level.stages.assign(simplifier.stages().begin(), simplifier.stages().end());
    }
    level.hash = 14695981039346656037ull;
    below.clear();
    std::size_t k = 0;
    for (const auto& [tile, mesh] : input) {
      add(level.hash, static_cast<std::uint64_t>(tile.x) << 32 | static_cast<std::uint32_t>(tile.y));
      add_mesh(level.hash, meshes[k]);
      level.vertices += meshes[k].vertices();
      level.triangles += meshes[k].triangles.size();
      below.emplace(tile, std::move(meshes[k++]));
    }
    if (run.errors) measure_level(below, pyramid.lattice, samples, run, level);
    figures.push_back(level);
  }
  return figures;
}

}  // namespace cordillera::bench
