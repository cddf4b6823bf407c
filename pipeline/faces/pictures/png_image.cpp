#include "pipeline/faces/pictures/png_image.h"

#include <png.h>

#include <algorithm>
#include <csetjmp>
#include <stdexcept>

namespace cordillera::pipeline::faces {
namespace {

constexpr int kEffort = 6;  // of zlib; more costs much time and saves little on terrain
constexpr int kDepth_bits = 8;

void append(png_structp png, png_bytep bytes, png_size_t count) {
  static_cast<std::string*>(png_get_io_ptr(png))->append(reinterpret_cast<const char*>(bytes), count);
}
void flush(png_structp) {}

/// libpng leaves by longjmp where it fails: nothing with a destructor may live in this function.
bool write(png_structp png, png_infop info, const std::uint8_t* pixels, std::uint32_t side, Pixel pixel) {
  if (setjmp(png_jmpbuf(png)) != 0) return false;
  const int color = pixel == Pixel::rgb         ? PNG_COLOR_TYPE_RGB
                    : pixel == Pixel::rgb_alpha ? PNG_COLOR_TYPE_RGB_ALPHA
                                                : PNG_COLOR_TYPE_GRAY_ALPHA;
  png_set_IHDR(png, info, side, side, kDepth_bits, color, PNG_INTERLACE_NONE, PNG_COMPRESSION_TYPE_DEFAULT,
               PNG_FILTER_TYPE_DEFAULT);
  png_set_compression_level(png, kEffort);
  png_set_filter(png, PNG_FILTER_TYPE_BASE, PNG_FILTER_SUB);
  png_write_info(png, info);
  const std::size_t row = std::size_t{side} * static_cast<std::size_t>(pixel);
  for (std::uint32_t r = 0; r < side; ++r) png_write_row(png, pixels + r * row);
  png_write_end(png, nullptr);
  return true;
}

}  // namespace

std::string png(std::span<const std::uint8_t> pixels, std::uint32_t side, Pixel pixel) {
  std::string bytes;
  png_structp file = png_create_write_struct(PNG_LIBPNG_VER_STRING, nullptr, nullptr, nullptr);
  png_infop info = file == nullptr ? nullptr : png_create_info_struct(file);
  bool done = info != nullptr;
  if (done) {
    png_set_write_fn(file, &bytes, append, flush);
    done = write(file, info, pixels.data(), side, pixel);
  }
  png_destroy_write_struct(&file, &info);
  if (!done) throw std::runtime_error("libpng cannot write an image");
  return bytes;
}

std::vector<std::uint8_t> png_pixels(std::string_view bytes) {
  constexpr png_uint_32 kMostSide = 4096;
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  std::vector<std::uint8_t> pixels;
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) != 0 &&
      std::max(image.width, image.height) <= kMostSide) {
    image.format = PNG_FORMAT_RGB;
    const png_color black{};
    pixels.resize(PNG_IMAGE_SIZE(image));
    if (png_image_finish_read(&image, &black, pixels.data(), 0, nullptr) == 0) pixels.clear();
  }
  png_image_free(&image);
  return pixels;
}

}  // namespace cordillera::pipeline::faces
