#pragma once
// Pixels as a lossless WebP file. The only door to libwebp.
#include <cstdint>
#include <span>
#include <string>

namespace cordillera::pipeline::faces {

/// side * side pixels of three bytes, red first, by row from the top. The same bytes for the same pixels and library.
std::string webp(std::span<const std::uint8_t> rgb, std::uint32_t side);

}  // namespace cordillera::pipeline::faces
