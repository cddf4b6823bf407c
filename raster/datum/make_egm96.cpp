// EGM96 must always work, and Debian ships no GeographicLib grid. PROJ's package carries the same 15' grid as GTX, or as
// GeoTIFF where it has PROJ's newer grids: a step of the build rewrites it, so that a service has nothing to make that its jobs
// could change for one another.
//   make_egm96 OUTPUT
#include <gdal_priv.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;

constexpr double kOffset_m = -108, kScale_m = 0.003;

std::string find_grid() {
  std::vector<fs::path> folders;
  for (const char* name : {"PROJ_DATA", "PROJ_LIB"})
    if (const char* folder = std::getenv(name)) folders.emplace_back(folder);
  folders.insert(folders.end(), {"/usr/share/proj", "/usr/local/share/proj"});
  std::error_code error;
  for (const fs::path& folder : folders)
    for (const char* name : {"egm96_15.gtx", "us_nga_egm96_15.tif"})
      if (fs::is_regular_file(folder / name, error)) return (folder / name).string();
  return "";
}

struct Grid {
  int rows = 0, columns = 0;
  int greenwich = 0;            ///< its column
  std::vector<float> height_m;  ///< from the north pole, row by row
};

/// False unless it is the whole globe, as GeographicLib wants it.
bool read_grid(const std::string& path, Grid& grid) {
  GDALAllRegister();
  const char* const allowed[] = {"GTX", "GTiff", nullptr};
  const GDALDatasetUniquePtr file(GDALDataset::Open(path.c_str(), GDAL_OF_RASTER | GDAL_OF_READONLY, allowed));
  std::array<double, 6> g{};
  if (!file || file->GetGeoTransform(g.data()) != CE_None || file->GetRasterCount() != 1) return false;
  grid.columns = file->GetRasterXSize(), grid.rows = file->GetRasterYSize();
  const double step = g[1], north = g[3] + g[5] / 2, west = g[0] + step / 2;
  const bool global = grid.columns % 2 == 0 && grid.rows == grid.columns / 2 + 1 && std::abs(step * grid.columns - 360) < 1e-9 &&
                      std::abs(step + g[5]) < 1e-12 && std::abs(north - 90) < 1e-9;
  if (!global) return false;
  grid.greenwich = static_cast<int>(std::lround((0 - west) / step));
  grid.height_m.resize(static_cast<std::size_t>(grid.rows) * grid.columns);
  return file->GetRasterBand(1)->RasterIO(GF_Read, 0, 0, grid.columns, grid.rows, grid.height_m.data(), grid.columns, grid.rows,
                                          GDT_Float32, 0, 0, nullptr) == CE_None;
}

std::string pgm_of(const Grid& grid) {
  std::string out =
      "P5\n# Geoid file in PGM format for the GeographicLib::Geoid class\n"
      "# Description WGS84 EGM96, 15-minute grid\n# Source PROJ egm96_15.gtx, rewritten by Cordillera\n# Offset -108\n# Scale "
      "0.003\n# Origin 90N 0E\n"
      "# AREA_OR_POINT Point\n# Vertical_Datum WGS84\n" +
      std::to_string(grid.columns) + " " + std::to_string(grid.rows) + "\n65535\n";
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.columns; ++c) {
      const int from = ((c + grid.greenwich) % grid.columns + grid.columns) % grid.columns;
      const double height = grid.height_m[static_cast<std::size_t>(r) * grid.columns + from];
      const auto step = static_cast<std::uint16_t>(std::lround((height - kOffset_m) / kScale_m));
      out += static_cast<char>(step >> 8);
      out += static_cast<char>(step & 255);
    }
  }
  return out;
}

int fail(const std::string& why) {
  std::cerr << "make_egm96: " << why << "\n";
  return 1;
}

}  // namespace

int main(int count, char** words) {
  if (count != 2) return fail("the file to write is missing");
  const std::string given = find_grid();
  if (given.empty())
    return fail(
        "neither egm96_15.gtx nor us_nga_egm96_15.tif is there; they come with the package proj-data (or set PROJ_DATA to its "
        "folder)");
  Grid grid;
  if (!read_grid(given, grid)) return fail(given + " is no global grid that GDAL can read");
  const std::string pgm = pgm_of(grid), draft = std::string(words[1]) + ".draft";
  std::ofstream file(draft, std::ios::binary | std::ios::trunc);
  file.write(pgm.data(), static_cast<std::streamsize>(pgm.size()));
  file.close();
  std::error_code error;
  if (file) fs::rename(draft, words[1], error);
  return file && !error ? 0 : fail(std::string("cannot write ") + words[1]);
}
