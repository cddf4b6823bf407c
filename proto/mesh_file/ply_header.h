#pragma once
// The header of a PLY: which elements there are, in which order, and what each row of them holds.
#include <optional>
#include <string>
#include <vector>

#include "proto/mesh_file/mesh_file.h"
#include "proto/mesh_file/mesh_source.h"

namespace cordillera::proto {

enum class PlyType { int8, uint8, int16, uint16, int32, uint32, float32, float64 };

std::size_t size_of(PlyType type);
inline bool is_whole(PlyType type) { return type < PlyType::float32; }

/// What a property is to us.
enum class PlyRole { skipped, x, y, z, corners };

struct PlyProperty {
  std::optional<PlyType> count;  ///< of a list: the type of its length
  PlyType type = PlyType::float32;
  PlyRole role = PlyRole::skipped;
};

struct PlyElement {
  std::string name;
  std::uint64_t count = 0;
  std::vector<PlyProperty> properties;  ///< in the order of a row
};

struct PlyHeader {
  MeshFormat format = MeshFormat::ply_ascii;
  std::vector<PlyElement> elements;  ///< in the order of the file
  std::uint64_t vertices = 0;
  std::uint64_t triangles = 0;
  CoordinateType coordinates = CoordinateType::float32;  ///< float64 if float32 does not hold what x, y and z are
};

/// Reads up to the line end_header and past it.
Result<PlyHeader> read_ply_header(MeshSource& source);

}  // namespace cordillera::proto
