#pragma once
// The two kinds of Draco buffer that tiles are made of. The only door to Draco: its headers stay in draco_encode.cpp and
// draco_decode.cpp.
#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pipeline/encode/published_mesh.h"
#include "proto/result.h"

namespace cordillera::pipeline {

/// What a .drc tile holds: integer positions, kept exactly, and where they are.
struct LatticeMesh {
  std::vector<std::array<std::int32_t, 3>> points;  ///< u, v (units from the tile's south-west), h (steps)
  std::vector<Triangle> triangles;
  std::int32_t z = 0, x = 0, y = 0;
  std::int32_t side = 0;      ///< units a tile side
  double height_step = 0;     ///< metres
  bool web_mercator = false;  ///< z, x and y name a tile of WebMercatorQuad, y from the north; v counts along its map
};

/// Positions that are multiples of step; |position / step| < 2^(bits - 1). Those of a few tiles reach beyond that, up to 2^30:
/// where they do, they are multiples of greater steps, of which a float32 holds 2^24.
struct FloatGrid {
  float step = 0;  ///< a power of two
  int bits = 0;    ///< 2 .. kMaxGridBits
};
/// Draco adds 0.5 in float32 before it rounds down: beyond these an odd multiple could come back as its neighbour, an even one
/// does not.
inline constexpr int kMaxGridBits = 23;

/// What a primitive of a .glb tile holds.
struct LitSurface {
  std::vector<std::array<float, 3>> positions;  ///< multiples of the grid's step: they survive exactly
  std::vector<std::array<float, 3>> normals;    ///< unit vectors, quantised; may be empty, as may each of the next two
  std::vector<std::array<float, 4>> tangents;   ///< unit vectors and 1 or -1, quantised
  std::vector<std::array<float, 2>>
      texcoords;  ///< pixel centres of a normal map, and shares of 1 / kPlacesAcross between the outer ones
  std::vector<Triangle> triangles;
};

/// What a .drc's metadata says of tile_matrix_set where the tile is not one of the dataset's own.
inline constexpr const char* kWebMercator = "WebMercatorQuad";

/// Steps of a texture coordinate from one side of a tile to the other: 16 a pixel of a normal map. The sides themselves are
/// steps.
inline constexpr int kPlacesAcross = 4096;

/// Draco's 0 (small) to 10 (quick). Measured on an irregular terrain tile of 8,192 triangles, .drc and .glb: speed 3 saves 7-9 %
/// and takes twice the time to encode and two to three times to decode; 5 and 7 give the same bytes; 10 costs 0-8 % more and
/// saves nothing worth it. tests/bench/drc measures it on whole builds.
inline constexpr int kDracoSpeed = 5;

std::string draco_encode(const LatticeMesh& mesh, int speed = kDracoSpeed);
/// Attributes that are there have the ids 0, 1, … in the order of LitSurface: glTF wants to know them.
std::string draco_encode(const LitSurface& surface, const FloatGrid& grid);

proto::Result<LatticeMesh> draco_decode_lattice(std::string_view bytes);
/// The same surface with heights in kHeightStep_m, as meshes have them. The mesh's own step must be a multiple of it.
LatticeMesh in_mesh_steps(LatticeMesh mesh);
/// As a mesh, in the order of the .drc, no vertex marked. Heights must be in kHeightStep_m.
proto::TileMesh tile_mesh_of(const LatticeMesh& mesh);
proto::Result<LitSurface> draco_decode_lit(std::string_view bytes);

}  // namespace cordillera::pipeline
