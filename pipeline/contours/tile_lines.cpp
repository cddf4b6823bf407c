// The arithmetic is of whole numbers: libraries for it work in floating point, and their points could differ from machine to
// machine.
#include "pipeline/contours/tile_lines.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <optional>
#include <utility>

#include "pipeline/faces/web_mercator.h"

namespace cordillera::pipeline::contours {
namespace {

constexpr std::int32_t kPixel = kExtent / faces::kTilePixels;

/// Halves go up, wherever in the grid a line lies.
std::int32_t unit(double pixels) { return static_cast<std::int32_t>(std::floor(pixels * kPixel + 0.5)); }

TileLine rounded(const raster::HeightLine& line, std::int32_t reach) {
  TileLine out;
  for (const raster::GridPlace& place : line.places) {
    const TilePoint point{unit(place.column - reach + 0.5), unit(place.row - reach + 0.5)};
    if (out.empty() || out.back() != point) out.push_back(point);
  }
  return out;
}

/// Both ends of a segment across a side are half a pixel from it at most.
bool at_a_side(const TilePoint& p) {
  const auto near = [](std::int32_t at) { return at <= kPixel / 2 || at >= kExtent - kPixel / 2; };
  return near(p.x) || near(p.y);
}

/// Whether p is farther than a unit from the segment.
bool far_from(const TilePoint& p, const TilePoint& a, const TilePoint& b) {
  const std::int64_t x = b.x - a.x, y = b.y - a.y, px = p.x - a.x, py = p.y - a.y;
  const std::int64_t along = px * x + py * y, square = x * x + y * y;
  if (along <= 0) return px * px + py * py > 1;
  if (along >= square) return (p.x - b.x) * std::int64_t{p.x - b.x} + (p.y - b.y) * std::int64_t{p.y - b.y} > 1;
  const std::int64_t across = px * y - py * x;
  return across * across > square;
}

/// How far p is from the line through two points, times their distance; from the point where they are one.
std::int64_t distance(const TilePoint& p, const TilePoint& a, const TilePoint& b) {
  const std::int64_t x = b.x - a.x, y = b.y - a.y, px = p.x - a.x, py = p.y - a.y;
  return x == 0 && y == 0 ? px * px + py * py : std::abs(px * y - py * x);
}

/// Marks what stays between two points that do.
void mark(const TileLine& line, std::size_t from, std::size_t to, std::vector<bool>& stays) {
  std::vector<std::pair<std::size_t, std::size_t>> open = {{from, to}};
  while (!open.empty()) {
    const auto [first, last] = open.back();
    open.pop_back();
    std::size_t farthest = first;
    std::int64_t most = -1;
    bool far = false;
    for (std::size_t k = first + 1; k < last; ++k) {
      far = far || far_from(line[k], line[first], line[last]);
      const std::int64_t d = distance(line[k], line[first], line[last]);
      if (d > most) most = d, farthest = k;
    }
    if (!far) continue;
    stays[farthest] = true;
    open.emplace_back(first, farthest);
    open.emplace_back(farthest, last);
  }
}

/// The nearest whole number to a quotient of positive divisor; halves go up.
std::int64_t nearest(std::int64_t dividend, std::int64_t divisor) {
  const std::int64_t twice = 2 * dividend + divisor;
  return twice / (2 * divisor) - (twice % (2 * divisor) < 0 ? 1 : 0);
}

using Segment = std::array<TilePoint, 2>;

/// The part of a segment on one side of a line x = at or y = at: sign 1 keeps what is greater, -1 what is less.
std::optional<Segment> cut(Segment s, std::int32_t TilePoint::*axis, std::int32_t at, int sign) {
  const auto outside = [&](const TilePoint& p) { return sign * (p.*axis - at) < 0; };
  if (outside(s[0]) && outside(s[1])) return std::nullopt;
  if (outside(s[0]) == outside(s[1])) return s;
  std::int32_t TilePoint::*const other = axis == &TilePoint::x ? &TilePoint::y : &TilePoint::x;
  const auto [low, high] =
      s[0].*axis < s[1].*axis ? std::pair(s[0], s[1]) : std::pair(s[1], s[0]);  // the same bits in either direction
  TilePoint p;
  p.*axis = at;
  const std::int64_t rise = std::int64_t{high.*other - low.*other} * (at - low.*axis);
  p.*other = low.*other + static_cast<std::int32_t>(nearest(rise, high.*axis - low.*axis));
  s[outside(s[0]) ? 0 : 1] = p;
  return s;
}

std::optional<Segment> within(const Segment& segment, std::int32_t margin) {
  std::optional<Segment> s = segment;
  for (const auto axis : {&TilePoint::x, &TilePoint::y}) {
    if (s) s = cut(*s, axis, -margin, 1);
    if (s) s = cut(*s, axis, kExtent + margin, -1);
  }
  return s;
}

bool touches_tile(const TileLine& line) { return !clipped(line, 0).empty(); }

}  // namespace

TileLine simplified(const TileLine& line) {
  if (line.size() < 3) return line;
  std::vector<bool> stays(line.size());
  std::size_t before = 0;
  for (std::size_t k = 0; k < line.size(); ++k) {
    if (k != 0 && k + 1 != line.size() && !at_a_side(line[k])) continue;
    stays[k] = true;
    mark(line, before, k, stays);
    before = k;
  }
  TileLine out;
  for (std::size_t k = 0; k < line.size(); ++k) {
    if (stays[k] && (out.empty() || out.back() != line[k])) out.push_back(line[k]);
  }
  return out;
}

std::vector<TileLine> clipped(const TileLine& line, std::int32_t margin) {
  std::vector<TileLine> parts;
  bool goes_on = false;
  for (std::size_t k = 0; k + 1 < line.size(); ++k) {
    const auto inside = within({line[k], line[k + 1]}, margin);
    if (!inside || (*inside)[0] == (*inside)[1]) {
      goes_on = goes_on && inside && (*inside)[1] == line[k + 1];
      continue;
    }
    if (!goes_on || parts.back().back() != (*inside)[0]) parts.push_back({(*inside)[0]});
    parts.back().push_back((*inside)[1]);
    goes_on = (*inside)[1] == line[k + 1];
  }
  return parts;
}

std::vector<Contour> tile_lines(const std::vector<raster::HeightLine>& lines, std::int32_t reach) {
  std::vector<Contour> out;
  bool shown = false;
  for (const raster::HeightLine& line : lines) {
    for (TileLine& part : clipped(simplified(rounded(line, reach)), kBuffer)) {
      shown = shown || touches_tile(part);
      if (out.empty() || out.back().height_mm != line.height) out.push_back({line.height, {}});
      out.back().lines.push_back(std::move(part));
    }
  }
  if (!shown) out.clear();
  return out;
}

}  // namespace cordillera::pipeline::contours
