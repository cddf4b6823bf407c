// Fills of punched holes in elevation models, compared with what was there:  voids_bench DEM...
#include <gdal_alg.h>
#include <gdal_priv.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <random>
#include <string>

#include "raster/voids/void_spline.h"
#include "tests/bench/voids/eight_directions.h"

namespace cordillera::bench {
namespace {

struct Grid {
  int columns = 0, rows = 0;
  std::vector<double> height_m;  ///< NaN: none
  double& at(int x, int y) {
    return height_m[static_cast<std::size_t>(y) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(x)];
  }
  bool is_void(int x, int y) { return std::isnan(at(x, y)); }
};

Grid read(const std::string& path) {
  const GDALDatasetUniquePtr dataset(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER));
  if (!dataset) throw std::runtime_error(path + " cannot be opened");
  Grid grid{dataset->GetRasterXSize(), dataset->GetRasterYSize(), {}};
  grid.height_m.resize(static_cast<std::size_t>(grid.columns) * static_cast<std::size_t>(grid.rows));
  GDALRasterBand* band = dataset->GetRasterBand(1);
  if (band->RasterIO(GF_Read, 0, 0, grid.columns, grid.rows, grid.height_m.data(), grid.columns, grid.rows, GDT_Float64, 0, 0,
                     nullptr) != CE_None)
    throw std::runtime_error(path + " cannot be read");
  int has = 0;
  const double nodata = band->GetNoDataValue(&has);
  for (double& h : grid.height_m)
    if (!std::isfinite(h) || (has != 0 && std::abs(h - nodata) <= 1e-6 * std::abs(nodata))) h = NAN;
  return grid;
}

/// Holes of some size, each of four ellipses beside each other. The same in every run.
Grid punched(const Grid& whole, int size) {
  Grid grid = whole;
  std::mt19937 random(7);
  const auto share = [&] { return static_cast<double>(random() % 100) / 100; };
  const int holes = std::clamp(static_cast<int>(double{1} * grid.columns * grid.rows / (16.0 * size * size)), 1, 400);
  for (int k = 0; k < holes; ++k) {
    const double cx = share() * grid.columns, cy = share() * grid.rows;
    for (int e = 0; e < 4; ++e) {
      const double x0 = cx + (share() - 0.5) * size / 2, y0 = cy + (share() - 0.5) * size / 2;
      const double ra = size * (0.15 + 0.2 * share()), rb = size * (0.15 + 0.2 * share());
      if (cx < size || cy < size || cx > grid.columns - size || cy > grid.rows - size)
        continue;  // inside, so that there is a rim
      for (int y = static_cast<int>(y0 - rb); y <= y0 + rb; ++y)
        for (int x = static_cast<int>(x0 - ra); x <= x0 + ra; ++x)
          if (x > 1 && y > 1 && x < grid.columns - 2 && y < grid.rows - 2 && std::hypot((x - x0) / ra, (y - y0) / rb) < 1)
            grid.at(x, y) = NAN;
    }
  }
  return grid;
}

/// GDALFillNodata as gdal_fillnodata calls it, with a distance that reaches across.
Grid gdal_filled(Grid grid, int smoothing) {
  GDALDriver* memory = GetGDALDriverManager()->GetDriverByName("MEM");
  const GDALDatasetUniquePtr heights(memory->Create("", grid.columns, grid.rows, 1, GDT_Float32, nullptr)),
      mask(memory->Create("", grid.columns, grid.rows, 1, GDT_Byte, nullptr));
  std::vector<double> values = grid.height_m, valid;
  for (double& h : values) {
    valid.push_back(std::isnan(h) ? 0 : 255);
    if (std::isnan(h)) h = 0;
  }
  const auto move = [&](GDALRWFlag way, GDALDataset& dataset, std::vector<double>& data) {
    if (dataset.GetRasterBand(1)->RasterIO(way, 0, 0, grid.columns, grid.rows, data.data(), grid.columns, grid.rows, GDT_Float64,
                                           0, 0, nullptr) != CE_None)
      throw std::runtime_error("no memory");
  };
  move(GF_Write, *heights, values);
  move(GF_Write, *mask, valid);
  if (GDALFillNodata(heights->GetRasterBand(1), mask->GetRasterBand(1), 400, 0, smoothing, nullptr, nullptr, nullptr) != CE_None)
    throw std::runtime_error("GDALFillNodata failed");
  move(GF_Read, *heights, grid.height_m);
  return grid;
}

/// Each void that does not reach the rim, as raster/voids/void_map does it.
Grid spline_filled(Grid grid) {
  std::vector<bool> seen(grid.height_m.size(), false);
  Grid out = grid;
  struct Cell {
    int x, y;
  };
  for (int y0 = 0; y0 < grid.rows; ++y0) {
    for (int x0 = 0; x0 < grid.columns; ++x0) {
      std::vector<Cell> cells, ahead{{x0, y0}};
      int west = x0, east = x0, north = y0, south = y0;
      while (!ahead.empty()) {
        const Cell c = ahead.back();
        ahead.pop_back();
        if (c.x < 0 || c.y < 0 || c.x >= grid.columns || c.y >= grid.rows || !grid.is_void(c.x, c.y)) continue;
        const std::size_t at =
            static_cast<std::size_t>(c.y) * static_cast<std::size_t>(grid.columns) + static_cast<std::size_t>(c.x);
        if (seen[at]) continue;
        seen[at] = true;
        cells.push_back(c);
        west = std::min(west, c.x), east = std::max(east, c.x), north = std::min(north, c.y), south = std::max(south, c.y);
        for (const Cell& n : {Cell{c.x - 1, c.y}, Cell{c.x + 1, c.y}, Cell{c.x, c.y - 1}, Cell{c.x, c.y + 1}}) ahead.push_back(n);
      }
      if (cells.empty() || west == 0 || north == 0 || east == grid.columns - 1 || south == grid.rows - 1) continue;
      raster::VoidGrid around(east - west + 5, south - north + 5);
      for (int y = 0; y < around.rows; ++y) {
        for (int x = 0; x < around.columns; ++x) {
          const int gx = west - 2 + x, gy = north - 2 + y;
          if (gx < 0 || gy < 0 || gx >= grid.columns || gy >= grid.rows || grid.is_void(gx, gy)) continue;
          around.cell[around.at(x, y)] = raster::VoidGrid::known;
          around.height_m[around.at(x, y)] = grid.at(gx, gy);
        }
      }
      for (const Cell& c : cells) around.cell[around.at(c.x - west + 2, c.y - north + 2)] = raster::VoidGrid::wanted;
      raster::fill_spline(around);
      for (const Cell& c : cells) out.at(c.x, c.y) = around.height_m[around.at(c.x - west + 2, c.y - north + 2)];
    }
  }
  return out;
}

void compare(const std::string& path, int size) {
  const Grid whole = read(path);
  if (std::min(whole.columns, whole.rows) < 3 * size) return;
  const Grid holed = punched(whole, size);
  Grid eight = holed;
  fill_from_eight_directions(eight.height_m, eight.columns, eight.rows);
  const auto start = std::chrono::steady_clock::now();
  const Grid spline = spline_filled(holed);
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  const Grid fills[] = {eight, gdal_filled(holed, 0), gdal_filled(holed, 3), spline};
  std::size_t pixels = 0;
  double squares[4] = {};
  for (std::size_t k = 0; k < whole.height_m.size(); ++k) {
    // What was there, and what all of them fill.
    if (!std::isnan(holed.height_m[k]) || std::isnan(whole.height_m[k])) continue;
    if (std::any_of(std::begin(fills), std::end(fills), [&](const Grid& fill) { return std::isnan(fill.height_m[k]); })) continue;
    ++pixels;
    for (int f = 0; f < 4; ++f) squares[f] += std::pow(fills[f].height_m[k] - whole.height_m[k], 2);
  }
  if (pixels == 0) return;
  std::printf("| `%s` | %d | %zu |", path.substr(path.rfind('/') + 1).c_str(), size, pixels);
  for (const double sum : squares) std::printf(" %.3f |", std::sqrt(sum / static_cast<double>(pixels)));
  std::printf(" %.2f |\n", seconds);
}

}  // namespace
}  // namespace cordillera::bench

int main(int count, char** arguments) {
  GDALAllRegister();
  std::printf(
      "| raster | holes, pixels | pixels filled | eight directions | GDALFillNodata | GDALFillNodata, 3 × smoothed | spline | s "
      "|\n");
  std::printf("|---|---|---|---|---|---|---|---|\n");
  try {
    for (int k = 1; k < count; ++k)
      for (const int size : {6, 20, 60, 150, 280}) cordillera::bench::compare(arguments[k], size);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
}
