#pragma once
// Tiles of one level welded into one mesh, for programs that know no tiles.
#include <string>

#include "pipeline/exports/mesh/mesh_request.h"
#include "pipeline/progress/teller.h"
#include "proto/ellipsoid.h"
#include "proto/mesh_file/triangle_mesh.h"

namespace cordillera::pipeline::exports {

/// What a map's coordinates are.
struct MapWords {
  std::string code;   ///< "EPSG:32632"
  std::string label;  ///< "WGS 84 / UTM zone 32N (EPSG:32632)"
  std::string unit;   ///< "metre"
  std::string geoid;  ///< that heights are above
};

struct ExtractedMesh {
  proto::TriangleMesh mesh;  ///< counter-clockwise seen from above; a manifold: rims that touch have vertices of their own
  int level = 0;
  MeshFrame frame = MeshFrame::enu;
  double longitude_deg = 0, latitude_deg = 0;  ///< the point of the ellipsoid in the middle, a vertex of the lattice
  proto::Vec3 origin_m;                        ///< the same, earth-centred
  MapWords map;                                ///< in frame map alone
};

/// Tiles that touch share their vertices: they are found as equal integers, so nothing is moved and nothing is doubled. A box
/// cuts the triangles it crosses; what the cut adds lies on the triangles' flat surface. A pole's row is one vertex, but in
/// geodetic coordinates. Problems beside those of the request: of a map, as raster::MapProjection::open has them, and
/// "crs-unsupported" where it tears the mesh or turns parts of it over; without a geoid.
/// progress: called by the caller's thread; may be empty.
proto::Result<ExtractedMesh> extract_mesh(const faces::Terrain& terrain, const MeshRequest& request,
                                          const ProgressCallback& progress = {});

}  // namespace cordillera::pipeline::exports
