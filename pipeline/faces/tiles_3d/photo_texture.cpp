#include "pipeline/faces/tiles_3d/photo_texture.h"

#include <array>
#include <cmath>
#include <cstdio>
#include <vector>

#include "pipeline/faces/pictures/webp_image.h"
#include "raster/photo/orthophoto.h"
#include "raster/place/area.h"

namespace cordillera::pipeline::faces {
namespace {

/// A linear colour as a picture has it.
double srgb_byte(double linear) { return 255 * (1.055 * std::pow(linear, 1 / 2.4) - 0.055); }

/// Three bytes of four: what is not of the photo is the ground's.
std::vector<std::uint8_t> laid_on_ground(const std::vector<std::uint8_t>& rgba) {
  const std::array<double, 3> ground = {srgb_byte(kGround[0]), srgb_byte(kGround[1]), srgb_byte(kGround[2])};
  std::vector<std::uint8_t> rgb;
  rgb.reserve(rgba.size() / 4 * 3);
  for (std::size_t at = 0; at < rgba.size(); at += 4) {
    const double alpha = rgba[at + 3] / 255.0;
    for (std::size_t k = 0; k < 3; ++k)
      rgb.push_back(static_cast<std::uint8_t>(std::nearbyint(alpha * rgba[at + k] + (1 - alpha) * ground[k])));
  }
  return rgb;
}

std::string area_text(const raster::Area& area) {
  char text[100];
  std::snprintf(text, sizeof text, "%.3f to %.3f degrees east, %.3f to %.3f degrees north", area.west_deg, area.east_deg,
                area.south_deg, area.north_deg);
  return text;
}

}  // namespace

proto::Result<std::optional<std::string>> photo_texture(const Terrain& terrain, const proto::TileAddress& tile) {
  const Look& look = terrain.look();
  proto::Lattice lattice;  // of the photo's pixels
  lattice.finest_level = tile.z + look.photo_finer;
  const std::int32_t side = look.photo_side();
  const auto colours = look.photo->colours(lattice, {lattice.west(tile), lattice.south(tile), side, side});
  if (!colours.ok()) return colours.problem();
  if (!*colours) return std::optional<std::string>();
  const auto rgb = laid_on_ground(**colours);
  return std::optional(look.photo_quality == kLossless ? webp(rgb, static_cast<std::uint32_t>(side))
                                                       : lossy_webp(rgb, static_cast<std::uint32_t>(side), look.photo_quality));
}

proto::Result<void> check_photo(const Terrain& terrain) {
  const auto data = raster::area_of(terrain.manifest().bounds());
  if (!terrain.look().photo || !data) return {};
  return check_photo(*terrain.look().photo, *data);
}

proto::Result<void> check_photo(const raster::Orthophoto& photo, const raster::Area& data) {
  const raster::Area& area = photo.area();
  const auto meets = [&](double turn) { return area.west_deg + turn <= data.east_deg && data.west_deg <= area.east_deg + turn; };
  if ((meets(0) || meets(360) || meets(-360)) && area.south_deg <= data.north_deg && data.south_deg <= area.north_deg) return {};
  return proto::Problem{
      "option-invalid",
      photo.name() + " shows no part of the terrain: it lies at " + area_text(area) + ", the terrain at " + area_text(data),
      "an orthophoto of the same place", "texture"};
}

}  // namespace cordillera::pipeline::faces
