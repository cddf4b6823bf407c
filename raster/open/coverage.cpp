#include "raster/open/coverage.h"

#include <algorithm>

namespace cordillera::raster {

Coverage::Coverage(std::vector<Rectangle> rectangles, std::int64_t columns, std::int64_t rows) {
  std::vector<std::int64_t> edges;  // rows at which another rectangle begins or ends
  for (Rectangle& r : rectangles) {
    r = {std::max<std::int64_t>(r.left, 0), std::max<std::int64_t>(r.top, 0), std::min(r.right, columns),
         std::min(r.bottom, rows)};
    if (r.left < r.right && r.top < r.bottom) edges.insert(edges.end(), {r.top, r.bottom});
  }
  std::erase_if(rectangles, [](const Rectangle& r) { return r.left >= r.right || r.top >= r.bottom; });
  std::sort(edges.begin(), edges.end());
  edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
  std::sort(rectangles.begin(), rectangles.end(), [](const Rectangle& a, const Rectangle& b) { return a.top < b.top; });
  std::vector<Rectangle> open;  // those that reach into the strip
  auto next = rectangles.begin();
  for (std::size_t k = 0; k + 1 < edges.size(); ++k) {
    std::erase_if(open, [&](const Rectangle& r) { return r.bottom <= edges[k]; });
    for (; next != rectangles.end() && next->top == edges[k]; ++next) {
      const auto before = [](const Rectangle& a, const Rectangle& b) { return a.left < b.left; };
      open.insert(std::upper_bound(open.begin(), open.end(), *next, before), *next);
    }
    Strip strip{edges[k], edges[k + 1], {}};
    for (const Rectangle& r : open) {
      if (strip.runs.empty() || strip.runs.back().second < r.left)
        strip.runs.emplace_back(r.left, r.right);
      else
        strip.runs.back().second = std::max(strip.runs.back().second, r.right);
    }
    if (strip.runs.empty()) continue;
    if (!strips_.empty() && strips_.back().bottom == strip.top && strips_.back().runs == strip.runs)
      strips_.back().bottom = strip.bottom;
    else
      strips_.push_back(std::move(strip));
  }
  whole_ = strips_.size() == 1 && strips_[0].top == 0 && strips_[0].bottom == rows &&
           strips_[0].runs == std::vector<Run>{{0, columns}};
}

std::vector<Coverage::Run>::const_iterator Coverage::Strip::first_run(std::int64_t x) const {
  return std::partition_point(runs.begin(), runs.end(), [x](const Run& run) { return run.second <= x; });
}

std::vector<Coverage::Strip>::const_iterator Coverage::first_strip(std::int64_t row) const {
  return std::partition_point(strips_.begin(), strips_.end(), [row](const Strip& strip) { return strip.bottom <= row; });
}

bool Coverage::touches(const Rectangle& part) const {
  for (auto strip = first_strip(part.top); strip != strips_.end() && strip->top < part.bottom; ++strip) {
    const auto run = strip->first_run(part.left);
    if (run != strip->runs.end() && run->first < part.right) return true;
  }
  return false;
}

}  // namespace cordillera::raster
