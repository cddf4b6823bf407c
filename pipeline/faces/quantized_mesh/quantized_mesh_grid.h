#pragma once
// The numbers of a quantized-mesh level: positions in 32767ths of a tile, heights in one step for all its tiles, so that
// neighbours agree.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>

#include "pipeline/faces/terrain.h"

namespace cordillera::pipeline::faces {

/// Positions along a tile's side run from 0 to this.
inline constexpr std::int32_t kMostQuanta = 32767;

struct QuantizedLevel {
  int z = 0;
  double step_m = 0;           ///< of heights; a power of two
  std::int32_t sea_cells = 1;  ///< what lies beside the data is a grid of so many cells a side; a power of two
  bool stored = false;         ///< false below the dataset's coarsest level: there is no mesh, only heights on that grid
  double low_m = -INFINITY, high_m = INFINITY;  ///< what heights are held to
};
/// room_m: for heights beyond those of the level's vertices; they are held to it. 0: there are none.
QuantizedLevel quantized_level(const proto::Manifest& manifest, int z, double room_m = 0);

/// The nearest quantum of a position in [0, side] that keeps off the sides what is not on them: nothing else may become a vertex
/// of a side, or of a corner.
inline std::int32_t quanta(std::int32_t units, std::int32_t side) {
  const auto nearest = static_cast<std::int32_t>((std::int64_t{units} * kMostQuanta * 2 + side) / (std::int64_t{side} * 2));
  return units == 0 || units == side ? nearest : std::clamp(nearest, 1, kMostQuanta - 1);
}

/// Sea level, metres above the ellipsoid: the geoid's height, 0 where no geoid grid is installed. Within kSea_m of the ellipsoid.
double sea_level_m(const Terrain& terrain, double longitude_deg, double latitude_deg);
inline constexpr double kSea_m = 112;  // no geoid is farther away

/// Height of a level's mesh at a vertex of the finest lattice, between its vertices in plan as clients interpolate; none beside
/// the data. Columns wrap.
std::optional<double> plan_height_m(const Terrain& terrain, int level, std::int64_t column, std::int64_t row);

}  // namespace cordillera::pipeline::faces
