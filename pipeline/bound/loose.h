#pragma once
// What meshes leave uncovered, on its way up: rims move at every level, so a tile may cover again what its children did not. And
// what they cover where there is no data.
#include <array>
#include <cstdint>
#include <vector>

#include "pipeline/bound/surface.h"
#include "proto/lattice.h"

namespace cordillera::pipeline {

/// Samples with data that no published triangle of the tile's mesh covers.
std::vector<gpu::MeshPoint> uncovered_samples(const proto::Lattice& lattice, const proto::TileAddress& tile,
                                              const proto::TileMesh& mesh, const proto::Samples& samples);

/// Of four children together, in the parent's units. Index bit 0 east, bit 1 north; nullptr where a child has no data.
Loose joined(const std::array<const Loose*, 4>& children, std::int32_t child_side);

/// What a mesh leaves out of a finer surface over the same rectangle, and how much of it is new.
struct LeftOut {
  Loose loose;
  double more_units2 =
      0;  ///< plan area of the surface's triangles and patches that was covered and is no more; less than 0: the other way round
};
LeftOut left_out(const proto::TileMesh& mesh, const proto::TileMesh& finer, double finer_error_m, const Loose& of_finer);

/// A mark beside proto::VertexMark, on meshes that are handed up: of a vertex of a published triangle that may hold places
/// without data, for a rim has moved over them. A weld clears it.
inline constexpr std::uint8_t kOverVoid = 8;

/// Marks them where the samples are at hand.
void mark_over_void(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::Samples& samples,
                    proto::TileMesh& mesh);
/// Above the blocks: what a finer surface over the same rectangle shows without the mark has data.
void mark_over_void(const proto::TileMesh& finer, proto::TileMesh& mesh);
/// The vertices of a weld of four children that are marked in one of them.
std::vector<std::uint32_t> marked_over_void(const std::array<const proto::TileMesh*, 4>& children, const proto::TileMesh& welded);

}  // namespace cordillera::pipeline
