#include "pipeline/faces/pictures/webp_image.h"

#include <webp/encode.h>

#include <stdexcept>

namespace cordillera::pipeline::faces {
namespace {

constexpr int kEffort = 2;  // 0 to 9; more takes several times as long and saves little on terrain

/// Its memory goes with the object.
class Picture {
 public:
  Picture() {
    if (WebPPictureInit(&picture) == 0) throw std::runtime_error("libwebp is of another version than its header");
    WebPMemoryWriterInit(&writer);
    picture.writer = WebPMemoryWrite;
    picture.custom_ptr = &writer;
  }
  ~Picture() {
    WebPPictureFree(&picture);
    WebPMemoryWriterClear(&writer);
  }
  Picture(const Picture&) = delete;
  Picture& operator=(const Picture&) = delete;

  WebPPicture picture{};
  WebPMemoryWriter writer{};
};

std::string encoded(std::span<const std::uint8_t> rgb, std::uint32_t side, const WebPConfig& config) {
  Picture to;
  to.picture.use_argb = config.lossless;
  to.picture.width = to.picture.height = static_cast<int>(side);
  if (WebPPictureImportRGB(&to.picture, rgb.data(), 3 * to.picture.width) == 0 || WebPEncode(&config, &to.picture) == 0)
    throw std::runtime_error("libwebp cannot write an image");
  return {reinterpret_cast<const char*>(to.writer.mem), to.writer.size};
}

}  // namespace

std::string webp(std::span<const std::uint8_t> rgb, std::uint32_t side) {
  WebPConfig config;
  if (WebPConfigInit(&config) == 0 || WebPConfigLosslessPreset(&config, kEffort) == 0)
    throw std::runtime_error("libwebp is of another version than its header");
  return encoded(rgb, side, config);
}

std::string lossy_webp(std::span<const std::uint8_t> rgb, std::uint32_t side, int quality) {
  WebPConfig config;
  if (WebPConfigPreset(&config, WEBP_PRESET_PHOTO, static_cast<float>(quality)) == 0)
    throw std::runtime_error("libwebp is of another version than its header");
  return encoded(rgb, side, config);
}

}  // namespace cordillera::pipeline::faces
