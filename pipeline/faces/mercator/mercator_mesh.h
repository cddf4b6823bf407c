#pragma once
// The triangles of a dataset under a tile of WebMercatorQuad, cut at its parallels. Its meridians are those of the dataset's own
// tiles, so nothing is cut there.
#include <algorithm>
#include <cstdint>
#include <vector>

#include "pipeline/faces/terrain.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {

/// The level whose meshes a zoom shows. Its tiles are as wide as the zoom's, but for zoom 0, which has both tiles of level 0.
inline int mercator_level(int zoom) { return zoom > 0 ? zoom - 1 : 0; }
/// Finest zoom of a dataset's meshes.
inline int finest_mercator_zoom(const proto::Manifest& manifest) {
  return std::min(static_cast<int>(manifest.max_level()) + 1, proto::kMaxLevel);
}

/// Latitude of the parallel below the tiles of row y of a zoom, counted from the south; y up to 2^zoom.
double mercator_latitude_deg(int zoom, std::int32_t y);

struct MercatorMesh {
  struct Vertex {
    double column = 0;        ///< cells of the finest lattice from the tile's western side
    double row = 0;           ///< of the same, from the south pole
    std::int32_t height = 0;  ///< steps of the .drc
    proto::Vec3 normal;       ///< unit; only if asked for
  };
  std::vector<Vertex> vertices;
  std::vector<Triangle> triangles;
  double columns = 0;           ///< of the finest lattice across the tile
  double south = 0, north = 0;  ///< its rows
};

enum class MercatorNormals : std::uint8_t { none, all };

/// Empty where the dataset has nothing. What lies on a parallel is a function of the cut edges alone: both tiles there have the
/// same bits. tile: y from the south.
MercatorMesh mercator_mesh(const Terrain& terrain, const proto::TileAddress& tile, MercatorNormals normals);

/// What latitudes become in the integers of a tile.
enum class MercatorRows : std::uint8_t {
  latitude,  ///< shares of the tile's latitudes: straight lines stay straight
  map,       ///< shares of the tile's height on the map
};

struct MercatorLattice {
  LatticeMesh mesh;                   ///< in units of side, from the south-west; without an address
  std::vector<std::uint32_t> source;  ///< vertex of the MercatorMesh, indexed by the lattice's
};
/// Whole numbers of units, at least as many a side as the finest lattice has cells there. What is not on a side is kept off it.
MercatorLattice on_lattice(const MercatorMesh& mesh, const proto::TileAddress& tile, MercatorRows rows, std::int32_t side);

/// Units a side of a zoom's tiles: `least`, a power of two, unless the finest lattice has more cells there.
std::int32_t mercator_side(const Terrain& terrain, int zoom, std::int32_t least);

}  // namespace cordillera::pipeline::faces
