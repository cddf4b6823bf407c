#include "pipeline/encode/draco_mesh.h"
#include "pipeline/encode/encode.h"
#include "pipeline/encode/published_mesh.h"

namespace cordillera::pipeline {

std::string encode_drc(const EncodeInput& input, const PublishedMesh& published) {
  const proto::TileMesh& mesh = *input.mesh;
  if (published.empty()) return {};
  LatticeMesh out;
  out.points.reserve(published.source.size());
  for (const std::uint32_t v : published.source) out.points.push_back({mesh.x[v], mesh.y[v], mesh.height[v] / input.height_step});
  out.triangles = published.triangles;
  out.z = input.tile.z;
  out.x = input.tile.x;
  out.y = input.tile.y;
  out.side = mesh.side;
  out.height_step = input.height_step * proto::kHeightStep_m;
  return draco_encode(out);
}

}  // namespace cordillera::pipeline
