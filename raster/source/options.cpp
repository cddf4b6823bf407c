#include "raster/source/options.h"

#include <algorithm>
#include <cmath>

#include "proto/mesh.h"
#include "proto/numbers.h"
#include "raster/sample/back_projection.h"
#include "raster/voids/filled_source.h"
#include "raster/voids/void_height.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

/// The whole text as a number; it may begin with a "+".
bool read_number(std::string_view text, double& out) {
  const auto number = proto::number<double>(text.substr(text.starts_with('+') ? 1 : 0));
  out = number.value_or(out);
  return number.has_value();
}

proto::Result<void> take_voids(const std::string& text, SourceOptions& out) {
  const auto height_m = void_height_m(text);
  if (!height_m) {
    Problem problem = height_m.problem();
    problem.detail = "voids='" + text + "': " + problem.detail;
    problem.accepted = "fill, hole, or a height in metres from " + std::to_string(kLeastVoidHeight_m) + " to 16384";
    return problem;
  }
  if (!*height_m) return {};
  out.void_height_m = **height_m;
  out.voids = VoidRule::value;
  return {};
}

/// Stores of earlier versions say here what becomes of voids.
proto::Result<void> read_nodata(const std::string& text, SourceOptions& out) {
  if (text.empty() || text == "hole" || text == "fill") return {};
  double value = 0;
  if (!read_number(text, value) || std::isinf(value))
    return Problem{"option-invalid", "nodata=" + text + " is no value of a pixel", "a number as it stands in the file, or nan",
                   "nodata"};
  out.nodata = value;
  return {};
}

proto::Result<void> read_bbox(const proto::BuildOptions& options, SourceOptions& out) {
  if (options.bbox_size() == 0) return {};
  const auto refuse = [](const std::string& why) {
    return Problem{"option-invalid", "bbox " + why, "west,south,east,north in degrees; west > east crosses the antimeridian",
                   "bbox"};
  };
  if (options.bbox_size() != 4) return refuse("has " + std::to_string(options.bbox_size()) + " numbers, not four");
  const double west = options.bbox(0), south = options.bbox(1), east = options.bbox(2), north = options.bbox(3);
  for (const double v : options.bbox())
    if (!std::isfinite(v)) return refuse("holds something that is no number");
  if (south < -90 || north > 90 || !(south < north)) return refuse("needs -90 <= south < north <= 90");
  if (std::abs(west) > 360 || std::abs(east) > 360 || west == east)
    return refuse("needs two different longitudes from -360 to 360");
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
  if (!std::isfinite(out.z_scale) || out.z_scale == 0)
    return Problem{"option-invalid", "z_scale is no factor", "a number other than 0", "z_scale"};
  if (!std::isfinite(out.z_offset_m)) return Problem{"option-invalid", "z_offset is no number", "a height in metres", "z_offset"};
  if (auto done = take_voids(options.voids(), out); !done.ok()) return done.problem();
  if (auto done = read_nodata(options.nodata(), out); !done.ok()) return done.problem();
  if (options.has_fill_limit() && options.fill_limit() > kGreatestFillLimit_cells)
    return Problem{"option-invalid", "fill_limit=" + std::to_string(options.fill_limit()) + " is too much",
                   "0 to " + std::to_string(kGreatestFillLimit_cells) + " cells", "fill_limit"};
  const auto& choices = kPixelChoices;
  if (!options.pixels().empty() && std::find(std::begin(choices), std::end(choices), options.pixels()) == std::end(choices))
    return Problem{"option-invalid", "pixels \"" + options.pixels() + "\" is not known", "exact or lattice", "pixels"};
  if (auto done = read_bbox(options, out); !done.ok()) return done.problem();
  return out;
}

}  // namespace cordillera::raster
