#include "raster/options.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "proto/mesh.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

proto::Result<void> read_nodata(const std::string& text, SourceOptions& out) {
  if (text.empty() || text == "hole") return {};
  if (text == "fill") {
    out.voids = VoidRule::fill;
    return {};
  }
  const auto [end, error] = std::from_chars(text.data() + (text[0] == '+' ? 1 : 0), text.data() + text.size(), out.void_height_m);
  if (error != std::errc{} || end != text.data() + text.size() || !(std::abs(out.void_height_m) <= proto::kMaxHeight_m))
    return Problem{"option-invalid", "nodata=" + text + " is no height", "hole, fill, or a height in metres from -16384 to 16384", "nodata"};
  out.voids = VoidRule::value;
  return {};
}

proto::Result<void> read_source_nodata(const std::string& text, SourceOptions& out) {
  if (text.empty()) return {};
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc{} || end != text.data() + text.size() || std::isinf(value))
    return Problem{"option-invalid", "source_nodata=" + text + " is no value of a pixel", "a number as it stands in the file, or nan", "source_nodata"};
  out.source_nodata = value;
  return {};
}

proto::Result<void> read_bbox(const proto::BuildOptions& options, SourceOptions& out) {
  if (options.bbox_size() == 0) return {};
  const auto refuse = [](const std::string& why) {
    return Problem{"option-invalid", "bbox " + why, "west,south,east,north in degrees; west > east crosses the antimeridian", "bbox"};
  };
  if (options.bbox_size() != 4) return refuse("has " + std::to_string(options.bbox_size()) + " numbers, not four");
  const double west = options.bbox(0), south = options.bbox(1), east = options.bbox(2), north = options.bbox(3);
  for (const double v : options.bbox())
    if (!std::isfinite(v)) return refuse("holds something that is no number");
  if (south < -90 || north > 90 || !(south < north)) return refuse("needs -90 <= south < north <= 90");
  if (std::abs(west) > 360 || std::abs(east) > 360 || west == east) return refuse("needs two different longitudes from -360 to 360");
  Area area{west, south, east, north};
  const double width = east > west ? std::min(360.0, east - west) : east - west + 360 * std::ceil((west - east) / 360);
  area.west_deg -= 360 * std::floor((west + 180) / 360);
  area.east_deg = area.west_deg + width;
  out.bbox = area;
  return {};
}

}  // namespace

proto::Result<SourceOptions> check_options(const proto::BuildOptions& options) {
  SourceOptions out;
  if (options.has_z_scale()) out.z_scale = options.z_scale();
  if (options.has_z_offset()) out.z_offset_m = options.z_offset();
  if (!std::isfinite(out.z_scale) || out.z_scale == 0) return Problem{"option-invalid", "z_scale is no factor", "a number other than 0", "z_scale"};
  if (!std::isfinite(out.z_offset_m)) return Problem{"option-invalid", "z_offset is no number", "a height in metres", "z_offset"};
  if (auto done = read_nodata(options.nodata(), out); !done.ok()) return done.problem();
  if (auto done = read_source_nodata(options.source_nodata(), out); !done.ok()) return done.problem();
  if (auto done = read_bbox(options, out); !done.ok()) return done.problem();
  return out;
}

std::optional<Area> intersect(const Area& area, const Area& clip) {
  bool found = false;
  Area both{0, std::max(area.south_deg, clip.south_deg), 0, std::min(area.north_deg, clip.north_deg)};
  if (both.south_deg > both.north_deg) return std::nullopt;
  // Two arcs of a circle may meet in two pieces: then the smallest interval of area that holds both.
  for (int turn = -2; turn <= 2; ++turn) {
    const double west = std::max(area.west_deg, clip.west_deg + 360 * turn), east = std::min(area.east_deg, clip.east_deg + 360 * turn);
    if (west > east) continue;
    both.west_deg = found ? std::min(both.west_deg, west) : west;
    both.east_deg = found ? std::max(both.east_deg, east) : east;
    found = true;
  }
  if (!found) return std::nullopt;
  return both;
}

}  // namespace cordillera::raster
