#include "pipeline/faces/tiles_3d/lattice_heights.h"

#include <algorithm>
#include <limits>

#include "pipeline/faces/mesh_pixels.h"
#include "proto/integers.h"

namespace cordillera::pipeline::faces {
namespace {

/// Tiles that hold places of an axis. One on a common side may have data in either.
struct RowSpan {
  std::int64_t first = 0, last = 0;
};
RowSpan span_of(std::int64_t first, std::int64_t last, std::int64_t side) {
  return {proto::floor_divide(first - 1, side), proto::floor_divide(last, side)};
}

void add_frames(const proto::Lattice& lattice, LatticeWindow& window) {
  for (std::int32_t r = 0; r < window.rows; ++r)
    window.row_frames.push_back(proto::row_frame(lattice, window.north - r * window.step));
  for (std::int32_t c = 0; c < window.columns; ++c) {
    const std::int64_t column = proto::modulo(window.west + c * window.step, lattice.columns());
    window.column_frames.push_back(proto::column_frame(lattice, column));
  }
}

}  // namespace

void draw_lattice(const Terrain& terrain, int level, LatticeWindow& window) {
  const proto::Lattice lattice = half_lattice(terrain);
  const std::int64_t side = lattice.tile_units(level);
  window.height_m.assign(static_cast<std::size_t>(window.columns) * static_cast<std::size_t>(window.rows),
                         std::numeric_limits<double>::quiet_NaN());
  add_frames(lattice, window);
  PixelsInUnits places{std::vector<double>(static_cast<std::size_t>(window.columns)),
                       std::vector<double>(static_cast<std::size_t>(window.rows)), window.row_frames, window.column_frames};
  const std::int32_t across = proto::tiles_across(level);
  const RowSpan xs = span_of(window.west, window.west + (window.columns - 1) * window.step, side);
  const RowSpan ys = span_of(window.north - (window.rows - 1) * window.step, window.north, side);
  // Always in the same order: a place on a common side has the height of the first tile.
  for (std::int64_t y = std::max<std::int64_t>(ys.first, 0); y <= std::min<std::int64_t>(ys.last, proto::tiles_up(level) - 1);
       ++y) {
    for (std::size_t r = 0; r < places.v.size(); ++r)
      places.v[r] = 0.5 * static_cast<double>(window.north - static_cast<std::int64_t>(r) * window.step - y * side);
    for (std::int64_t x = xs.first; x <= xs.last; ++x) {
      const auto mesh = terrain.mesh({level, static_cast<std::int32_t>(proto::modulo(x, across)), static_cast<std::int32_t>(y)});
      if (!mesh) continue;
      for (std::size_t c = 0; c < places.u.size(); ++c)
        places.u[c] = 0.5 * static_cast<double>(window.west + static_cast<std::int64_t>(c) * window.step - x * side);
      draw_mesh(mesh->mesh(), places, window.height_m.data(), static_cast<std::size_t>(window.columns));
    }
  }
}

}  // namespace cordillera::pipeline::faces
