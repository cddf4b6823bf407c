#pragma once
// A tiling scheme as meshes of integers: what the makers of quantized-mesh ask of it. Its tiles count y from the south, and 0 has
// all the coarsest.
#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "pipeline/faces/quantized_mesh/quantized_mesh_grid.h"
#include "pipeline/faces/terrain.h"
#include "pipeline/store/water_mask.h"
#include "proto/ellipsoid.h"

namespace cordillera::pipeline::faces {

/// First and last columns and rows of some tiles of a z; both ends belong to it.
struct TileRange {
  std::int32_t start_x = 0, start_y = 0, end_x = 0, end_y = 0;
};

/// A tile's rectangle, radians. Positions in it are shares of its longitudes and latitudes.
struct TileAngles {
  double west = 0, south = 0, width = 0, height = 0;
};

TileAngles geodetic_angles(const proto::TileAddress& tile);

/// May remember what it made: an object a thread.
class MeshGrid {
 public:
  using Units = std::array<std::int32_t, 2>;  ///< 0 to side(z), from a tile's south-west

  explicit MeshGrid(const Terrain& terrain) : terrain_(terrain) {}
  virtual ~MeshGrid() = default;
  MeshGrid(const MeshGrid&) = delete;
  MeshGrid& operator=(const MeshGrid&) = delete;
  const Terrain& terrain() const { return terrain_; }

  virtual int finest() const = 0;
  virtual int level(int z) const = 0;  ///< whose meshes a z shows
  virtual QuantizedLevel quantized(int z) const { return quantized_level(terrain_.manifest(), level(z)); }
  virtual std::int32_t across(int z) const = 0;
  virtual std::int32_t up(int z) const = 0;
  virtual std::int32_t side(int z) const = 0;

  /// In units; null where there is none. Neighbours have the same vertices on their common side.
  virtual std::shared_ptr<const MeshIndex> mesh(const proto::TileAddress& tile) const = 0;
  /// Normals of that mesh's vertices, of length one and earth-centred; neighbours agree about those on their common side.
  virtual std::vector<proto::Vec3> normals(const proto::TileAddress& tile) const = 0;
  virtual TileAngles angles(const proto::TileAddress& tile) const = 0;

  /// Height beside the data: sea level or, where the level has no meshes, that of the coarsest that are there.
  virtual double beside_m(const proto::TileAddress& tile, const Units& units, const QuantizedLevel& level) const = 0;
  virtual proto::Vec3 up_at(const proto::TileAddress& tile, const Units& units) const = 0;

  /// Only of datasets that say where water is.
  virtual WaterPixels water(const proto::TileAddress& tile) const = 0;

  /// Nodes of the dataset under some tiles; x counts columns of the z.
  struct Under {
    std::int32_t x = 0;
  };
  virtual std::vector<Under> under(int z, const TileRange& range) const = 0;
  /// Rows, whole and parts, from the grid's southern end to a latitude.
  virtual double rows_to(int z, double latitude_deg) const = 0;

 private:
  const Terrain& terrain_;
};

/// The tiles that the dataset stands on: two at 0.
class GeodeticGrid final : public MeshGrid {
 public:
  explicit GeodeticGrid(const Terrain& terrain);
  int finest() const override;
  int level(int z) const override { return z; }
  std::int32_t across(int z) const override { return proto::tiles_across(z); }
  std::int32_t up(int z) const override { return proto::tiles_up(z); }
  std::int32_t side(int z) const override;
  std::shared_ptr<const MeshIndex> mesh(const proto::TileAddress& tile) const override { return terrain().mesh(tile); }
  std::vector<proto::Vec3> normals(const proto::TileAddress& tile) const override;
  TileAngles angles(const proto::TileAddress& tile) const override { return geodetic_angles(tile); }
  double beside_m(const proto::TileAddress& tile, const Units& units, const QuantizedLevel& level) const override;
  proto::Vec3 up_at(const proto::TileAddress& tile, const Units& units) const override;
  WaterPixels water(const proto::TileAddress& tile) const override { return unpack_water(terrain().store().water(tile)); }
  std::vector<Under> under(int z, const TileRange& range) const override;
  double rows_to(int z, double latitude_deg) const override;

 private:
  proto::Lattice lattice_;
};

}  // namespace cordillera::pipeline::faces
