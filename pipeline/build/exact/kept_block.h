#pragma once
// What an exact block leaves for the levels above it, in bytes: what crosses a restart or a process border.
#include <cstdint>
#include <string>

#include "gpu/exact/simplify_block.h"
#include "proto/mesh.h"
#include "proto/result.h"

namespace cordillera::pipeline {

struct KeptBlock {
  proto::TileMesh mesh;  ///< of its coarsest level, void triangles too
  gpu::exact::Squares squares;
};

/// Packed; codes are made coarser by code_unit first.
std::string to_bytes(const KeptBlock& block, float code_unit);
/// What of it is wanted; the rest is left empty.
enum class KeptParts : std::uint8_t { all, mesh, squares };
/// "store-damaged": they are not what to_bytes gave of a block whose sides have so many units, with this code_unit.
proto::Result<KeptBlock> kept_block_from(const std::string& bytes, std::int64_t side, float code_unit,
                                         KeptParts parts = KeptParts::all);

}  // namespace cordillera::pipeline
