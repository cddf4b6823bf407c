#pragma once
// What each quality does, in numbers. The README tells what each of them brought.
#include <algorithm>
#include <cstdint>

#include "gpu/fit/simplify_height_mesh.h"
#include "gpu/fit/steps/relocate.h"

namespace cordillera::gpu::fit {

/// Of what the cost of a collapse is the squared distance: the planes of the triangles as they are (memoryless), those of the
/// input that a vertex has come to stand for, or the samples.
enum class CostOf : std::uint8_t { planes, carried_planes, samples };

struct CollapseRules {
  double pool = 0.25;  ///< this share of the vertices are candidates
  int rounds = 3;      ///< of locks for one evaluation
  bool polish = true;  ///< fit a vertex to its samples as soon as it is made
  CostOf cost = CostOf::planes;
  ErrorLimit limit;
  bool has_planes = false;  ///< those of earlier waves are to be carried on
  double first_look = 1;    ///< costs from samples: for this share, cheapest by the planes; the others wait until they are due
};

struct Recipe {
  double drop_to = 0;  ///< down to so many times the target, vertices are dropped onto neighbours; 0: never
  CollapseRules waves;
  double pool_after_drops = 0.25;  ///< little is left to do then, and it shows
  double late_from = 0;            ///< below so many times the target, costs come from the samples; 0: never
  double late_pool = 0.1;
  int sweeps = 3;
  int flip_rounds = 3;  ///< of every flip pass
  int exchanges = 2;
  double exchange_share = 0.02;  ///< of the triangles
  double exchange_pool = 0.02, exchange_look = 0.2;
  int exchange_sweeps = 1;
  bool lower_maximum = false;  ///< sweeps by a high power of the error at the end
};

inline Recipe recipe_of(Quality quality) {
  Recipe recipe;
  switch (quality) {
    case Quality::fast:
      recipe.waves = {0.5, 3, false, CostOf::carried_planes, {}, false, 1};
      recipe.drop_to = 1.7;
      recipe.sweeps = recipe.exchanges = 0;
      break;
    case Quality::default_: break;
    case Quality::minimax: recipe.lower_maximum = true; [[fallthrough]];
    case Quality::best:
      recipe.waves.pool = 0.1;
      recipe.waves.rounds = 6;
      recipe.late_from = 2;
      recipe.sweeps = 4;
      recipe.exchanges = 4;
      recipe.exchange_sweeps = 3;
      recipe.exchange_share = 0.04;
      break;
  }
  return recipe;
}

/// Checks alone: the mesh stays as it is.
inline Recipe recipe_of_nothing() {
  Recipe recipe;
  recipe.sweeps = recipe.exchanges = 0;
  return recipe;
}

/// Where vertices are scattered, there are many where each of them matters. As long as a quarter stays, costs come from the
/// samples, in less than twice the time: half to a fifth of the RMSE on a mesh that was simplified before.
inline void spare_scattered(Recipe& recipe, double keep) {
  constexpr double kMany = 0.25;
  if (keep > kMany && recipe.waves.cost == CostOf::planes) recipe.late_from = std::max(recipe.late_from, 2.0);
}

}  // namespace cordillera::gpu::fit
