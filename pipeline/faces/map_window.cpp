#include "pipeline/faces/map_window.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <utility>

#include "pipeline/faces/mesh_pixels.h"
#include "pipeline/faces/terrain.h"
#include "pipeline/faces/web_mercator.h"

namespace cordillera::pipeline::faces {
namespace {

/// Columns of a window as runs of growing longitude: at the antimeridian a run ends.
struct Columns {
  std::vector<double> longitude_deg;
  std::vector<proto::ColumnFrame> frame;
  std::vector<std::size_t> run_end;
};

Columns columns_of(const MapWindow& window) {
  Columns columns;
  for (std::int32_t c = 0; c < window.columns; ++c) {
    const double longitude = pixel_longitude_deg(window.zoom, static_cast<double>(window.west + c) + 0.5);
    const bool wraps = !columns.longitude_deg.empty() && longitude < columns.longitude_deg.back();
    if (wraps) columns.run_end.push_back(columns.longitude_deg.size());
    columns.longitude_deg.push_back(longitude);
    columns.frame.push_back(column_frame_at(longitude));
  }
  columns.run_end.push_back(columns.longitude_deg.size());
  return columns;
}

PixelRows rows_of(const MapWindow& window) {
  PixelRows rows;
  for (std::int32_t r = 0; r < window.rows; ++r) {
    rows.latitude_deg.push_back(pixel_latitude_deg(window.zoom, static_cast<double>(window.north + r) + 0.5));
    rows.frame.push_back(row_frame_at(rows.latitude_deg.back()));
  }
  return rows;
}

/// Tiles between two places on an axis. A place on a common side may have data in either of its tiles.
struct RowSpan {
  std::int32_t first = 0, last = 0;
};
RowSpan span_of(double from_deg, double to_deg, int level, std::int32_t count) {
  const double tiles_a_degree = std::ldexp(1, level) / 180;
  const auto first = static_cast<std::int32_t>(std::ceil(from_deg * tiles_a_degree)) - 1;
  const auto last = static_cast<std::int32_t>(std::floor(to_deg * tiles_a_degree));
  return {std::clamp(first, 0, count - 1), std::clamp(last, 0, count - 1)};
}

void draw_level(const Terrain& terrain, int level, const PixelRows& rows, const PixelColumns& columns, const MapWindow& window,
                double* out) {
  const auto& [west, east] = std::pair(columns.longitude_deg.front(), columns.longitude_deg.back());
  const auto& [north, south] = std::pair(rows.latitude_deg.front(), rows.latitude_deg.back());
  const RowSpan x = span_of(west + 180, east + 180, level, proto::tiles_across(level));
  const RowSpan y = span_of(south + 90, north + 90, level, proto::tiles_up(level));
  for (std::int32_t row = y.first; row <= y.last; ++row) {
    for (std::int32_t column = x.first; column <= x.last; ++column) {
      if (const auto mesh = terrain.mesh({level, column, row}))
        draw_mesh(mesh->mesh(), rows, columns, out, static_cast<std::size_t>(window.columns));
    }
  }
}

/// Finest first: a pixel keeps the height that it gets first.
void draw_run(const Terrain& terrain, const PixelRows& rows, const PixelColumns& columns, const MapWindow& window, double* out) {
  for (int level = window.level; level >= terrain.coarsest_for(window.level); --level)
    draw_level(terrain, level, rows, columns, window, out);
}

/// Takes the geoid's height off wherever there is data: a grid of undulations is only near where data is.
proto::Result<void> to_geoid(const Terrain& terrain, const PixelRows& rows, std::span<const double> longitude_deg,
                             MapWindow& window) {
  const auto columns = static_cast<std::size_t>(window.columns);
  std::vector<double> undulation_m(columns);
  for (std::size_t r = 0; r < rows.latitude_deg.size(); ++r) {
    double* row = &window.height_m[r * columns];
    for (std::size_t first = 0; first < columns; ++first) {
      std::size_t end = first;
      while (end < columns && !std::isnan(row[end])) ++end;
      if (end == first) continue;
      const auto with_data = longitude_deg.subspan(first, end - first);
      const auto found = terrain.undulations_m(rows.latitude_deg[r], with_data, undulation_m.data());
      if (!found) return found.problem();
      for (std::size_t c = first; c < end; ++c) row[c] -= undulation_m[c - first];
      first = end;
    }
  }
  return {};
}

}  // namespace

proto::Result<void> draw_heights(const Terrain& terrain, MapWindow& window) {
  window.height_m.assign(static_cast<std::size_t>(window.columns) * static_cast<std::size_t>(window.rows),
                         std::numeric_limits<double>::quiet_NaN());
  const Columns columns = columns_of(window);
  const PixelRows rows = rows_of(window);
  std::size_t from = 0;
  for (const std::size_t end : columns.run_end) {
    const std::size_t count = end - from;
    const PixelColumns run{std::span(columns.longitude_deg).subspan(from, count), std::span(columns.frame).subspan(from, count)};
    draw_run(terrain, rows, run, window, window.height_m.data() + from);
    from = end;
  }
  return to_geoid(terrain, rows, columns.longitude_deg, window);
}

}  // namespace cordillera::pipeline::faces
