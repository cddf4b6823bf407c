// The raster's own pixels, placed on a lattice.
#include <algorithm>
#include <cmath>
#include <limits>

#include "raster/gdal/gdal_scope.h"
#include "raster/place/pixel_places.h"
#include "raster/source/raster_source.h"

namespace cordillera::raster {
namespace {

/// Up to cells of this size undulations between vertices are interpolated: the geoid bends by less than a millimetre there.
constexpr double kLevelGeoid_deg = 0.003;

/// Least and greatest of one axis of a net of places, and how much it may bend between them.
struct Reach {
  double low = std::numeric_limits<double>::infinity(), high = -low, bend = 0;
  void add(double at) { low = std::min(low, at), high = std::max(high, at); }
  void bends(double before, double at, double after) { bend = std::max(bend, std::abs(before - 2 * at + after)); }
};

}  // namespace

/// Rectangles of the raster that hold the centres of all pixels that lie in cells of the lattice: two where the cells lie on both
/// of its ends, none where there can be no pixel. No pixel is in both.
std::vector<PixelWindow> RasterSource::pixels_around(const proto::Lattice& lattice, const Window& cells) const {
  constexpr int kNet = 17;
  const Dataset& d = parts_.dataset;
  const int period = parts_.placement->period_px();
  const std::vector<PixelWindow> all{{0, 0, period != 0 ? std::min(period, d.columns) : d.columns, d.rows}};
  std::vector<double> x, y;
  for (int r = 0; r < kNet; ++r) {
    for (int c = 0; c < kNet; ++c) {
      x.push_back(lattice.longitude_deg(cells.west) +
                  lattice.cell_deg() * static_cast<double>(cells.east - cells.west) * c / (kNet - 1));
      y.push_back(lattice.latitude_deg(cells.south) +
                  lattice.cell_deg() * static_cast<double>(cells.north - cells.south) * r / (kNet - 1));
    }
  }
  parts_.placement->to_pixels(x.data(), y.data(), x.size());
  const double turn = parts_.placement->turn_px();
  Reach across, down;
  for (int k = 0; k < kNet * kNet; ++k) {
    if (!std::isfinite(x[k]) || !std::isfinite(y[k])) return all;
    // Each place is on its own turn around the earth; here they are wanted beside each other.
    if (turn > 0 && k > 0) x[k] += turn * std::round((x[k % kNet == 0 ? k - kNet : k - 1] - x[k]) / turn);
    across.add(x[k]), down.add(y[k]);
    if (k % kNet > 1) across.bends(x[k - 2], x[k - 1], x[k]), down.bends(y[k - 2], y[k - 1], y[k]);
    if (k >= 2 * kNet) across.bends(x[k - 2 * kNet], x[k - kNet], x[k]), down.bends(y[k - 2 * kNet], y[k - kNet], y[k]);
  }
  if (std::max(across.bend, down.bend) > std::max(across.high - across.low, down.high - down.low) / 4 + 1) return all;  // torn
  const auto span = [](const Reach& reach, double shift, std::int64_t count) {
    const double margin = reach.bend + 2, most = static_cast<double>(count);
    const double first = std::clamp(std::floor(reach.low + shift - margin), 0.0, most),
                 last = std::clamp(std::ceil(reach.high + shift + margin), first, most);
    return std::pair<std::int64_t, int>(static_cast<std::int64_t>(first), static_cast<int>(last - first));
  };
  const auto [row, rows] = span(down, 0, d.rows);
  if (rows == 0) return {};
  const bool laps = turn > 0 && across.high - across.low + 2 * across.bend + 8 > turn;
  if (laps) return {{0, row, all.front().columns, rows}};
  std::vector<PixelWindow> windows;
  const int beside = turn > 0 ? 1 : 0;
  for (int turns = -beside; turns <= beside; ++turns) {
    const auto [column, columns] = span(across, turns * turn, all.front().columns);
    if (columns > 0) windows.push_back({column, row, columns, rows});
  }
  return windows;
}

proto::Result<std::vector<PixelPoint>> RasterSource::numbered_pixels(const proto::Lattice& lattice, const Window& cells,
                                                                     std::vector<PixelNumber>* numbers) {
  std::vector<PixelPoint> out;
  if (cells.east <= cells.west || cells.north <= cells.south ||
      empty(lattice, cells.west, cells.south, cells.east - cells.west + 1, cells.north - cells.south + 1))
    return out;
  const GdalScope scope(parts_.dataset.trust);
  std::vector<PixelWindow> windows = pixels_around(lattice, cells);
  std::erase_if(windows, [this](const PixelWindow& around) { return pixels_.certainly_void(around); });
  if (windows.empty()) return out;
  const bool level_geoid = parts_.datum.geoid && lattice.cell_deg() <= kLevelGeoid_deg;
  // Pixels lie where samples do, or less than a cell beside the last of them.
  const bool lies_in_one = !parts_.options.bbox && cells.east - cells.west < lattice.columns();
  const Window near = lies_in_one ? part_with_data(lattice, cells, 2) : cells;
  if (level_geoid) see_undulations(lattice, near);
  const UndulationGrid& undulations = known_undulations_;
  const auto near_x = static_cast<double>(near.west - cells.west), near_y = static_cast<double>(near.south - cells.south);
  const auto height_m = [&](double pixel_m, double x, double y) {
    if (!parts_.datum.geoid) return pixel_m;
    if (level_geoid) return pixel_m + undulations(x - near_x, y - near_y);
    const double latitude = -90 + (static_cast<double>(cells.south) + y) * lattice.cell_deg();
    return pixel_m + undulation_m(latitude, lattice.longitude_deg(cells.west) + x * lattice.cell_deg());
  };
  // A pixel that lies in the bbox and beyond its last sample is under no triangle, and is counted as such: as without a bbox.
  const double turn = static_cast<double>(lattice.columns());
  const auto wanted = [&](double x, double y) {
    if (!parts_.options.bbox) return true;
    constexpr double kRounding = 1e-6;  // of a cell
    const Area& box = *parts_.options.bbox;
    const double wide = (box.east_deg - box.west_deg) / lattice.cell_deg(),
                 low = (box.south_deg + 90) / lattice.cell_deg() - static_cast<double>(cells.south),
                 high = (box.north_deg + 90) / lattice.cell_deg() - static_cast<double>(cells.south);
    double from_west = static_cast<double>(cells.west) + x - (box.west_deg + 180) / lattice.cell_deg() + kRounding;
    from_west -= turn * std::floor(from_west / turn);
    return from_west <= wide + 2 * kRounding && y >= low - kRounding && y <= high + kRounding;
  };
  const double wide = static_cast<double>(cells.east - cells.west);
  const double high = static_cast<double>(cells.north - cells.south), top = cells.north == lattice.rows() ? high : -1;
  for (const PixelWindow& around : windows) {
    out.reserve(out.size() + static_cast<std::size_t>(std::min(std::int64_t{around.columns} * around.rows, kMaxBlockPixels)));
    PixelPlaces places(*parts_.placement, lattice, around.x, around.columns, pixel_patches_);
    std::vector<double> x(static_cast<std::size_t>(around.columns)), y(x.size());
    const int strip = static_cast<int>(std::clamp<std::int64_t>(kMaxBlockPixels / around.columns, 1, around.rows));
    for (int from = 0; from < around.rows; from += strip) {
      const PixelWindow part{around.x, around.y + from, around.columns, std::min(strip, around.rows - from)};
      if (pixels_.certainly_void(part)) continue;
      if (auto done = pixels_.read(part, block_.heights); !done.ok()) return done.problem();
      for (int r = 0; r < part.rows; ++r) {
        places.row(part.y + r, x.data(), y.data());
        const double* const line = block_.heights.data() + static_cast<std::size_t>(r) * x.size();
        for (std::size_t c = 0; c < x.size(); ++c) {
          if (std::isnan(line[c])) continue;
          const double up = y[c] - static_cast<double>(cells.south);
          if (!(up >= 0 && (up < high || up == top))) continue;
          double along = x[c] - static_cast<double>(cells.west);
          if (!(along >= 0 && along < turn)) along -= turn * std::floor(along / turn);
          for (; along < wide; along += turn) {  // more than once where the window laps itself
            if (!wanted(along, up)) continue;
            const double total_m = height_m(line[c], along, up);
            if (!(std::abs(total_m) <= proto::kMaxHeight_m)) continue;
            out.push_back({along, up, total_m});
            if (numbers != nullptr)
              numbers->push_back(
                  {static_cast<std::int32_t>(part.x) + static_cast<std::int32_t>(c), static_cast<std::int32_t>(part.y) + r});
          }
        }
      }
    }
  }
  return out;
}

}  // namespace cordillera::raster
