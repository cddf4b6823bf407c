#pragma once
// Which pixels of a raster come from somewhere: those under the rectangles of a VRT's sources.
#include <algorithm>
#include <cstdint>
#include <utility>
#include <vector>

namespace cordillera::raster {

class Coverage {
 public:
  /// In pixels; right and bottom are the first column and row behind it.
  struct Rectangle {
    std::int64_t left = 0, top = 0, right = 0, bottom = 0;
  };

  /// The union of the rectangles, within a raster of that size. They may overlap, and reach beyond it.
  Coverage(std::vector<Rectangle> rectangles, std::int64_t columns, std::int64_t rows);

  bool is_whole() const { return whole_; }           ///< every pixel of the raster is covered
  bool is_empty() const { return strips_.empty(); }  ///< none is
  bool touches(const Rectangle& part) const;         ///< one of the part's pixels is covered

  /// Calls gap(row, first column, first column behind) for the runs of pixels of the part that are not covered, by rows.
  template <class Gap>
  void each_gap(const Rectangle& part, const Gap& gap) const {
    std::int64_t y = part.top;
    for (auto strip = first_strip(y); y < part.bottom; ++strip) {
      const bool last = strip == strips_.end();
      for (const std::int64_t end = last ? part.bottom : std::min(strip->top, part.bottom); y < end; ++y)
        gap(y, part.left, part.right);
      if (last) return;
      for (const std::int64_t end = std::min(strip->bottom, part.bottom); y < end; ++y) {
        std::int64_t x = part.left;
        for (auto run = strip->first_run(x); run != strip->runs.end() && run->first < part.right; ++run) {
          if (x < run->first) gap(y, x, run->first);
          x = run->second;
        }
        if (x < part.right) gap(y, x, part.right);
      }
    }
  }

 private:
  using Run = std::pair<std::int64_t, std::int64_t>;  ///< a column, and the first one behind
  /// Rows that are covered alike.
  struct Strip {
    std::int64_t top = 0, bottom = 0;
    std::vector<Run> runs;  ///< from west to east, apart from each other; not empty
    std::vector<Run>::const_iterator first_run(std::int64_t x) const;
  };
  /// The first that ends below the row.
  std::vector<Strip>::const_iterator first_strip(std::int64_t row) const;

  std::vector<Strip> strips_;  ///< from north to south, without those that nothing covers
  bool whole_ = false;
};

}  // namespace cordillera::raster
