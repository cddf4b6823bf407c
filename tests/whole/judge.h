#pragma once
// The laws on every tile of every level of a built dataset. Each function returns what it found wrong, in words, or nothing.
#include <cstdint>
#include <string>
#include <vector>

#include "tests/whole/built.h"

namespace cordillera::whole {

using Findings = std::vector<std::string>;

/// Law 1: tiles of a level that touch share every vertex of their common border, in .drc and in .glb.
Findings judge_neighbours(const Built& built);

/// Law 2: positive area, no overlap, manifold, valence; full cover where every sample of the tile has data; and no published
/// vertex stands where there is no data.
Findings judge_plans(const Built& built);

/// Law 3: both faces, measured anew, deviate no more than the tile states (and the level's target where error= was given); tiles
/// with data throughout leave no sample unseen.
struct ErrorRules {
  std::int64_t samples_a_tile = 70000;  ///< at most, by striding
  double slack = 0;  ///< > 0: at the finest level a stated error is at most this times the measured one, and a bit
};
/// Every sample of a tile.
inline constexpr ErrorRules kAllSamples{70000, 1.25};
Findings judge_errors(const Built& built, const ErrorRules& rules);

/// Law 4: a sample farther than one cell of the level, in columns or in rows, from where there is no data lies under a triangle
/// of each tile that it belongs to, on every level.
Findings judge_cover(const Built& built);

/// All of these, and a tile on every level.
Findings judge(const Built& built, const ErrorRules& rules);

}  // namespace cordillera::whole
