#include "raster/mosaic/mosaic_description.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <set>
#include <string>

#include "proto/integers.h"

namespace cordillera::raster {
namespace {

double cosine(double latitude_deg) { return std::max(std::cos(latitude_deg / 180 * std::numbers::pi), 1e-6); }

/// The smallest box around those of all members; whole: the window that holds them.
std::array<double, 4> box_of(const std::vector<MosaicMember>& members, const Source::Window& whole) {
  const bool circle = whole.east - whole.west >= kMemberLattice.columns();
  std::array<double, 4> box{HUGE_VAL, HUGE_VAL, -HUGE_VAL, -HUGE_VAL};
  for (const MosaicMember& member : members) {
    const auto& own = member.description.bbox();
    // As far east as its window begins, give or take what a window is larger.
    const double window_west =
        kMemberLattice.longitude_deg(whole.west + proto::modulo(member.window.west - whole.west, kMemberLattice.columns()));
    const double west = own[0] - 360 * std::nearbyint((own[0] - window_west) / 360);
    const double width = own[2] < own[0] ? own[2] - own[0] + 360 : own[2] - own[0];
    box = {std::min(box[0], west), std::min(box[1], own[1]), std::max(box[2], west + width), std::max(box[3], own[3])};
  }
  if (circle) return {-180, box[1], 180, box[3]};
  for (const std::size_t side : {std::size_t{0}, std::size_t{2}}) {
    if (box[side] > 180) box[side] -= 360;
    if (box[side] < -180) box[side] += 360;
  }
  return box;
}

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
  description.set_horizontal_datum(common([](const proto::Source& s) { return s.horizontal_datum(); }));
  description.clear_datum_ignored();
  description.clear_notes();
  description.set_unit(common([](const proto::Source& s) { return s.unit(); }));
  description.set_nodata(common([](const proto::Source& s) { return s.nodata(); }));
  description.set_data_type(common([](const proto::Source& s) { return s.data_type(); }));
  description.clear_bbox();
  for (const double side : box_of(members, whole)) description.add_bbox(side);
  return description;
}

}  // namespace cordillera::raster
