#include "pipeline/encode/glb.h"

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
