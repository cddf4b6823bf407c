#include "pipeline/faces/quantized_mesh/mesh_grid.h"

#include <cmath>
#include <numbers>

#include "pipeline/faces/mesh_normals.h"

namespace cordillera::pipeline::faces {

TileAngles geodetic_angles(const proto::TileAddress& tile) {
  const double side = std::numbers::pi / std::ldexp(1, tile.z);
  return {tile.x * side - std::numbers::pi, tile.y * side - std::numbers::pi / 2, side, side};
}

GeodeticGrid::GeodeticGrid(const Terrain& terrain) : MeshGrid(terrain), lattice_(terrain.lattice()) {}

int GeodeticGrid::finest() const { return lattice_.finest_level; }

std::int32_t GeodeticGrid::side(int z) const { return static_cast<std::int32_t>(lattice_.tile_units(z)); }

std::vector<proto::Vec3> GeodeticGrid::normals(const proto::TileAddress& tile) const {
  return mesh_normals(terrain(), *mesh(tile));
}

double GeodeticGrid::beside_m(const proto::TileAddress& tile, const Units& units, const QuantizedLevel& level) const {
  const std::int64_t column = (lattice_.west(tile) + units[0]) % lattice_.columns(), row = lattice_.south(tile) + units[1];
  if (!level.stored) {
    const auto coarsest = static_cast<int>(terrain().manifest().min_level());
    if (const auto height_m = plan_height_m(terrain(), coarsest, column, row)) return *height_m;
  }
  return sea_level_m(terrain(), lattice_.longitude_deg(column), lattice_.latitude_deg(row));
}

proto::Vec3 GeodeticGrid::up_at(const proto::TileAddress& tile, const Units& units) const {
  return proto::normal(proto::row_frame(lattice_, lattice_.south(tile) + units[1]),
                       proto::column_frame(lattice_, lattice_.west(tile) + units[0]));
}

std::vector<MeshGrid::Under> GeodeticGrid::under(int z, const TileRange& range) const {
  std::vector<Under> out;
  for (const TileExtent& node : terrain().store().extents(z, range.start_x, range.start_y, range.end_x, range.end_y)) {
    out.push_back({node.tile.x});
  }
  return out;
}

double GeodeticGrid::rows_to(int z, double latitude_deg) const { return (latitude_deg + 90) * (proto::tiles_up(z) / 180.0); }

}  // namespace cordillera::pipeline::faces
