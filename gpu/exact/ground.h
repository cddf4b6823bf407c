#pragma once
// What is known above blocks, where their samples are out of reach: squares of 8 samples, and the blocks' meshes as one.
#include <cstdint>
#include <span>
#include <vector>

#include "gpu/exact/simplify_block.h"
#include "gpu/exact/steps/mesh.h"

namespace cordillera::gpu::exact {

/// How many squares each square of a ground is from the nearest one with valid samples, or with voids: in columns or in rows,
/// where that is more. Empty: no voids.
std::vector<std::uint16_t> squares_to_valid(const Ground& ground);
std::vector<std::uint16_t> squares_to_void(const Ground& ground);
/// A ground's squares hold how far their samples are from the other kind as far as their block knows it. Where that is less by
/// how far squares are apart, also of other blocks, that is given, up to 2^reach; never less than it is. Empty: no voids.
std::vector<Depth> joined_depths(const Ground& ground, int reach, std::span<const std::uint16_t> to_valid,
                                 std::span<const std::uint16_t> to_void);

/// The greatest reach, from `least` to `most`, by which rims may move so that half of the squares with data stay: those that are
/// farther from voids so wide that no rim closes them. most, where voids are narrower than that, and where there are none.
int reach_of_narrow_data(const Ground& ground, int least, int most);

/// The ring-only mesh of a triangulation; on the host.
struct RingMesh {
  std::vector<std::uint32_t> position, ring;  ///< as in MeshView
  std::vector<float> height;
  std::vector<std::uint8_t> valence, mark;
};
/// columns, rows: of the rectangle that the triangles cover. "option-invalid": they do not, or a vertex has too many neighbours.
proto::Result<RingMesh> ring_mesh(const BlockMesh& mesh, std::int32_t columns, std::int32_t rows);

/// The largest bins, as a shift, of which several fit into the smallest window: collapses only take vertices away. Of a field so
/// large that there would be millions of such bins, the largest of which one fits.
int bin_shift_for(const Field& field, std::span<const std::uint32_t> positions);

}  // namespace cordillera::gpu::exact
