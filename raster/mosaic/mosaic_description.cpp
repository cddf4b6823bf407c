#include "raster/mosaic/mosaic_description.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>
#include <string>

namespace cordillera::raster {
namespace {

double cosine(double latitude_deg) { return std::max(std::cos(latitude_deg / 180 * std::numbers::pi), 1e-6); }

}  // namespace

proto::Source describe_mosaic(const std::vector<MosaicMember>& members, const Source::Window& whole) {
  proto::Source description = members.front().description;
  if (members.size() == 1) return description;
  const double south = kMemberLattice.latitude_deg(whole.south), north = kMemberLattice.latitude_deg(whole.north);
  // At the mosaic's centre a pixel counts as wide as would be as many of the lattice's cells, which become narrow towards a pole.
  const auto width_m = [&](const proto::Source& s) {
    return s.pixel_width_m() * cosine((south + north) / 2) / cosine((s.bbox(1) + s.bbox(3)) / 2);
  };
  const auto finest = std::min_element(members.begin(), members.end(), [&](const MosaicMember& a, const MosaicMember& b) {
    return width_m(a.description) * a.description.pixel_height_m() < width_m(b.description) * b.description.pixel_height_m();
  });
  description = finest->description;
  description.set_pixel_width_m(width_m(finest->description));
  // Cutters leave slivers of a pixel or two, whose heights alone would want finer cells. The whole is no such raster.
  for (const MosaicMember& member : members) {
    description.set_columns(std::max(description.columns(), member.description.columns()));
    description.set_rows(std::max(description.rows(), member.description.rows()));
  }
  description.clear_all_void();
  description.set_file(std::to_string(members.size()) + " rasters");
  const auto common = [&](auto get) {
    std::set<std::string> values;
    for (const MosaicMember& member : members) values.insert(get(member.description));
    return values.size() == 1 ? *values.begin() : std::string(kMixed);
  };
  description.set_driver(common([](const proto::Source& s) { return s.driver(); }));
  description.set_crs(common([](const proto::Source& s) { return s.crs(); }));
  description.set_crs_from(common([](const proto::Source& s) { return s.crs_from(); }));
  description.set_vertical_datum(common([](const proto::Source& s) { return s.vertical_datum(); }));
  description.set_vertical_datum_from(common([](const proto::Source& s) { return s.vertical_datum_from(); }));
  description.set_vertical_grid(common([](const proto::Source& s) { return s.vertical_grid(); }));
  description.set_vertical_datum_declared(common([](const proto::Source& s) { return s.vertical_datum_declared(); }));
  description.set_unit(common([](const proto::Source& s) { return s.unit(); }));
  description.set_nodata(common([](const proto::Source& s) { return s.nodata(); }));
  description.set_data_type(common([](const proto::Source& s) { return s.data_type(); }));
  const bool circle = whole.east - whole.west >= kMemberLattice.columns();
  const double east = kMemberLattice.longitude_deg(whole.east);
  description.clear_bbox();
  description.add_bbox(circle ? -180 : kMemberLattice.longitude_deg(whole.west));
  description.add_bbox(south);
  description.add_bbox(circle ? 180 : east > 180 ? east - 360 : east);
  description.add_bbox(north);
  return description;
}

}  // namespace cordillera::raster
