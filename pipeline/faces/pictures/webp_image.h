#pragma once
// Pixels as a WebP file. The only door to libwebp.
#include <cstdint>
#include <span>
#include <string>

namespace cordillera::pipeline::faces {

/// Lossless. side * side pixels of three bytes, red first, by row from the top. The same bytes for the same pixels and library.
std::string webp(std::span<const std::uint8_t> rgb, std::uint32_t side);

/// What a photo may lose. quality: libwebp's, 1 to 99.
std::string lossy_webp(std::span<const std::uint8_t> rgb, std::uint32_t side, int quality);

}  // namespace cordillera::pipeline::faces
