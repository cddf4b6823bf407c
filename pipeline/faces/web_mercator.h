#pragma once
// The WebMercatorQuad grid of raster faces: tiles of 256 pixels, x from longitude -180, y from the north; and which level of a
// dataset's meshes a zoom is drawn from.
#include <cstdint>
#include <optional>

#include "cordillera.pb.h"
#include "raster/place/area.h"

namespace cordillera::pipeline::faces {

inline constexpr std::int32_t kTilePixels = 256;
/// Where the grid ends, degrees: its square holds no more of the earth.
inline constexpr double kMercatorEnd_deg = 85.05112877980659;

/// Places are pixels of a zoom, counted from the grid's north-western corner; whole numbers are borders, halves centres. x may
/// lie outside the grid: it is wrapped, so that a place has one longitude, in [-180, 180), whichever tile asks.
double pixel_longitude_deg(int zoom, double x);
double pixel_latitude_deg(int zoom, double y);
double latitude_pixel(int zoom, double latitude_deg);
double longitude_pixel(int zoom, double longitude_deg);

/// What of a dataset the grid can show. None where the data lies beyond the grid's ends.
std::optional<raster::Area> extent_of(const proto::Manifest& manifest);
/// Whether none of an area is in Web Mercator.
inline bool is_beyond_mercator(const raster::Area& area) {
  return area.south_deg >= kMercatorEnd_deg || area.north_deg <= -kMercatorEnd_deg;
}

/// Zooms that a dataset has. The last one is the first whose pixels, at the data's middle latitude, are no larger than the finest
/// cell; the first one is 0 unless coarse levels were not published.
struct Zooms {
  int first = 0, last = 0;
  bool holds(int zoom) const { return zoom >= first && zoom <= last; }
};
Zooms zooms_of(const proto::Manifest& manifest, const raster::Area& extent);

/// The coarsest published level whose cell is no larger than a pixel at the latitude; the finest at the last zoom.
int level_of(const proto::Manifest& manifest, const Zooms& zooms, int zoom, double latitude_deg);

/// A latitude that stands for a row of tiles: the middle of what of it the data touches.
double row_latitude_deg(const raster::Area& extent, int zoom, std::int32_t y);

/// Whether a tile and the extent have an area in common.
bool touches(const raster::Area& extent, int zoom, std::int32_t x, std::int32_t y);

}  // namespace cordillera::pipeline::faces
