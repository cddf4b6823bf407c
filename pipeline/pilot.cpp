#include "pipeline/pilot.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <vector>

#include "pipeline/plan.h"
#include "pipeline/tile_mesh.h"

namespace cordillera::pipeline {
namespace {

constexpr std::size_t kSubtrees = 4;   // sample sub-trees of a dataset that is too large to be its own sample
constexpr int kSubtreeLevels = 2;      // 4 x 4 finest tiles each
constexpr std::size_t kWholeTiles = 64;  // a dataset of so few finest tiles is its own sample
constexpr int kSteps = 9;              // of a bisection that starts from a factor of 64
constexpr double kCloseEnough = 0.01;  // relative to the share

/// Tiles of one level, by address; and what was published of them.
using Tiles = std::map<proto::TileAddress, BuiltTile>;

std::size_t published_triangles(const proto::TileMesh& mesh) {
  return static_cast<std::size_t>(std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) {
    return !((mesh.mark[t[0]] | mesh.mark[t[1]] | mesh.mark[t[2]]) & proto::kVoid);
  }));
}

struct Pilot {
  raster::Source& source;
  gpu::Simplifier& simplifier;
  proto::Plan& plan;
  const std::atomic<bool>& stop;
  proto::Lattice lattice = lattice_of(plan);
  int top = 0;  ///< coarsest level the sample reaches
  std::vector<proto::TileAddress> roots{};
  std::vector<proto::Samples> samples{};  ///< indexed as roots
  double grid_triangles = 0;

  proto::Result<void> read();
  LevelContext context(int z, std::size_t root) const { return {&lattice, &level_plan(plan, z), false, &samples[root]}; }
  std::vector<std::pair<std::size_t, PreparedTile>> prepare(int z, const Tiles& children) const;
  Tiles simplify(int z, const Tiles& children, double& triangles) const;
  proto::LevelPlan& level(int z) const { return *plan.mutable_levels(lattice.finest_level - z); }
};

/// Evenly spread choice of sub-trees; the rule of position alone keeps it deterministic.
proto::Result<void> Pilot::read() {
  const int block = static_cast<int>(plan.block_level());
  const bool whole = touched_tiles(plan, lattice.finest_level).size() <= kWholeTiles;
  top = whole ? block : std::max(block, lattice.finest_level - kSubtreeLevels);
  const std::vector<proto::TileAddress> all = touched_tiles(plan, top);
  const std::size_t wanted = whole ? all.size() : std::min(kSubtrees, all.size());
  // Tiles of the data's edge may be empty: look on from each chosen place until one has data.
  for (std::size_t k = 0; k < wanted; ++k) {
    for (std::size_t at = k * all.size() / wanted; at < (k + 1) * all.size() / wanted; ++at) {
      const raster::Source::Window w = node_window(plan, all[at], lattice.cell_units(top));
      auto read = source.sample(lattice, w.west, w.south, static_cast<std::int32_t>(w.east - w.west + 1), static_cast<std::int32_t>(w.north - w.south + 1));
      if (!read.ok()) return read.problem();
      if (stop) return proto::Problem{"cancelled", "the build was cancelled", "", ""};
      const auto valid = std::count_if(read->height.begin(), read->height.end(), [](std::int32_t h) { return h != proto::kNoHeight; });
      if (valid == 0) continue;
      roots.push_back(all[at]);
      samples.push_back(std::move(*read));
      break;
    }
  }
  return {};
}

std::vector<std::pair<std::size_t, PreparedTile>> Pilot::prepare(int z, const Tiles& children) const {
  std::vector<std::pair<std::size_t, PreparedTile>> prepared;
  for (std::size_t r = 0; r < roots.size(); ++r) {
    const LevelContext here = context(z, r);
    for (const proto::TileAddress& tile : touched_tiles(plan, z, roots[r])) {
      std::optional<PreparedTile> one;
      if (z == lattice.finest_level) {
        one = prepare_finest(here, tile);
      } else {
        std::array<const BuiltTile*, 4> below{};
        for (int c = 0; c < 4; ++c) {
          const auto found = children.find(tile.child(c));
          if (found != children.end()) below[static_cast<std::size_t>(c)] = &found->second;
        }
        one = prepare_parent(here, tile, below);
      }
      if (one) prepared.emplace_back(r, std::move(*one));
    }
  }
  return prepared;
}

