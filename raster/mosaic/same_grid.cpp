#include "raster/mosaic/same_grid.h"

#include <algorithm>
#include <cmath>

namespace cordillera::raster {
namespace {

constexpr double kApart_px = 1e-3;  // numbers in files are rounded: so far apart their pixels still are the same
constexpr double kSizeShare = 1e-6;

bool same_size(double a, double b) { return std::abs(a - b) <= kSizeShare * std::abs(a); }

}  // namespace

bool may_share_grid(const proto::Source& a, const proto::Source& b) {
  constexpr double kMetresShare = 0.1;  // of pixels in degrees, which are narrower farther north
  const auto about = [](double x, double y) { return std::abs(x - y) <= kMetresShare * std::max(x, y); };
  return a.pixel() == "area" && b.pixel() == "area" && a.crs() == b.crs() && a.vertical_datum() == b.vertical_datum() &&
         a.vertical_grid() == b.vertical_grid() && about(a.pixel_height_m(), b.pixel_height_m());
}

std::optional<PixelShift> shift_on_grid(const RasterSource& a, const RasterSource& b) {
  if (a.placement().period_px() != 0 || b.placement().period_px() != 0) return std::nullopt;
  const auto &m = a.placement().pixel_to_map(), &n = b.placement().pixel_to_map();
  if (m[2] != 0 || m[4] != 0 || n[2] != 0 || n[4] != 0 || !same_size(m[1], n[1]) || !same_size(m[5], n[5])) return std::nullopt;
  double x = (n[0] - m[0]) / m[1];
  const double y = (n[3] - m[3]) / m[5], turn_px = std::abs(a.placement().turn() / m[1]);
  if (turn_px > 0) x -= turn_px * std::nearbyint(x / turn_px);  // the shorter way around
  const double whole_x = std::nearbyint(x), whole_y = std::nearbyint(y);
  if (!(std::abs(x - whole_x) <= kApart_px && std::abs(y - whole_y) <= kApart_px)) return std::nullopt;
  return PixelShift{static_cast<std::int64_t>(whole_x), static_cast<std::int64_t>(whole_y)};
}

}  // namespace cordillera::raster
