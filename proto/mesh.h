#pragma once
// Plain mesh and sample structs that the floors hand to each other. No protobuf here: gpu and its benches build on a bare CUDA
// machine.
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "proto/lattice.h"

namespace cordillera::proto {

/// Heights are fixed point, 2^-10 m: library versions may differ in the last bit of a projection, tiles may not.
inline constexpr double kHeightStep_m = 1.0 / 1024;
/// Heights beyond this are no terrain (sentinels, noise); |height| <= 2^24 steps keeps float32 exact.
inline constexpr double kMaxHeight_m = 16384;
/// The height of an invalid sample in Samples::height.
inline constexpr std::int32_t kNoHeight = INT32_MIN;

/// What is known of a sample beside its height.
enum SampleMark : std::uint8_t {
  kFlatWater = 1,
  kFilledVoid = 2,  ///< the source has no data here
};

/// A window of lattice samples. Row-major, rows from the SOUTH, columns from the WEST; sample (c, r) is lattice vertex
/// (west + c, south + r). Invalid (no data) samples are kNoHeight.
struct Samples {
  std::int64_t west = 0;
  std::int64_t south = 0;
  std::int32_t columns = 0;
  std::int32_t rows = 0;
  std::vector<std::int32_t> height;  ///< columns*rows, kHeightStep_m above the WGS 84 ellipsoid
  std::vector<std::uint8_t>
      flat_water;  ///< columns*rows, SampleMark: 1 where the source is a flat water surface (found before the datum shift)

  std::int32_t at(std::int64_t i, std::int64_t j) const {
    return height[static_cast<std::size_t>((j - south) * columns + (i - west))];
  }
  bool all_void() const {
    return std::all_of(height.begin(), height.end(), [](std::int32_t h) { return h == kNoHeight; });
  }
};

/// Marks of a mesh vertex.
enum VertexMark : std::uint8_t {
  kVoid = 1,  ///< no data here. A triangle exists (is published) if and only if none of its corners is void
  kKeep = 2,  ///< must survive simplification, as do corners and sides of tiles
};

/// A triangulation of one whole tile rectangle, voids included: every point of the rectangle lies in a triangle, so exact
/// positive orientation of all triangles, void ones too, is all that keeps the mesh a manifold and its rims from crossing.
/// Positions are tile-local units, 0..side in both directions, (0, 0) the south-western corner.
struct TileMesh {
  std::int32_t side = 0;                                ///< Lattice::tile_units(z)
  std::vector<std::int32_t> x;                          ///< indexed by vertex
  std::vector<std::int32_t> y;                          ///< indexed by vertex
  std::vector<std::int32_t> height;                     ///< indexed by vertex, kHeightStep_m; 0 where void
  std::vector<std::uint8_t> mark;                       ///< indexed by vertex, VertexMark bits
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from above

  std::size_t vertices() const { return x.size(); }
};

inline bool is_void(const TileMesh& mesh, std::size_t vertex) { return (mesh.mark[vertex] & kVoid) != 0; }
inline bool has_voids(const TileMesh& mesh) {
  return std::any_of(mesh.mark.begin(), mesh.mark.end(), [](std::uint8_t mark) { return (mark & kVoid) != 0; });
}
/// No corner is void.
inline bool is_published(const TileMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  return ((mesh.mark[triangle[0]] | mesh.mark[triangle[1]] | mesh.mark[triangle[2]]) & kVoid) == 0;
}

}  // namespace cordillera::proto
