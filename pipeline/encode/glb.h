#pragma once
// The binary glTF container, one JSON chunk and one binary chunk, and the buffer that both are about.
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <utility>

#include "pipeline/encode/json.h"
#include "proto/ellipsoid.h"
#include "proto/result.h"

namespace cordillera::pipeline {

// glTF's numbers for types of components, for what a buffer view is for, and for how a primitive is drawn.
inline constexpr int kGltfFloat = 5126, kGltfUnsignedShort = 5123, kGltfUnsignedInt = 5125;
inline constexpr int kGltfVertices = 34962, kGltfIndices = 34963;
inline constexpr int kGltfTriangles = 4;

using GltfVector = std::array<float, 3>;
/// glTF is y-up; 3D Tiles viewers turn y up into z up on load. A permutation: exact.
inline GltfVector y_up(const proto::Vec3& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.z), static_cast<float>(-p.y)};
}
/// The smallest type that numbers so many points: the greatest number of each type is kept free.
inline int index_type(std::size_t points) { return points < UINT16_MAX ? kGltfUnsignedShort : kGltfUnsignedInt; }

/// Bytes of a buffer, and the JSON that says what they are. Functions return numbers of what they added.
struct GlbBuffer {
  std::string bytes;
  Json views = Json::array(), accessors = Json::array();

  std::size_t add_view(std::string_view added);
  /// Of what no view holds as it is.
  std::size_t add_accessor(int component, std::size_t count, const char* type);
  /// Vectors in a view of their own.
  std::size_t add_vectors(std::span<const GltfVector> vectors);
  /// As index_type() has them, in a view of their own.
  std::size_t add_indices(std::span<const std::uint32_t> indices, int component, int target);
  /// Least and greatest of what the accessor that was added last stands for; not none.
  void add_bounds(std::span<const GltfVector> vectors);

 private:
  /// target: kGltfVertices, kGltfIndices; 0: it is not said.
  std::size_t end_view(std::size_t start, int target);
  std::size_t add_accessor_of_view(int component, std::size_t count, const char* type);
};

/// json and binary are padded to 4 bytes as the container asks.
std::string pack_glb(std::string json, std::string binary);
/// The JSON and the binary chunk (padding included), views into bytes.
proto::Result<std::pair<std::string_view, std::string_view>> unpack_glb(std::string_view bytes);

}  // namespace cordillera::pipeline
