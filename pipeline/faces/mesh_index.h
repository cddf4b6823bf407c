#pragma once
// A tile's decoded mesh that can be asked which triangle is over a place.
#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "pipeline/encode/draco_mesh.h"
#include "proto/ellipsoid.h"
#include "proto/lattice.h"

namespace cordillera::pipeline::faces {

/// Immutable, so thread-safe.
class MeshIndex {
 public:
  explicit MeshIndex(LatticeMesh mesh);

  const LatticeMesh& mesh() const { return mesh_; }
  proto::TileAddress tile() const { return {mesh_.z, mesh_.x, mesh_.y}; }
  /// Of everything that it holds, for a cache's account.
  std::size_t bytes() const;

  /// Triangles that a question looks at, at worst.
  std::size_t most_in_a_cell() const;

  /// Triangle over a place in the tile's units from its south-west; of two that share it, the first. None beside the data.
  std::optional<std::uint32_t> triangle_at(double u, double v) const;

  /// Where the ellipsoid's normal at the place meets the flat earth-centred triangle over it, metres above the ellipsoid.
  std::optional<double> height_m(double longitude_deg, double latitude_deg) const;

 private:
  /// What the cells of a row, or of a column, cover: units of the tile.
  struct Axis {
    double first = 0, length = 1;
    std::int32_t cell_of(double units, std::int32_t cells) const;
  };
  double height_of_nearest_m(double longitude_deg, double latitude_deg, std::uint32_t below) const;

  LatticeMesh mesh_;
  std::int32_t cells_ = 1;                // a side
  std::array<Axis, 2> axes_;              // from the west, from the south
  std::vector<std::uint32_t> first_;      // indexed by cell: where its triangles begin
  std::vector<std::uint32_t> triangles_;  // by cell
};

}  // namespace cordillera::pipeline::faces
