#include "raster/gdal/height_lines.h"

#include <gdal_alg.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <stdexcept>
#include <type_traits>

namespace cordillera::raster {
namespace {

struct Closed {
  void operator()(GDALContourGeneratorH generator) const { GDAL_CG_Destroy(generator); }
};
using Generator = std::unique_ptr<std::remove_pointer_t<GDALContourGeneratorH>, Closed>;

/// GDAL's pixels have their centres at halves.
CPLErr take(double level, int count, double* x, double* y, void* out) {
  HeightLine line{static_cast<std::int32_t>(std::lround(level)), {}};
  for (int k = 0; k < count; ++k) line.places.push_back({x[k] - 0.5, y[k] - 0.5});
  if (count > 1) static_cast<std::vector<HeightLine>*>(out)->push_back(std::move(line));
  return CE_None;
}

}  // namespace

std::vector<HeightLine> height_lines(const HeightSteps& grid, std::int32_t interval) {
  std::vector<HeightLine> lines;
  Generator generator(GDAL_CG_Create(grid.columns, grid.rows, TRUE, kNoHeightHere, interval, 0, take, &lines));
  if (!generator) throw std::runtime_error("GDAL has no contour generator");
  std::vector<double> row(static_cast<std::size_t>(grid.columns));
  for (std::size_t first = 0; first < grid.height.size(); first += row.size()) {
    std::copy_n(grid.height.begin() + static_cast<std::ptrdiff_t>(first), row.size(), row.begin());
    if (GDAL_CG_FeedLine(generator.get(), row.data()) != CE_None) throw std::runtime_error("GDAL's contour generator failed");
  }
  generator.reset();  // gives the lines that end at the lower side
  std::stable_sort(lines.begin(), lines.end(), [](const HeightLine& a, const HeightLine& b) { return a.height < b.height; });
  return lines;
}

}  // namespace cordillera::raster
