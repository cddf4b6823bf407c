#pragma once
// Which part of a dataset is wanted as one mesh, and where that part lies on the lattice.
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "pipeline/faces/terrain.h"
#include "proto/lattice.h"
#include "raster/place/area.h"

namespace cordillera::pipeline::exports {

/// What coordinates count.
enum class MeshFrame : std::uint8_t {
  enu,       ///< metres east, north and up of a point of the ellipsoid in the middle
  ecef,      ///< metres, earth-centred (EPSG:4978)
  geodetic,  ///< degrees east, degrees north, metres above the ellipsoid (EPSG:4979, longitude first); over the antimeridian
             ///< beyond 180
  map,       ///< east and north of a projected CRS, height above the geoid (Terrain::geoid_name), all in the CRS's unit
};

/// So far from zero that 32-bit floats count from a translation.
inline bool is_far(MeshFrame frame) { return frame == MeshFrame::ecef || frame == MeshFrame::map; }

struct MeshRequest {
  std::optional<proto::TileAddress> tile;  ///< this tile alone; no level and no box then
  std::optional<int> level;                ///< none: the finest that stays within most_triangles
  std::optional<raster::Area> box;         ///< none: everywhere
  MeshFrame frame = MeshFrame::enu;
  std::string map;  ///< the code of frame map's CRS, such as EPSG:32632; empty: the raster's own
  std::uint64_t most_triangles = 10'000'000;
};

/// A rectangle of a level. Columns run eastward without a jump: over the antimeridian they go on beyond the circle.
struct MeshWindow {
  int level = 0;
  std::int64_t x0 = 0, x1 = 0;  ///< tiles, inclusive
  std::int32_t y0 = 0, y1 = 0;
  bool clipped = false;                             ///< triangles are cut at the sides below
  double west = 0, south = 0, east = 0, north = 0;  ///< units of the finest lattice
};
MeshWindow window_of(const faces::Terrain& terrain, const MeshRequest& request, int level);

/// Every tile of the window that has triangles, rows from the south, columns from the west, until visit says false. x is the
/// column that does not jump.
void each_tile(const faces::Terrain& terrain, const MeshWindow& window,
               const std::function<bool(const proto::TileRecord& record, std::int64_t x)>& visit);

/// About how many triangles lie in the window, as if each tile's were spread evenly; no more than twice the limit is counted.
double triangles_in(const faces::Terrain& terrain, const MeshWindow& window, std::uint64_t limit);

}  // namespace cordillera::pipeline::exports
