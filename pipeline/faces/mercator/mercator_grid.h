#pragma once
// WebMercatorQuad as a grid of meshes. Positions in a tile are shares of its longitudes and latitudes, as quantized-mesh has them
// in every projection, so the surface is the one of the dataset's own tiles.
#include <map>
#include <memory>

#include "pipeline/faces/mercator/mercator_mesh.h"
#include "pipeline/faces/quantized_mesh/mesh_grid.h"

namespace cordillera::pipeline::faces {

/// Remembers what it cut.
class MercatorGrid final : public MeshGrid {
 public:
  explicit MercatorGrid(const Terrain& terrain) : MeshGrid(terrain) {}
  int finest() const override { return finest_mercator_zoom(terrain().manifest()); }
  int level(int z) const override { return mercator_level(z); }
  /// Edges sag between their ends, by no more than the level's error where that is a true one.
  QuantizedLevel quantized(int z) const override;
  std::int32_t across(int z) const override { return std::int32_t{1} << z; }
  std::int32_t up(int z) const override { return std::int32_t{1} << z; }
  std::int32_t side(int z) const override;
  std::shared_ptr<const MeshIndex> mesh(const proto::TileAddress& tile) const override;
  std::vector<proto::Vec3> normals(const proto::TileAddress& tile) const override;
  TileAngles angles(const proto::TileAddress& tile) const override;
  double beside_m(const proto::TileAddress& tile, const Units& units, const QuantizedLevel& level) const override;
  proto::Vec3 up_at(const proto::TileAddress& tile, const Units& units) const override;
  WaterPixels water(const proto::TileAddress& tile) const override;
  std::vector<Under> under(int z, const TileRange& range) const override;
  double rows_to(int z, double latitude_deg) const override;

 private:
  struct Place {
    double longitude_deg = 0, latitude_deg = 0;
  };
  Place place(const proto::TileAddress& tile, const Units& units) const;
  mutable std::map<proto::TileAddress, std::shared_ptr<const MeshIndex>> meshes_;
};

}  // namespace cordillera::pipeline::faces
