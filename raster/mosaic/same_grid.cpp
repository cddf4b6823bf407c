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
  return a.crs() == b.crs() && a.vertical_datum() == b.vertical_datum() && a.vertical_grid() == b.vertical_grid() &&
         about(a.pixel_height_m(), b.pixel_height_m());
}

PixelGrid grid_of(const RasterSource& source) {
  const auto& m = source.placement().pixel_to_map();
  if (source.placement().period_px() != 0 || m[2] != 0 || m[4] != 0) return {};
  return {m[0], m[3], m[1], m[5], source.placement().turn()};
}

std::optional<PixelShift> shift_on_grid(const PixelGrid& a, const PixelGrid& b) {
  if (a.step_x == 0 || !same_size(a.step_x, b.step_x) || !same_size(a.step_y, b.step_y)) return std::nullopt;
  double x = (b.x - a.x) / a.step_x;
  const double y = (b.y - a.y) / a.step_y, turn_px = std::abs(a.turn / a.step_x);
  if (turn_px > 0) x -= turn_px * std::nearbyint(x / turn_px);  // the shorter way around
  const double whole_x = std::nearbyint(x), whole_y = std::nearbyint(y);
  if (!(std::abs(x - whole_x) <= kApart_px && std::abs(y - whole_y) <= kApart_px)) return std::nullopt;
  return PixelShift{static_cast<std::int64_t>(whole_x), static_cast<std::int64_t>(whole_y)};
}

bool lies_within(const PixelWindow& all, const PixelShift& shift, const PixelWindow& other) {
  return shift.x >= 0 && shift.y >= 0 && shift.x + all.columns <= other.columns && shift.y + all.rows <= other.rows;
}

proto::Result<void> fill_beyond(const PixelWindow& all, const std::vector<GridNeighbour>& neighbours, const PixelWindow& window,
                                std::vector<double>& heights, const ReadPixels& read) {
  struct Rectangle {
    std::int64_t x0, y0, x1, y1;
    Rectangle within(const Rectangle& other) const {
      return {std::max(x0, other.x0), std::max(y0, other.y0), std::min(x1, other.x1), std::min(y1, other.y1)};
    }
  };
  const std::int64_t columns = all.columns, rows = all.rows, far = kMostBeyond_px;
  const Rectangle wanted = Rectangle{window.x, window.y, window.x + window.columns, window.y + window.rows}.within(
      {-far, -far, columns + far, rows + far});
  const Rectangle beyond[] = {wanted.within({-far, -far, columns + far, 0}),
                              wanted.within({-far, rows, columns + far, rows + far}), wanted.within({-far, 0, 0, rows}),
                              wanted.within({columns, 0, columns + far, rows})};
  std::vector<double> part;
  for (const GridNeighbour& next : neighbours) {
    const PixelShift at = next.shift;
    for (const Rectangle& side : beyond) {
      const Rectangle r = side.within({at.x, at.y, at.x + next.all.columns, at.y + next.all.rows});
      if (r.x0 >= r.x1 || r.y0 >= r.y1) continue;
      const PixelWindow theirs{r.x0 - at.x, r.y0 - at.y, static_cast<int>(r.x1 - r.x0), static_cast<int>(r.y1 - r.y0)};
      if (auto done = read(next.member, theirs, part); !done.ok()) return done;
      for (std::int64_t y = r.y0; y < r.y1; ++y) {
        const double* from = part.data() + static_cast<std::size_t>((y - r.y0) * theirs.columns);
        double* to = heights.data() + static_cast<std::size_t>((y - window.y) * window.columns + (r.x0 - window.x));
        for (std::int64_t x = r.x0; x < r.x1; ++x, ++from, ++to)
          if (std::isnan(*to)) *to = *from;
      }
    }
  }
  return {};
}

}  // namespace cordillera::raster
