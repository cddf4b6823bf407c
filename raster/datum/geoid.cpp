#include "raster/datum/geoid.h"

#include <GeographicLib/Geoid.hpp>

#include <algorithm>
#include <cmath>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <memory>
#include <mutex>
#include <sstream>

#include "proto/paths.h"
#include "proto/wide.h"

namespace cordillera::raster {
namespace {

namespace fs = std::filesystem;
using proto::Problem;

using Pgm = GeographicLib::Geoid;

/// Largest part of a grid held in memory (two bytes a point); beyond it GeographicLib reads from the file, a system call or two a
/// point.
constexpr double kMaxCachedPoints = 16e6;
/// Up to here a grid is in memory as a whole, and once for all who read it: EGM96 has 1,038,240 points.
constexpr double kMaxSharedPoints = 2e6;

std::unique_ptr<Pgm> read_pgm(const fs::path& path, bool whole) {
  return std::make_unique<Pgm>(path.stem().string(), path.parent_path().string(), true, whole);
}

/// The whole grid. Thread-safe, as is what it returns.
std::shared_ptr<const Pgm> shared_pgm(const fs::path& path) {
  static std::mutex mutex;
  static std::map<std::string, std::weak_ptr<const Pgm>> open;
  static std::shared_ptr<const Pgm> last;  // of many rasters that are looked at one after the other none is open between two
  // Another file may take its place while the process lives.
  const std::string name = path.string() + ' ' + std::to_string(fs::last_write_time(path).time_since_epoch().count());
  const std::lock_guard lock(mutex);
  std::shared_ptr<const Pgm> grid = open[name].lock();
  if (!grid) open[name] = grid = read_pgm(path, true);
  return last = grid;
}

/// Only what lies around an area is in memory.
std::shared_ptr<const Pgm> pgm_around(const fs::path& path, double points_a_degree, const Area& area) {
  auto grid = read_pgm(path, false);
  const double width_deg = std::min(360.0, area.east_deg - area.west_deg + 1);
  if (width_deg * (area.north_deg - area.south_deg + 1) * points_a_degree * points_a_degree > kMaxCachedPoints) return grid;
  const double south = std::max(-90.0, area.south_deg - 0.1), north = std::min(90.0, area.north_deg + 0.1);
  grid->CacheArea(south, width_deg >= 359 ? 0 : area.west_deg - 0.1, north, width_deg >= 359 ? 360 : area.east_deg + 0.1);
  return grid;
}

/// A cubic polynomial through its values at 1/8, 3/8, 5/8 and 7/8 of a cell, in Newton's form.
struct Cubic {
  double f0 = 0, d1 = 0, d2 = 0, d3 = 0;
  Cubic() = default;
  explicit Cubic(const double (&f)[4])
      : f0(f[0]), d1(f[1] - f[0]), d2((f[2] - 2 * f[1] + f[0]) / 2), d3((f[3] - 3 * (f[2] - f[1]) - f[0]) / 6) {}
};

CORDILLERA_WIDE void put_cubic(const Cubic& fit, std::span<const double> longitude_deg, double points_a_degree, double cell,
                               double* out) {
  const double f0 = fit.f0, d1 = fit.d1, d2 = fit.d2, d3 = fit.d3;
  for (std::size_t k = 0; k < longitude_deg.size(); ++k) {
    const double s = 4 * (longitude_deg[k] * points_a_degree - cell) - 0.5;
    out[k] = f0 + s * (d1 + (s - 1) * (d2 + (s - 2) * d3));
  }
}

class PgmGeoid : public Geoid {
 public:
  /// columns: points around the globe.
  PgmGeoid(const fs::path& path, long columns, const Area& area) : points_a_degree_(static_cast<double>(columns) / 360) {
    const bool small = static_cast<double>(columns) * static_cast<double>(columns / 2 + 1) <= kMaxSharedPoints;
    geoid_ = small ? shared_pgm(path) : pgm_around(path, points_a_degree_, area);
  }
  double undulation_m(double latitude_deg, double longitude_deg) const override { return (*geoid_)(latitude_deg, longitude_deg); }

