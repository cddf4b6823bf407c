#pragma once
// Pixels as a PNG file. The only door to libpng.
#include <cstdint>
#include <span>
#include <string>

namespace cordillera::pipeline::faces {

/// Bytes of a pixel.
enum class Pixel : std::uint8_t { grey_alpha = 2, rgb = 3, rgb_alpha = 4 };

/// side * side pixels by row from the top. The same bytes for the same pixels and libraries: no time, no text, fixed settings.
std::string png(std::span<const std::uint8_t> pixels, std::uint32_t side, Pixel pixel);

}  // namespace cordillera::pipeline::faces
