#include "pipeline/build/exact/kept_block.h"

#include <bit>
#include <cstring>

#include "block.pb.h"
#include "pipeline/tile/mesh_record.h"

namespace cordillera::pipeline {

static_assert(std::endian::native == std::endian::little && sizeof(gpu::exact::BoundingPlane) == 4 * sizeof(float),
              "planes are stored as they are");

std::string to_bytes(const KeptBlock& block) {
  proto::KeptBlock record;
  *record.mutable_mesh() = record_of_mesh(block.mesh);
  const gpu::exact::Squares& squares = block.squares;
  record.set_planes(
      std::string(reinterpret_cast<const char*>(squares.plane.data()), squares.plane.size() * sizeof(gpu::exact::BoundingPlane)));
  record.set_codes(std::string(squares.code.begin(), squares.code.end()));
  record.set_depths(std::string(squares.depth.begin(), squares.depth.end()));
  return record.SerializeAsString();
}

proto::Result<KeptBlock> kept_block_from(const std::string& bytes, std::int64_t side, KeptParts parts) {
  const proto::Problem damaged{"store-damaged", "what a block left for the levels above it cannot be read",
                               "a dataset built anew", ""};
  proto::KeptBlock record;
  if (!record.ParseFromString(bytes) || record.mesh().side() != side) return damaged;
  auto mesh = parts != KeptParts::squares ? mesh_of_record(record.mesh()) : std::optional(proto::TileMesh());
  const std::size_t across = static_cast<std::size_t>(record.mesh().side()) / 8 + 1, count = across * across;
  if (!mesh || record.planes().size() != count * sizeof(gpu::exact::BoundingPlane) || record.codes().size() != 64 * count)
    return damaged;
  if (!record.depths().empty() && record.depths().size() != count) return damaged;
  KeptBlock block;
  block.mesh = std::move(*mesh);
  if (parts == KeptParts::mesh) return block;
  gpu::exact::Squares& squares = block.squares;
  squares.plane.resize(count);
  std::memcpy(squares.plane.data(), record.planes().data(), record.planes().size());
  squares.code.assign(record.codes().begin(), record.codes().end());
  squares.depth.assign(record.depths().begin(), record.depths().end());
  return block;
}

}  // namespace cordillera::pipeline
