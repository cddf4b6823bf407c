#pragma once
// A part of the earth.
#include <iterator>
#include <optional>
#include <string>

namespace cordillera::raster {

/// A rectangle in degrees; west <= east, and east may exceed 180.
struct Area {
  double west_deg = 0, south_deg = 0, east_deg = 0, north_deg = 0;
};

/// Of "west, south, east, north" as documents and options have it: there an east below the west lies across the antimeridian.
/// None of fewer than four numbers.
template <class Numbers>
std::optional<Area> area_of(const Numbers& box) {
  if (std::size(box) < 4) return std::nullopt;
  return Area{box[0], box[1], box[2] < box[0] ? box[2] + 360 : box[2], box[3]};
}

/// For documents that know no antimeridian: an area across it has the whole circle.
inline Area unwrapped(const Area& area) { return area.east_deg > 180 ? Area{-180, area.south_deg, 180, area.north_deg} : area; }

inline double middle_latitude_deg(const Area& area) { return (area.south_deg + area.north_deg) / 2; }
/// The middle of its longitudes, -180 to 180.
inline double middle_longitude_deg(const Area& area) {
  const double middle_deg = (area.west_deg + area.east_deg) / 2;
  return middle_deg > 180 ? middle_deg - 360 : middle_deg;
}

/// The longitudes of area that lie in clip, as one interval; none when they are disjoint. Both are taken modulo the circle.
std::optional<Area> intersect(const Area& area, const Area& clip);

/// "west,south,east,north" in degrees, as a bbox is given.
std::string text_of(const Area& area);
/// Of a box beside the data: "; in the order west,south,east,north it would: " and the box, where it would touch the data if its
/// latitudes had been given first; else empty.
std::string hint_on_order(const Area& box, const Area& data);

}  // namespace cordillera::raster
