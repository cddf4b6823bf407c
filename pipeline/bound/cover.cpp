#include "pipeline/bound/cover.h"

#include <algorithm>

#include "proto/integers.h"

namespace cordillera::pipeline {
namespace {

using proto::floor_divide;

/// Which samples of a rectangle must be covered, until something covers them.
class Demand {
 public:
  Demand(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::Samples& samples,
         const TileRectangle& rectangle)
      : at_(rectangle), columns_(rectangle.east - rectangle.west + 1), rows_(rectangle.north - rectangle.south + 1) {
    const std::int64_t west = lattice.west(tile) + at_.west, south = lattice.south(tile) + at_.south,
                       cell = lattice.cell_units(tile.z);
    open_.assign(static_cast<std::size_t>(columns_ * rows_), 0);
    const std::int64_t first = std::max<std::int64_t>(south - cell, 0);
    std::vector<std::int64_t> run(static_cast<std::size_t>(columns_),
                                  0);  // of rows up to this one whose samples nearby all have data
    std::vector<char> clear(static_cast<std::size_t>(columns_));
    for (std::int64_t j = first; j < south + rows_ + cell; ++j) {
      if (j <= lattice.rows())
        clear_along(lattice, samples, west, j, cell, clear);
      else
        std::fill(clear.begin(), clear.end(), 1);
      const std::int64_t enough = std::min(2 * cell, j - first) + 1, row = j - cell - south;
      for (std::size_t k = 0; k < run.size(); ++k) {
        run[k] = clear[k] ? run[k] + 1 : 0;
        if (row >= 0 && run[k] >= enough) open_[static_cast<std::size_t>(row * columns_) + k] = 1;
      }
    }
  }

  /// By a triangle, its sides included.
  void cover(const proto::TileMesh& mesh, const std::array<std::uint32_t, 3>& corners) {
    const auto [south, north] = std::minmax({mesh.y[corners[0]], mesh.y[corners[1]], mesh.y[corners[2]]});
    for (std::int64_t y = std::max(south, at_.south); y <= std::min(north, at_.north); ++y) {
      std::int64_t from = at_.west, to = at_.east;
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = corners[k], b = corners[(k + 1) % 3];
        const std::int64_t dx = std::int64_t{mesh.x[b]} - mesh.x[a], dy = std::int64_t{mesh.y[b]} - mesh.y[a];
        const std::int64_t up = y - mesh.y[a];
        if (dy > 0) to = std::min(to, mesh.x[a] + floor_divide(dx * up, dy));
        if (dy < 0) from = std::max(from, mesh.x[a] - floor_divide(dx * up, -dy));
      }
      const auto row = open_.begin() + (y - at_.south) * columns_ - at_.west;
      if (from <= to) std::fill(row + from, row + to + 1, 0);
    }
  }

  std::vector<gpu::MeshPoint> left(const proto::Lattice& lattice, const proto::TileAddress& tile,
                                   const proto::Samples& samples) const {
    std::vector<gpu::MeshPoint> found;
    for (std::size_t k = 0; k < open_.size(); ++k) {
      if (!open_[k]) continue;
      const auto x = at_.west + static_cast<std::int32_t>(static_cast<std::int64_t>(k) % columns_),
                 y = at_.south + static_cast<std::int32_t>(static_cast<std::int64_t>(k) / columns_);
      found.push_back({x, y, samples.at(in_window(lattice, samples, lattice.west(tile) + x), lattice.south(tile) + y)});
    }
    return found;
  }

 private:
  /// The column on the turn that the window is on: its first one from the window's west on.
  static std::int64_t in_window(const proto::Lattice& lattice, const proto::Samples& samples, std::int64_t column) {
    return samples.west + proto::modulo(column - samples.west, lattice.columns());
  }
  static bool has_data(const proto::Lattice& lattice, const proto::Samples& samples, std::int64_t column, std::int64_t row) {
    const std::int64_t i = in_window(lattice, samples, column);
    if (row < samples.south || row >= samples.south + samples.rows || i >= samples.west + samples.columns) return false;
    return samples.at(i, row) != proto::kNoHeight;
  }
  static void clear_along(const proto::Lattice& lattice, const proto::Samples& samples, std::int64_t west, std::int64_t row,
                          std::int64_t cell, std::vector<char>& clear) {
    std::int64_t run = 0;
    const std::int64_t count = static_cast<std::int64_t>(clear.size());
    for (std::int64_t k = -cell; k < count + cell; ++k) {
      run = has_data(lattice, samples, west + k, row) ? run + 1 : 0;
      if (k >= cell) clear[static_cast<std::size_t>(k - cell)] = run > 2 * cell;
    }
  }

  TileRectangle at_;
  std::int64_t columns_, rows_;
  std::vector<char> open_;
};

/// Is no sample of the window farther than a cell from its sides? Coarse cells are wider than small data, by far.
bool all_near_outline(const proto::Lattice& lattice, const proto::Samples& samples, std::int64_t cell) {
  const int poles = (samples.south <= 0 ? 1 : 0) + (samples.south + samples.rows > lattice.rows() ? 1 : 0);
  return samples.columns <= 2 * cell || (poles < 2 && samples.rows <= (2 - poles) * cell);
}

}  // namespace

TileRectangle part_in_window(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::Samples& window) {
  const std::int64_t side = lattice.tile_units(tile.z), south = window.south - lattice.south(tile);
  std::int64_t west = side + 1, east = -1;
  const std::int64_t first = proto::modulo(window.west - lattice.west(tile), lattice.columns());
  for (const std::int64_t from : {first, first - lattice.columns()}) {
    const std::int64_t a = std::max<std::int64_t>(from, 0), b = std::min(from + window.columns - 1, side);
    if (a <= b) west = std::min(west, a), east = std::max(east, b);
  }
  return {static_cast<std::int32_t>(west), static_cast<std::int32_t>(std::clamp<std::int64_t>(south, 0, side)),
          static_cast<std::int32_t>(east), static_cast<std::int32_t>(std::clamp<std::int64_t>(south + window.rows - 1, 0, side))};
}

std::vector<gpu::MeshPoint> uncovered_inside(const proto::Lattice& lattice, const proto::TileAddress& tile,
                                             const proto::TileMesh& mesh, const proto::Samples& samples,
                                             const TileRectangle& rectangle) {
  if (rectangle.west > rectangle.east || rectangle.south > rectangle.north ||
      all_near_outline(lattice, samples, lattice.cell_units(tile.z)))
    return {};
  Demand demand(lattice, tile, samples, rectangle);
  for (const auto& t : mesh.triangles)
    if (is_published(mesh, t)) demand.cover(mesh, t);
  return demand.left(lattice, tile, samples);
}

}  // namespace cordillera::pipeline
