#pragma once
// Square meshes side by side as one, and one cut into squares.
#include <array>
#include <cstdint>
#include <functional>
#include <vector>

#include "gpu/exact/simplify_block.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// So many squares a way, each of so many samples from side to side.
struct MeshSquares {
  std::int32_t across = 0, up = 0, side = 0;
  /// By column and row from the south-west; also of squares beside the rectangle. Null: nobody has one.
  std::function<const proto::TileMesh*(std::int32_t column, std::int32_t row)> at;
};
/// All of them. Where nobody has one, void triangles fit the sides of its neighbours; between two such ones, and beside what is
/// not known, there are vertices at a 32nd of a side, as blocks have where there is no data. Throws logic_error where two meshes
/// differ on their common side.
gpu::exact::BlockMesh joined_mesh(const MeshSquares& squares);

/// Cuts parts out of a mesh, one after the other. Borrows it.
class MeshParts {
 public:
  explicit MeshParts(const gpu::exact::BlockMesh& mesh);
  /// That these triangles have, each once, as they come.
  std::vector<std::uint32_t> vertices_of(const std::vector<std::uint32_t>& triangles);
  /// Of these triangles and their vertices, in this order, moved by (dx, dy). Its side is left to the caller.
  proto::TileMesh part(const std::vector<std::uint32_t>& vertices, const std::vector<std::uint32_t>& triangles, std::int64_t dx,
                       std::int64_t dy);

 private:
  const gpu::exact::BlockMesh& mesh_;
  std::vector<std::uint32_t> number_;  ///< in the part; indexed by the mesh's vertices, between parts that of none
};

/// Squares of a mesh that has no triangle across their sides, by rows from the south-west. Those that are void throughout have
/// no vertex.
std::vector<proto::TileMesh> cut_mesh(const gpu::exact::BlockMesh& mesh, std::int32_t across, std::int32_t up, std::int32_t side);

}  // namespace cordillera::pipeline
