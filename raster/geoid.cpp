#include "raster/geoid.h"

#include <GeographicLib/Geoid.hpp>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <fstream>
#include <sstream>

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

/// Largest part of a grid held in memory (two bytes a point); beyond it GeographicLib reads from the file.
constexpr double kMaxCachedPoints = 16e6;

class PgmGeoid : public Geoid {
 public:
  PgmGeoid(const fs::path& path, const Area& area) : geoid_(path.stem().string(), path.parent_path().string(), true, false) {
    const double points_a_degree2 = 1 / (step_deg(path) * step_deg(path));
    const double width_deg = std::min(360.0, area.east_deg - area.west_deg + 1);
    if (width_deg * (area.north_deg - area.south_deg + 1) * points_a_degree2 > kMaxCachedPoints) return;
    const double south = std::max(-90.0, area.south_deg - 0.1), north = std::min(90.0, area.north_deg + 0.1);
    geoid_.CacheArea(south, width_deg >= 359 ? 0 : area.west_deg - 0.1, north, width_deg >= 359 ? 360 : area.east_deg + 0.1);
  }
  double undulation_m(double latitude_deg, double longitude_deg) const override { return geoid_(latitude_deg, longitude_deg); }

  /// Points are read from the file's size: width is twice the rows less one, two bytes each.
  static double step_deg(const fs::path& path) {
    std::error_code error;
    const double points = static_cast<double>(fs::file_size(path, error)) / 2;
    return error || points < 4 ? 1 : 360 / std::sqrt(2 * points);
  }

 private:
  GeographicLib::Geoid geoid_;
};

/// GeographicLib stretches any PGM over the globe without a word; a regional one would give wrong heights.
bool covers_the_globe(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  long columns = 0, rows = 0;
  if (!std::getline(file, line) || line.substr(0, 2) != "P5") return false;
  bool origin = false;
  while (std::getline(file, line)) {
    if (line.find("# Origin 90N 0E") == 0) origin = true;
    if (line.empty() || line[0] == '#') continue;
    std::istringstream(line) >> columns >> rows;
    break;
  }
  return origin && columns > 0 && columns == 2 * (rows - 1);
}

}  // namespace

proto::Result<std::unique_ptr<Geoid>> open_geoid_pgm(const std::string& path, const Area& area) {
  const std::string name = fs::path(path).filename().string();
  if (!covers_the_globe(path))
    return Problem{"geoid-invalid", "the PGM " + name + " is no global geoid grid of GeographicLib (Origin 90N 0E, twice as wide as high)",
                   "a global PGM, or a regional grid as GTX or GeoTIFF", "vertical_datum"};
  try {
    return std::unique_ptr<Geoid>(new PgmGeoid(path, area));
  } catch (const std::exception& error) {  // GeographicLib speaks in exceptions: they end here
    return Problem{"geoid-invalid", "the geoid grid " + name + " cannot be read: " + error.what(), "a complete GeographicLib PGM", "vertical_datum"};
  }
}

}  // namespace cordillera::raster
