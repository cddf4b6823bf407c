#pragma once
// Tiles of the picture formats as a map client fetches and decodes them.
#include <gtest/gtest.h>
#include <png.h>
#include <webp/decode.h>

#include <cmath>
#include <numbers>
#include <optional>
#include <string>
#include <vector>

#include "pipeline/encode/json.h"
#include "pipeline/faces/face.h"
#include "proto/lattice.h"

namespace cordillera::pipeline::faces {

inline const proto::Lattice kPictureLattice{7};

struct Picture {
  std::uint32_t side = 0;
  std::vector<std::uint8_t> bytes;
};

inline Picture read_png(const std::string& bytes, std::uint32_t format) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()) == 0) return {};
  EXPECT_EQ(image.width, image.height);
  image.format = format;
  Picture picture{image.width, std::vector<std::uint8_t>(PNG_IMAGE_SIZE(image))};
  EXPECT_NE(png_image_finish_read(&image, nullptr, picture.bytes.data(), 0, nullptr), 0);
  return picture;
}

inline Picture read_webp(const std::string& bytes) {
  int width = 0, height = 0;
  std::uint8_t* rgb = WebPDecodeRGB(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size(), &width, &height);
  if (rgb == nullptr) return {};
  Picture picture{static_cast<std::uint32_t>(width), {rgb, rgb + 3 * width * height}};
  WebPFree(rgb);
  return picture;
}

inline double mapbox_m(const Picture& p, std::size_t k) {
  return -10000 + 0.1 * (p.bytes[3 * k] * 65536 + p.bytes[3 * k + 1] * 256 + p.bytes[3 * k + 2]);
}
inline double terrarium_m(const Picture& p, std::size_t k) {
  return p.bytes[3 * k] * 256 + p.bytes[3 * k + 1] + p.bytes[3 * k + 2] / 256.0 - 32768;
}

inline std::optional<std::string> fetch(const Terrain& terrain, const std::string& path) {
  const auto found = find(path);
  if (!found) {
    ADD_FAILURE() << "no face has " << path;
    return std::nullopt;
  }
  if (!inside(found->resource->grid, found->place)) return std::nullopt;
  const auto made = found->resource->make(terrain, found->place);
  if (!made.ok()) {
    ADD_FAILURE() << path << ": " << made.problem().line();
    return std::nullopt;
  }
  return *made ? std::optional(std::string((*made)->bytes)) : std::nullopt;
}

inline std::string tile_path(const std::string& face, int z, std::int32_t x, std::int32_t y, const std::string& ending) {
  return face + "/" + std::to_string(z) + "/" + std::to_string(x) + "/" + std::to_string(y) + ending;
}

inline Json tilejson_of(const Terrain& terrain, const std::string& path) {
  return Json::parse(fetch(terrain, path).value_or("{}"));
}

/// The tile that holds a place, by the formula that every map client has.
inline Place tile_at(int zoom, double longitude_deg, double latitude_deg) {
  const double n = std::ldexp(1, zoom), lat = latitude_deg * std::numbers::pi / 180;
  return {0, zoom, static_cast<std::int32_t>((longitude_deg + 180) / 360 * n),
          static_cast<std::int32_t>((1 - std::asinh(std::tan(lat)) / std::numbers::pi) / 2 * n)};
}

inline double longitude_of(const Place& p, double column) { return (p.x + column / 256) / std::ldexp(1, p.z) * 360 - 180; }
inline double latitude_of(const Place& p, double row) {
  return std::atan(std::sinh(std::numbers::pi * (1 - 2 * (p.y + row / 256) / std::ldexp(1, p.z)))) * 180 / std::numbers::pi;
}

}  // namespace cordillera::pipeline::faces
