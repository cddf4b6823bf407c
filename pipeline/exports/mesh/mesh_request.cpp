#include "pipeline/exports/mesh/mesh_request.h"

#include <algorithm>
#include <cmath>

namespace cordillera::pipeline::exports {
namespace {

/// The share of an interval [at, at + size) that lies in [low, high).
double share(double at, double size, double low, double high) {
  return std::clamp((std::min(at + size, high) - std::max(at, low)) / size, 0.0, 1.0);
}

void set_sides(const proto::Lattice& lattice, const raster::Area& box, MeshWindow& window) {
  const double units_a_degree = static_cast<double>(lattice.rows()) / 180;
  window.west = (box.west_deg + 180) * units_a_degree;
  window.east = (box.east_deg + 180) * units_a_degree;
  window.south = (box.south_deg + 90) * units_a_degree;
  window.north = (box.north_deg + 90) * units_a_degree;
}

}  // namespace

MeshWindow window_of(const faces::Terrain& terrain, const MeshRequest& request, int level) {
  const proto::Lattice lattice = terrain.lattice();
  MeshWindow window;
  window.level = level;
  if (request.tile) {
    window.x0 = window.x1 = request.tile->x;
    window.y0 = window.y1 = request.tile->y;
    return window;
  }
  window.clipped = request.box.has_value();
  const raster::Area all = raster::area_of(terrain.manifest().bounds()).value_or(raster::Area{-180, -90, 180, 90});
  set_sides(lattice, request.box.value_or(all), window);
  const double units_a_degree = static_cast<double>(lattice.rows()) / 180;
  const auto side = static_cast<double>(lattice.tile_units(level));
  const std::int32_t across = proto::tiles_across(level), up = proto::tiles_up(level);
  window.x0 = static_cast<std::int64_t>(std::floor(window.west / side));
  window.x1 = std::min(static_cast<std::int64_t>(std::ceil(window.east / side)), window.x0 + across) - 1;
  // Rows without data would each cost a question.
  const double south = std::max(window.south, (all.south_deg + 90) * units_a_degree);
  const double north = std::min(window.north, (all.north_deg + 90) * units_a_degree);
  window.y0 = std::clamp(static_cast<std::int32_t>(std::floor(south / side)), 0, up - 1);
  window.y1 = std::clamp(static_cast<std::int32_t>(std::ceil(north / side)) - 1, 0, up - 1);
  return window;
}

void each_tile(const faces::Terrain& terrain, const MeshWindow& window,
               const std::function<bool(const proto::TileRecord& record, std::int64_t x)>& visit) {
  const std::int64_t across = proto::tiles_across(window.level);
  for (std::int32_t y = window.y0; y <= window.y1; ++y) {
    for (std::int64_t first = window.x0; first <= window.x1;) {
      const std::int64_t turn =
          static_cast<std::int64_t>(std::floor(static_cast<double>(first) / static_cast<double>(across))) * across;
      const std::int64_t last = std::min(window.x1, turn + across - 1);
      const auto x0 = static_cast<std::int32_t>(first - turn), x1 = static_cast<std::int32_t>(last - turn);
      for (const proto::TileRecord& record : terrain.store().records(window.level, x0, y, x1, y)) {
        if (!visit(record, turn + record.x())) return;
      }
      first = last + 1;
    }
  }
}

double triangles_in(const faces::Terrain& terrain, const MeshWindow& window, std::uint64_t limit) {
  const auto side = static_cast<double>(terrain.lattice().tile_units(window.level));
  double sum = 0;
  each_tile(terrain, window, [&](const proto::TileRecord& record, std::int64_t x) {
    const double part = window.clipped ? share(static_cast<double>(x) * side, side, window.west, window.east) *
                                             share(record.y() * side, side, window.south, window.north)
                                       : 1;
    sum += part * record.triangles();
    return sum <= 2 * static_cast<double>(limit);
  });
  return sum;
}

}  // namespace cordillera::pipeline::exports
