#include "pipeline/tileset/subtree_file.h"

#include <cstdint>

#include "pipeline/encode/little_endian.h"

namespace cordillera::pipeline {
namespace {
constexpr std::uint32_t kMagic = 0x74627573;  // "subt"
constexpr std::uint32_t kVersion = 1;
}  // namespace

std::size_t SubtreeFile::add(const std::string& part) {
  views_.push_back({{"buffer", 0}, {"byteOffset", binary_.size()}, {"byteLength", part.size()}});
  binary_ += part;
  pad(binary_, 8, '\0');
  return views_.size() - 1;
}

Json SubtreeFile::availability(const AvailabilityBits& bits) {
  if (bits.uniform()) return {{"constant", bits.available() > 0 ? 1 : 0}};
  return {{"bitstream", add(bits.bytes())}, {"availableCount", bits.available()}};
}

std::string SubtreeFile::bytes(const Json& json) const {
  Json whole;
  whole["buffers"] = Json::array({{{"byteLength", binary_.size()}}});
  whole["bufferViews"] = views_;
  whole.update(json);
  std::string text = whole.dump(), out;
  pad(text, 8, ' ');
  append_little_endian(out, kMagic);
  append_little_endian(out, kVersion);
  append_little_endian(out, std::uint64_t{text.size()});
  append_little_endian(out, std::uint64_t{binary_.size()});
  return out + text + binary_;
}

}  // namespace cordillera::pipeline
