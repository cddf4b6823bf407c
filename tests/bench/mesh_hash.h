#pragma once
// A number for a mesh, to be recorded and held against that of another device.
#include <cstdint>

#include "gpu/fit/simplify_height_mesh.h"

namespace cordillera::bench {

/// FNV-1a over the bytes of x, y, z and triangles.
inline std::uint64_t hash_of(const gpu::fit::HeightMesh& mesh) {
  std::uint64_t hash = 0xcbf29ce484222325u;
  const auto add = [&](const void* data, std::size_t bytes) {
    for (std::size_t k = 0; k < bytes; ++k) hash = (hash ^ static_cast<const unsigned char*>(data)[k]) * 0x100000001b3u;
  };
  for (const auto* values : {&mesh.x, &mesh.y, &mesh.z}) add(values->data(), values->size() * sizeof(double));
  add(mesh.triangles.data(), mesh.triangles.size() * sizeof(mesh.triangles[0]));
  return hash;
}

}  // namespace cordillera::bench
