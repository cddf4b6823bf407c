#pragma once
// From a finished tile mesh to the bytes a client fetches.
#include <array>
#include <cmath>
#include <cstdint>
#include <map>
#include <string>
#include <string_view>

#include "cordillera.pb.h"
#include "gpu/measure/ecef_steps.h"
#include "proto/ellipsoid.h"
#include "proto/lattice.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// Hang from the sides of a .glb.
struct Skirts {
  double depth_m = 0;          ///< 0: no skirts
  double floor_m = -INFINITY;  ///< above the ellipsoid; no skirt hangs lower
};

/// What a .glb says of how light falls on it.
enum class Normals : std::uint8_t {
  vertex,   ///< a normal a vertex, of the triangles around it
  none,     ///< nothing: clients make flat triangles of it
  texture,  ///< up and east a vertex, and a picture of the terrain's normals in that frame
};
/// What the triangles of all tiles of a level add up to at vertices of a tile's sides, by column and row from its south-west
/// corner. Where a neighbour is not to count, there is none.
using SideNormals = std::map<std::array<std::int32_t, 2>, proto::Vec3>;
struct Shading {
  Normals normals = Normals::vertex;
  const SideNormals* sides = nullptr;  ///< with Normals::vertex; null: no neighbour is to count
  std::string_view picture{};          ///< with Normals::texture: WebP, kNormalMapSide pixels a side; not copied
  std::string_view photo{};            ///< the colours of the ground: WebP, photo_side pixels a side; empty: kGround everywhere
  std::uint32_t photo_side = 0;

  /// Whether vertices say where in a picture they are.
  bool has_places() const { return normals == Normals::texture || !photo.empty(); }
};
/// Dry grass and rock, red, green and blue, linear; lit by whatever light the viewer has, from above only.
inline constexpr std::array<double, 3> kGround = {0.47, 0.43, 0.33};
/// Pixels of a normal map a side: one at each vertex of the level's own lattice, so its outer rows and columns lie on the tile's
/// sides, as those of a photo do.
inline constexpr std::uint32_t kNormalMapSide = proto::kTileCells + 1;

struct PublishedMesh;

struct EncodeInput {
  const proto::Lattice* lattice = nullptr;
  proto::TileAddress tile;
  const proto::TileMesh* mesh = nullptr;  ///< whole rectangle; only triangles without a void corner are encoded
  gpu::EcefSteps ecef_steps;              ///< of .glb positions
  std::int32_t height_step = 1;           ///< in kHeightStep_m; the mesh's heights are multiples of it
  Skirts skirts;
  Shading shading;
  double geometric_error_m = 0;
  std::string title;  ///< of the dataset, if it was given one
  std::string attribution;
};

/// published: of the input's mesh, here and below.
///
/// Draco mesh, lossless: POSITION is int32 (u, v, h): tile-local units from the south-west and steps of the level's height step.
/// Metadata: z, x, y, side (units a tile side), height_step. The formula:
///   lon = -180 + (x + u / side) * 180 / 2^z,  lat = -90 + (y + v / side) * 180 / 2^z,  height = h * height_step
std::string encode_drc(const EncodeInput& input, const PublishedMesh& published);

/// glTF 2.0 binary, KHR_draco_mesh_compression; ECEF positions rounded to ecef_steps, relative to a translation
/// that is itself a multiple of them, the glTF y-up rotation excepted; what the shading asks for; skirts, where data reaches a
/// side of the tile, as a primitive of their own. Vertices where two rims touch are split, so every primitive is a manifold.
std::string encode_glb(const EncodeInput& input, const PublishedMesh& published);
// Both give an empty string when the tile has no published triangle. The second throws std::invalid_argument when the points with
// the finest step span more than 2^23 of it, or others twice as many of theirs.

/// For TileRecord::region: west, south, east, north (radians), lowest, highest (metres). Contains every decoded .glb point,
/// skirts too, and all triangles between them: chords sag and bulge poleward. Longitudes are clamped to [-pi, pi]. Not for empty
/// tiles.
std::array<double, 6> tile_region(const EncodeInput& input, const PublishedMesh& published);

/// Goes into the manifest as drc_formula.
inline constexpr const char* kDrcFormula =
    "lon = -180 + (x + u / side) * 180 / 2^z, lat = -90 + (y + v / side) * 180 / 2^z, height = h * height_step";

}  // namespace cordillera::pipeline
