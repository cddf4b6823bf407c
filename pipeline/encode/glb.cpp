#include "pipeline/encode/glb.h"

#include <algorithm>
#include <bit>

#include "pipeline/encode/little_endian.h"

namespace cordillera::pipeline {
namespace {

constexpr std::uint32_t kMagic = 0x46546C67;  // "glTF"
constexpr std::uint32_t kJsonChunk = 0x4E4F534A;
constexpr std::uint32_t kBinaryChunk = 0x004E4942;
constexpr std::size_t kHeader = 12, kChunkHeader = 8;

void append_chunk(std::string& out, std::uint32_t type, const std::string& bytes) {
  append_little_endian(out, static_cast<std::uint32_t>(bytes.size()));
  append_little_endian(out, type);
  out += bytes;
}

}  // namespace

std::size_t GlbBuffer::end_view(std::size_t start, int target) {
  views.push_back({{"buffer", 0}, {"byteOffset", start}, {"byteLength", bytes.size() - start}});
  if (target != 0) views.back()["target"] = target;
  pad(bytes, 4, '\0');
  return views.size() - 1;
}

std::size_t GlbBuffer::add_view(std::string_view added) {
  const std::size_t start = bytes.size();
  bytes += added;
  return end_view(start, 0);
}

std::size_t GlbBuffer::add_accessor(int component, std::size_t count, const char* type) {
  accessors.push_back({{"componentType", component}, {"count", count}, {"type", type}});
  return accessors.size() - 1;
}

std::size_t GlbBuffer::add_accessor_of_view(int component, std::size_t count, const char* type) {
  accessors.push_back({{"bufferView", views.size() - 1}, {"componentType", component}, {"count", count}, {"type", type}});
  return accessors.size() - 1;
}

std::size_t GlbBuffer::add_vectors(std::span<const GltfVector> vectors) {
  const std::size_t start = bytes.size();
  for (const GltfVector& v : vectors) {
    for (const float value : v) append_little_endian(bytes, std::bit_cast<std::uint32_t>(value));
  }
  end_view(start, kGltfVertices);
  return add_accessor_of_view(kGltfFloat, vectors.size(), "VEC3");
}

std::size_t GlbBuffer::add_indices(std::span<const std::uint32_t> indices, int component, int target) {
  const std::size_t start = bytes.size();
  for (const std::uint32_t index : indices) {
    if (component == kGltfUnsignedInt)
      append_little_endian(bytes, index);
    else
      append_little_endian(bytes, static_cast<std::uint16_t>(index));
  }
  end_view(start, target);
  return add_accessor_of_view(component, indices.size(), "SCALAR");
}

void GlbBuffer::add_bounds(std::span<const GltfVector> vectors) {
  GltfVector low = vectors[0], high = low;
  for (const GltfVector& v : vectors) {
    for (std::size_t k = 0; k < 3; ++k) {
      low[k] = std::min(low[k], v[k]);
      high[k] = std::max(high[k], v[k]);
    }
  }
  accessors.back()["min"] = low;
  accessors.back()["max"] = high;
}

std::string pack_glb(std::string json, std::string binary) {
  pad(json, 4, ' ');
  pad(binary, 4, '\0');
  std::string out;
  out.reserve(kHeader + 2 * kChunkHeader + json.size() + binary.size());
  append_little_endian(out, kMagic);
  append_little_endian(out, std::uint32_t{2});
  append_little_endian(out, static_cast<std::uint32_t>(kHeader + 2 * kChunkHeader + json.size() + binary.size()));
  append_chunk(out, kJsonChunk, json);
  append_chunk(out, kBinaryChunk, binary);
  return out;
}

proto::Result<std::pair<std::string_view, std::string_view>> unpack_glb(std::string_view bytes) {
  const proto::Problem damaged{"tile-damaged", "not a binary glTF file of two chunks", "bytes of a tile that Cordillera wrote",
                               ""};
  if (bytes.size() < kHeader + 2 * kChunkHeader || little_endian_at<std::uint32_t>(bytes, 0) != kMagic ||
      little_endian_at<std::uint32_t>(bytes, 4) != 2 || little_endian_at<std::uint32_t>(bytes, 8) != bytes.size() ||
      little_endian_at<std::uint32_t>(bytes, 16) != kJsonChunk) {
    return damaged;
  }
  const std::size_t json = little_endian_at<std::uint32_t>(bytes, kHeader);
  const std::size_t second = kHeader + kChunkHeader + json;
  if (second + kChunkHeader > bytes.size() || little_endian_at<std::uint32_t>(bytes, second + 4) != kBinaryChunk) return damaged;
  const std::size_t binary = little_endian_at<std::uint32_t>(bytes, second);
  if (second + kChunkHeader + binary != bytes.size()) return damaged;
  return std::pair{bytes.substr(kHeader + kChunkHeader, json), bytes.substr(second + kChunkHeader, binary)};
}

}  // namespace cordillera::pipeline
