// Geoid grids that GDAL reads. The part under the data is held in memory.
#include <gdal_priv.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <vector>

#include "raster/datum/geoid.h"
#include "raster/gdal/gdal_scope.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

constexpr double kSlack_px = 1e-6;
constexpr std::int64_t kMostGridPoints = 64'000'000;

struct GridFrame {
  double west_deg = 0, north_deg = 0, step_lon_deg = 0,
         step_lat_deg = 0;  ///< centre of the first point; step_lat is negative southward
  int columns = 0, rows = 0;
  int period = 0;  ///< columns around the earth, 0 for a regional grid

  /// Column of a longitude, within half a turn of the grid's middle.
  double column(double longitude_deg) const {
    const double middle = west_deg + step_lon_deg * (columns - 1) / 2;
    const double lon = longitude_deg - 360 * std::floor((longitude_deg - middle) / 360 + 0.5);
    return (lon - west_deg) / step_lon_deg;
  }
  double row(double latitude_deg) const { return (latitude_deg - north_deg) / step_lat_deg; }
};

class GridGeoid : public Geoid {
 public:
  GridFrame frame;
  int x0 = 0, y0 = 0, columns = 0, rows = 0;  ///< the part in memory
  std::vector<float> height_m;

  double undulation_m(double latitude_deg, double longitude_deg) const override {
    const double y = std::clamp(frame.row(latitude_deg), double(y0), double(y0 + rows - 1));
    double x = frame.column(longitude_deg);
    if (frame.period == 0) x = std::clamp(x, double(x0), double(x0 + columns - 1));
    const double cx = std::floor(x), cy = std::min(std::floor(y), std::max(double(y0), y0 + rows - 2.0));
    const double fx = x - cx, fy = y - cy;
    const int below = rows > 1 ? 1 : 0;
    const double north = at(cx, cy) + fx * (at(cx + 1, cy) - at(cx, cy));
    const double south = at(cx, cy + below) + fx * (at(cx + 1, cy + below) - at(cx, cy + below));
    return north + fy * (south - north);
  }

 private:
  double at(double column, double row) const {
    auto c = static_cast<int>(column);
    if (frame.period != 0) c = ((c % frame.period) + frame.period) % frame.period;
    c = std::clamp(c - x0, 0, columns - 1);
    return height_m[static_cast<std::size_t>(static_cast<int>(row) - y0) * columns + c];
  }
};

proto::Result<GridFrame> frame_of(GDALDataset& grid, const std::string& name) {
  std::array<double, 6> g{};
  const bool placed = grid.GetGeoTransform(g.data()) == CE_None && g[2] == 0 && g[4] == 0 && g[1] > 0 && g[5] != 0;
  const OGRSpatialReference* srs = grid.GetSpatialRef();
  if (!placed || grid.GetRasterCount() < 1 || (srs != nullptr && !srs->IsGeographic() && !srs->IsCompound()) ||
      std::abs(g[3]) > 95 || std::abs(g[0]) > 540)
    return Problem{"geoid-invalid", "the geoid grid " + name + " is not in degrees of longitude and latitude",
                   "a GTX or GeoTIFF grid in a geographic CRS", "vertical_datum"};
  GridFrame frame;
  frame.columns = grid.GetRasterXSize();
  frame.rows = grid.GetRasterYSize();
  frame.step_lon_deg = g[1];
  frame.step_lat_deg = g[5];
  frame.west_deg = g[0] + g[1] / 2;
  frame.north_deg = g[3] + g[5] / 2;
  const double around = 360 / g[1];
  if (std::abs(around - std::round(around)) < 0.05 && frame.columns + 0.05 >= around)
    frame.period = static_cast<int>(std::round(around));
  return frame;
}

