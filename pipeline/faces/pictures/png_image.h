#pragma once
// Pixels as a PNG file. The only door to libpng.
#include <cstdint>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace cordillera::pipeline::faces {

/// Bytes of a pixel.
enum class Pixel : std::uint8_t { grey_alpha = 2, rgb = 3, rgb_alpha = 4 };

/// side * side pixels by row from the top. The same bytes for the same pixels and libraries: no time, no text, fixed settings.
std::string png(std::span<const std::uint8_t> pixels, std::uint32_t side, Pixel pixel);

/// Red, green and blue of a PNG file, by row from the top, on black. Empty where it is none, or has more than 4096 pixels a side.
std::vector<std::uint8_t> png_pixels(std::string_view bytes);

}  // namespace cordillera::pipeline::faces