Tiles Pilot::simplify(int z, const Tiles& children, double& triangles) const {
  std::vector<std::pair<std::size_t, PreparedTile>> prepared = prepare(z, children);
  std::vector<gpu::SimplifyJob> jobs;
  for (const auto& [r, tile] : prepared) jobs.push_back(tile.job(context(z, r)));
  std::vector<proto::TileMesh> meshes = simplifier.simplify(jobs);
  Tiles tiles;
  triangles = 0;
  for (std::size_t k = 0; k < prepared.size(); ++k) {
    const LevelContext here = context(z, prepared[k].first);
    for (int attempt = 0; !has_its_border(here, prepared[k].second, meshes[k], attempt); ++attempt) {
      const gpu::SimplifyJob again = prepared[k].second.job(here);
      meshes[k] = std::move(simplifier.simplify({&again, 1}).front());
    }
    triangles += static_cast<double>(published_triangles(meshes[k]));
    BuiltTile built;
    built.tile = prepared[k].second.tile;
    built.mesh = std::move(meshes[k]);
    tiles.emplace(built.tile, std::move(built));
  }
  return tiles;
}

}  // namespace

double kept_share(const proto::BuildOptions& options, int levels_up) {
  const int n = options.keep_size();
  if (levels_up < n) return options.keep(levels_up);
  const double last = options.keep(n - 1), ratio = n > 1 ? last / options.keep(n - 2) : last;
  return last * std::pow(ratio, levels_up - (n - 1));
}

proto::Result<void> run_pilot(raster::Source& source, gpu::Simplifier& simplifier, proto::Plan& plan, const std::atomic<bool>& stop) {
  Pilot pilot{source, simplifier, plan, stop};
  if (const auto read = pilot.read(); !read.ok()) return read.problem();
  const int finest = pilot.lattice.finest_level;
  for (std::size_t r = 0; r < pilot.roots.size(); ++r) {
    for (const auto& tile : touched_tiles(plan, finest, pilot.roots[r])) {
      const auto prepared = prepare_finest(pilot.context(finest, r), tile);
      if (prepared) pilot.grid_triangles += static_cast<double>(published_triangles(prepared->input));
    }
  }
  Tiles below;
  double target = plan.levels(0).target() / 16, growth = 2;
  for (int z = finest; z >= static_cast<int>(plan.min_level()); --z) {
    proto::LevelPlan& level = pilot.level(z);
    if (z < pilot.top || pilot.grid_triangles == 0) {
      target = std::min(target * growth, greatest_target_m(plan, z));  // above the sample: as the last level grew
      level.set_target(target);
      derive_level(plan, level);
      continue;
    }
    const double wanted = kept_share(plan.options(), finest - z) * pilot.grid_triangles;
    double low = 0, high = 0, guess = z == finest ? target : target * growth;
    Tiles best;
    for (int step = 0; step < kSteps; ++step) {
      if (stop) return proto::Problem{"cancelled", "the build was cancelled", "", ""};
      guess = std::min(guess, greatest_target_m(plan, z));
      level.set_target(guess);
      derive_level(plan, level);
      double triangles = 0;
      best = pilot.simplify(z, below, triangles);
      if (std::abs(triangles / wanted - 1) < kCloseEnough) break;
      // Rims and chains need what they need: a share below that is not to be had.
      if (triangles > wanted && guess >= greatest_target_m(plan, z)) break;
      (triangles > wanted ? low : high) = guess;
      guess = low == 0 ? guess / 4 : high == 0 ? guess * 4 : std::sqrt(low * high);
    }
    if (z < finest) growth = std::clamp(level.target() / target, 1.0, 8.0);
    target = level.target();
    below = std::move(best);
  }
  return {};
}

}  // namespace cordillera::pipeline
