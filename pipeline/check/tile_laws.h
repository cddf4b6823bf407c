#pragma once
// What one tile must be by itself: decodable both ways, where it says it is, a manifold of triangles with area, inside its
// region.
#include <array>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "cordillera.pb.h"
#include "gpu/measure/ecef_steps.h"
#include "pipeline/check/report.h"
#include "pipeline/encode/decode.h"
#include "pipeline/store/store.h"
#include "proto/ellipsoid.h"
#include "proto/lattice.h"

namespace cordillera::pipeline::check {

struct TileBytes {
  proto::TileAddress tile;
  int finest_level = 0;
  std::string_view drc, glb;
  const proto::TileRecord* record = nullptr;  ///< null: a static folder has none
  gpu::EcefSteps ecef_steps;                  ///< of the .glb; 0: unknown, then both faces are not compared
  double height_step_m = 0;                   ///< of the .drc; 0: unknown
};

/// A published edge on a side of its tile, from < to in units along the side.
struct SideEdge {
  std::int32_t from = 0, to = 0;
  std::int32_t from_height = 0, to_height = 0;
  proto::Vec3 from_point, to_point;  ///< as the .glb has them
};

enum TileSide { kWest, kEast, kSouth, kNorth };

struct CheckedTile {
  proto::TileAddress tile;
  DecodedDrc drc;
  std::array<std::vector<SideEdge>, 4> sides;  ///< indexed by TileSide, sorted
};

/// Adds what is wrong. None if the tile cannot be decoded or is not what it says.
std::optional<CheckedTile> check_tile(const TileBytes& bytes, Findings& findings);

}  // namespace cordillera::pipeline::check