  void along_parallel(double latitude_deg, std::span<const double> longitude_deg, double* out) const override {
    // Over the antimeridian they begin again in the west.
    std::size_t sorted = 0;
    for (std::size_t from = 0; from < longitude_deg.size();) {
      if (from == sorted) {
        const auto end = std::is_sorted_until(longitude_deg.begin() + static_cast<std::ptrdiff_t>(from), longitude_deg.end());
        sorted = static_cast<std::size_t>(end - longitude_deg.begin());
      }
      const double cell = std::floor(longitude_deg[from] * points_a_degree_);
      const auto rest = longitude_deg.subspan(from, sorted - from);
      const auto next =
          std::partition_point(rest.begin(), rest.end(), [&](double at) { return at * points_a_degree_ < cell + 1; });
      const auto count = static_cast<std::size_t>(next - rest.begin());
      in_cell(latitude_deg, cell, rest.first(count), out + from);
      from += count;
    }
  }

 private:
  /// GeographicLib fits a cubic polynomial to the surroundings of each cell of its grid: four points of it give the parallel's.
  void in_cell(double latitude_deg, double cell, std::span<const double> longitude_deg, double* out) const {
    constexpr std::size_t kFewPoints = 8;
    constexpr double kRim = 1e-9;  // in cells: which of two cells a point on their border falls into is for the library to say
    if (longitude_deg.size() < kFewPoints) return Geoid::along_parallel(latitude_deg, longitude_deg, out);
    put_cubic(along_cell(latitude_deg, cell), longitude_deg, points_a_degree_, cell, out);
    for (const std::size_t k : {std::size_t{0}, longitude_deg.size() - 1}) {
      const double across = longitude_deg[k] * points_a_degree_ - cell;
      if (across < kRim || across > 1 - kRim) out[k] = (*geoid_)(latitude_deg, longitude_deg[k]);
    }
  }

  /// The same parallels are asked about again, for pixels and for what lies beside.
  const Cubic& along_cell(double latitude_deg, double cell) const {
    constexpr std::size_t kMostKept = 4096;
    if (kept_.size() >= kMostKept) kept_.clear();
    const auto [at, is_new] = kept_.try_emplace({latitude_deg, cell});
    if (is_new) {
      double f[4];
      for (int k = 0; k < 4; ++k) f[k] = (*geoid_)(latitude_deg, (cell + (2 * k + 1) / 8.0) / points_a_degree_);
      at->second = Cubic(f);
    }
    return at->second;
  }

  std::shared_ptr<const Pgm> geoid_;
  mutable std::map<std::pair<double, double>, Cubic> kept_;  ///< by latitude and cell
  double points_a_degree_;
};

/// Points around the globe. 0: GeographicLib stretches any PGM over the globe without a word; a regional one would give wrong
/// heights.
long columns_around(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  std::string line;
  long columns = 0, rows = 0;
  if (!std::getline(file, line) || line.substr(0, 2) != "P5") return 0;
  bool origin = false;
  while (std::getline(file, line)) {
    if (line.find("# Origin 90N 0E") == 0) origin = true;
    if (line.empty() || line[0] == '#') continue;
    std::istringstream(line) >> columns >> rows;
    break;
  }
  return origin && columns > 0 && columns == 2 * (rows - 1) ? columns : 0;
}

}  // namespace

proto::Result<std::unique_ptr<Geoid>> open_geoid_pgm(const std::string& path, const Area& area) {
  const std::string name = fs::path(path).filename().string();
  const long columns = columns_around(path);
  if (columns == 0)
    return Problem{"geoid-invalid",
                   "the PGM " + name + " is no global geoid grid of GeographicLib (Origin 90N 0E, twice as wide as high)",
                   "a global PGM, or a regional grid as GTX or GeoTIFF", "vertical_datum"};
  try {
    return std::unique_ptr<Geoid>(new PgmGeoid(path, columns, area));
  } catch (const std::exception& error) {  // GeographicLib speaks in exceptions: they end here
    return Problem{"geoid-invalid",
                   "the geoid grid " + name + " cannot be read: " + proto::without_path(error.what(), path, name),
                   "a complete GeographicLib PGM", "vertical_datum"};
  }
}

}  // namespace cordillera::raster
