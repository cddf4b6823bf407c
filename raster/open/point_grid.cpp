#include "raster/open/point_grid.h"

#include <gdal_priv.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <vector>

#include "raster/disk/free_space.h"
#include "raster/open/point_lines.h"
#include "raster/storage/storage.h"

namespace cordillera::raster {
namespace {

using proto::Problem;

constexpr const char* kCreate[] = {"TILED=YES", "BIGTIFF=IF_SAFER", nullptr};

/// Cells of a grid, by row from the north and column, of which a file has a point; empty: of all of them, or
/// a line says no place in the grid.
std::vector<bool> cells_with_points(GDALDataset& grid, const std::string& path) {
  std::array<double, 6> place{};
  if (is_remote(path) || grid.GetGeoTransform(place.data()) != CE_None) return {};
  const auto columns = static_cast<std::size_t>(grid.GetRasterXSize()), rows = static_cast<std::size_t>(grid.GetRasterYSize());
  std::vector<bool> seen(columns * rows);
  std::size_t count = 0;
  const auto see = [&](double x, double y) {
    const double column = std::floor((x - place[0]) / place[1]), row = std::floor((y - place[3]) / place[5]);
    if (!(column >= 0 && row >= 0 && column < static_cast<double>(columns) && row < static_cast<double>(rows))) return false;
    auto cell = seen[static_cast<std::size_t>(row) * columns + static_cast<std::size_t>(column)];
    count += cell ? 0 : 1;
    cell = true;
    return true;
  };
  if (!each_point(path, see) || count == seen.size()) return {};
  return seen;
}

/// A copy in which the other cells are NaN.
bool copy_with_gaps(GDALDataset& from, const std::vector<bool>& seen, GDALDriver& tiff, const std::string& to) {
  const int columns = from.GetRasterXSize(), rows = from.GetRasterYSize();
  const GDALDatasetUniquePtr made(tiff.Create(to.c_str(), columns, rows, 1, GDT_Float64, const_cast<char**>(kCreate)));
  std::array<double, 6> place{};
  if (!made || from.GetGeoTransform(place.data()) != CE_None || made->SetGeoTransform(place.data()) != CE_None) return false;
  GDALRasterBand* const band = made->GetRasterBand(1);
  if (band->SetNoDataValue(std::numeric_limits<double>::quiet_NaN()) != CE_None) return false;
  std::vector<double> line(static_cast<std::size_t>(columns));
  for (int row = 0; row < rows; ++row) {
    if (from.GetRasterBand(1)->RasterIO(GF_Read, 0, row, columns, 1, line.data(), columns, 1, GDT_Float64, 0, 0) != CE_None)
      return false;
    const std::size_t first = static_cast<std::size_t>(row) * line.size();
    for (std::size_t column = 0; column < line.size(); ++column)
      if (!seen[first + column]) line[column] = std::numeric_limits<double>::quiet_NaN();
    if (band->RasterIO(GF_Write, 0, row, columns, 1, line.data(), columns, 1, GDT_Float64, 0, 0) != CE_None) return false;
  }
  return true;
}

bool copy_as_it_is(GDALDataset& from, GDALDriver& tiff, const std::string& to) {
  return GDALDatasetUniquePtr(tiff.CreateCopy(to.c_str(), &from, FALSE, const_cast<char**>(kCreate), nullptr, nullptr)) !=
         nullptr;
}

}  // namespace

std::optional<Problem> write_point_grid(const std::string& path, const std::string& name, const std::string& to,
                                        const GdalScope& scope) {
  const char* const only[] = {"XYZ", nullptr};
  const GDALDatasetUniquePtr from(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, only, nullptr, nullptr));
  // As large as its numbers, whatever type they get.
  const auto bytes = from ? sizeof(double) * static_cast<std::uint64_t>(from->GetRasterXSize()) *
                                static_cast<std::uint64_t>(from->GetRasterYSize())
                          : 0;
  if (auto full = no_room(to, bytes, "a grid of the points of " + name)) return full;
  GDALDriver* const tiff = GetGDALDriverManager()->GetDriverByName("GTiff");
  int says_nodata = 0;
  if (from) from->GetRasterBand(1)->GetNoDataValue(&says_nodata);
  const std::vector<bool> seen = from && says_nodata == 0 ? cells_with_points(*from, path) : std::vector<bool>();
  const bool copied =
      from && tiff != nullptr && (seen.empty() ? copy_as_it_is(*from, *tiff, to) : copy_with_gaps(*from, seen, *tiff, to));
  if (copied && !scope.failed()) return std::nullopt;
  return Problem{"raster-unreadable", name + " is damaged: its points cannot be read (" + scope.message(path, name) + ")",
                 "a complete, undamaged file", ""};
}

}  // namespace cordillera::raster
