#include "pipeline/build/pilot.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "pipeline/build/build.h"
#include "pipeline/plan/plan.h"
#include "pipeline/tile/tile_mesh.h"

namespace cordillera::pipeline {
namespace {

constexpr std::size_t kSubtrees = 4;     // sample sub-trees of a dataset that is too large to be its own sample
constexpr int kSubtreeLevels = 2;        // 4 x 4 finest tiles each
constexpr std::size_t kWholeTiles = 64;  // a dataset of so few finest tiles is its own sample
constexpr int kSteps = 9;                // of a bisection that starts from a factor of 64
constexpr double kCloseEnough = 0.01;    // relative to the share

std::size_t published_triangles(const proto::TileMesh& mesh) {
  return static_cast<std::size_t>(
      std::count_if(mesh.triangles.begin(), mesh.triangles.end(), [&](const auto& t) { return is_published(mesh, t); }));
}

/// A tile of the sample, and the sub-tree that it is in.
struct SampledTile {
  std::size_t root = 0;
  proto::TileAddress tile;
};

struct Pilot {
  Builder& builder;
  proto::Plan& plan;
  const std::atomic<bool>& stop;
  proto::Lattice lattice = lattice_of(plan);
  int top = 0;  ///< coarsest level the sample reaches
  std::vector<proto::TileAddress> roots{};
  std::vector<proto::Samples> samples{};  ///< indexed as roots
  double grid_triangles = 0;

  proto::Result<void> read();
  void count_grid();
  std::vector<SampledTile> places(int z) const;
  LevelContext context(int z, std::size_t root) const { return {&lattice, &level_plan(plan, z), false, &samples[root], false}; }
  Tiles simplify(int z, const Tiles& below, double& triangles) const;
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
      auto read = builder.read(all[at]);
      if (!read.ok()) return read.problem();
      if (stop) return kCancelled;
      if (read->all_void()) continue;
      roots.push_back(all[at]);
      samples.push_back(std::move(*read));
      break;
    }
  }
  return {};
}

std::vector<SampledTile> Pilot::places(int z) const {
  std::vector<SampledTile> places;
  for (std::size_t r = 0; r < roots.size(); ++r) {
    for (const proto::TileAddress& tile : touched_tiles(plan, z, roots[r])) places.push_back({r, tile});
  }
  return places;
}

void Pilot::count_grid() {
  for (const auto& [root, tile] : places(lattice.finest_level)) {
    const auto prepared = prepare_finest(context(lattice.finest_level, root), tile);
    if (prepared) grid_triangles += static_cast<double>(published_triangles(prepared->input));
  }
}

Tiles Pilot::simplify(int z, const Tiles& below, double& triangles) const {
  const std::vector<SampledTile> at = places(z);
  const bool finest = z == lattice.finest_level;
  std::vector<BuiltTile> built =
      builder.tiles().simplify({&lattice, &level_plan(plan, z), false, nullptr, false}, at.size(), [&](std::size_t k) {
        const LevelContext here = context(z, at[k].root);
        return finest ? prepare_finest(here, at[k].tile) : prepare_parent(here, at[k].tile, children_of(at[k].tile, below));
      });
  Tiles tiles;
  triangles = 0;
  for (BuiltTile& tile : built) {
    triangles += static_cast<double>(published_triangles(tile.mesh));
    tiles.emplace(tile.tile, std::move(tile));
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

proto::Result<void> run_pilot(Builder& builder, proto::Plan& plan, const std::atomic<bool>& stop) {
  Pilot pilot{builder, plan, stop};
  if (const auto read = pilot.read(); !read.ok()) return read.problem();
  pilot.count_grid();
  const int finest = pilot.lattice.finest_level;
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
      guess = std::min(guess, greatest_target_m(plan, z));
      level.set_target(guess);
      derive_level(plan, level);
      double triangles = 0;
      best = pilot.simplify(z, below, triangles);
      if (stop) return kCancelled;
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