/// The part of the grid under the area; false where it does not reach. At a pole half a step may be missing.
bool place_part(GridGeoid& geoid, const Area& area) {
  const GridFrame& f = geoid.frame;
  const double a = f.row(area.north_deg), b = f.row(area.south_deg);
  double top = std::min(a, b), bottom = std::max(a, b);
  const bool north_pole = area.north_deg > 89.99, south_pole = area.south_deg < -89.99;
  const double slack = north_pole || south_pole ? 0.5 + kSlack_px : kSlack_px;
  if (top < -slack || bottom > f.rows - 1 + slack) return false;
  geoid.y0 = std::max(0, static_cast<int>(std::floor(top + kSlack_px)));
  geoid.rows = std::min(f.rows - 1, static_cast<int>(std::ceil(bottom - kSlack_px))) - geoid.y0 + 1;
  if (f.period != 0) {
    geoid.x0 = 0;
    geoid.columns = f.period;
    return geoid.rows > 0;
  }
  const double left = f.column(area.west_deg), right = left + (area.east_deg - area.west_deg) / f.step_lon_deg;
  if (left < -kSlack_px || right > f.columns - 1 + kSlack_px) return false;
  geoid.x0 = std::max(0, static_cast<int>(std::floor(left + kSlack_px)));
  geoid.columns = std::min(f.columns - 1, static_cast<int>(std::ceil(right - kSlack_px))) - geoid.x0 + 1;
  return geoid.rows > 0 && geoid.columns > 0;
}

}  // namespace

Problem geoid_does_not_cover(const std::string& name, const Area& area) {
  char place[128];
  std::snprintf(place, sizeof place, "%.4f..%.4f E, %.4f..%.4f N", area.west_deg, area.east_deg, area.south_deg, area.north_deg);
  return {"geoid-does-not-cover", "the geoid grid " + name + " does not cover the elevation model (" + place + ")",
          "a grid that covers it, EGM96, EGM2008, EGM84 or ellipsoid", "vertical_datum"};
}

proto::Result<std::unique_ptr<Geoid>> open_geoid_grid(const std::string& path, const Area& area) {
  const GdalScope scope(Trust::operator_file);
  const std::string name = std::filesystem::path(path).filename().string();
  const char* const allowed[] = {"GTiff", "GTX", nullptr};
  const GDALDatasetUniquePtr grid(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, allowed, nullptr, nullptr));
  if (!grid)
    return Problem{"geoid-invalid", "the geoid grid " + name + " cannot be opened: " + scope.message(path, name),
                   "a GTX, GeoTIFF or GeographicLib PGM grid", "vertical_datum"};
  auto frame = frame_of(*grid, name);
  if (!frame) return frame.problem();
  auto geoid = std::make_unique<GridGeoid>();
  geoid->frame = *frame;
  if (!place_part(*geoid, area)) return geoid_does_not_cover(name, area);
  if (std::int64_t{geoid->columns} * geoid->rows > kMostGridPoints)
    return Problem{"geoid-invalid", "the geoid grid " + name + " has more than 64 million points under the data",
                   "a coarser grid", "vertical_datum"};
  geoid->height_m.resize(static_cast<std::size_t>(geoid->columns) * geoid->rows);
  GDALRasterBand* band = grid->GetRasterBand(1);
  if (band->RasterIO(GF_Read, geoid->x0, geoid->y0, geoid->columns, geoid->rows, geoid->height_m.data(), geoid->columns,
                     geoid->rows, GDT_Float32, 0, 0, nullptr) != CE_None)
    return Problem{"geoid-invalid", "the geoid grid " + name + " is damaged: " + scope.message(path, name), "a complete grid",
                   "vertical_datum"};
  int has_nodata = 0;
  const auto nodata = static_cast<float>(band->GetNoDataValue(&has_nodata));
  // No geoid rises or falls more than about 110 m; -88.8888 is GTX's own void.
  for (const float h : geoid->height_m)
    if (!(std::abs(h) < 200) || (has_nodata != 0 && h == nodata)) return geoid_does_not_cover(name, area);
  return std::unique_ptr<Geoid>(std::move(geoid));
}

}  // namespace cordillera::raster
