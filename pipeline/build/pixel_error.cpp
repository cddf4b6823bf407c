#include "pipeline/build/pixel_error.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "gpu/measure/surface_error_plane.h"
#include "pipeline/bound/earth.h"
#include "pipeline/store/pixel_error_sum.h"

namespace cordillera::pipeline {
namespace {

/// Pixels by the cell that they lie in.
class PixelsByCell {
 public:
  PixelsByCell(const std::vector<raster::PixelPoint>& pixels, std::int32_t side) : side_(side), start_(static_cast<std::size_t>(side) * static_cast<std::size_t>(side) + 1, 0) {
    for (const raster::PixelPoint& pixel : pixels) ++start_[cell_of(pixel) + 1];
    for (std::size_t k = 1; k < start_.size(); ++k) start_[k] += start_[k - 1];
    std::vector<std::uint32_t> next(start_.begin(), start_.end() - 1);
    order_.resize(pixels.size());
    for (std::size_t k = 0; k < pixels.size(); ++k) order_[next[cell_of(pixels[k])]++] = static_cast<std::uint32_t>(k);
  }
  /// Those in cells west .. east of a row.
  std::span<const std::uint32_t> row(std::int32_t row, std::int32_t west, std::int32_t east) const {
    const auto from = static_cast<std::size_t>(row * side_);
    const std::uint32_t first = start_[from + static_cast<std::size_t>(west)], end = start_[from + static_cast<std::size_t>(east) + 1];
    return {order_.data() + first, end - first};
  }

 private:
  std::size_t cell_of(const raster::PixelPoint& pixel) const {
    const auto cell = [this](double at) { return std::min(static_cast<std::int32_t>(at), side_ - 1); };
    return static_cast<std::size_t>(cell(pixel.y) * side_ + cell(pixel.x));
  }
  std::int32_t side_;
  std::vector<std::uint32_t> start_, order_;
};

/// A triangle in plan and in space.
struct Facet {
  std::array<gpu::MeshPoint, 3> corner;
  gpu::Plane plane;
  gpu::HeightRange range;

  /// Exact: places are multiples of 2^-20 of a cell.
  bool holds(double x, double y) const {
    for (std::size_t k = 0; k < 3; ++k) {
      const gpu::MeshPoint &a = corner[k], &b = corner[(k + 1) % 3];
      if ((b.x - a.x) * (y - a.y) - (b.y - a.y) * (x - a.x) < 0) return false;
    }
    return true;
  }

  /// First and last cell of a row that it reaches into.
  std::pair<std::int32_t, std::int32_t> stretch(std::int32_t row, std::int32_t side) const {
    double west = side, east = 0;
    const auto take = [&](double x) { west = std::min(west, x), east = std::max(east, x); };
    for (std::size_t k = 0; k < 3; ++k) {
      const gpu::MeshPoint &a = corner[k], &b = corner[(k + 1) % 3];
      if (a.y >= row && a.y <= row + 1) take(a.x);
      for (const std::int32_t y : {row, row + 1}) {
        if ((a.y < y) != (b.y < y)) take(a.x + static_cast<double>(b.x - a.x) * (y - a.y) / (b.y - a.y));
      }
    }
    return {std::clamp(static_cast<std::int32_t>(std::floor(west - 1e-6)), 0, side - 1), std::clamp(static_cast<std::int32_t>(std::floor(east + 1e-6)), 0, side - 1)};
  }
};

Facet facet_of(const Earth& earth, const proto::TileMesh& mesh, const std::array<std::uint32_t, 3>& triangle) {
  Facet facet;
  std::array<Spot, 3> spot;
  for (std::size_t k = 0; k < 3; ++k) {
    const std::uint32_t v = triangle[k];
    facet.corner[k] = {mesh.x[v], mesh.y[v], mesh.height[v]};
    spot[k] = earth.at(facet.corner[k]);
  }
  facet.plane = gpu::plane_of(spot[0].at, spot[1].at, spot[2].at);
  double edge2_m2 = 0;
  for (std::size_t k = 0; k < 3; ++k) {
    const proto::Vec3 edge = spot[(k + 1) % 3].at - spot[k].at;
    edge2_m2 = std::max(edge2_m2, proto::dot(edge, edge));
  }
  const auto [low, high] = std::minmax({spot[0].height_m, spot[1].height_m, spot[2].height_m});
  facet.range = gpu::height_range(low, high, edge2_m2, proto::kHeightStep_m);
  return facet;
}

}  // namespace

proto::PixelErrors pixel_errors(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::TileMesh& mesh,
                                const std::vector<raster::PixelPoint>& pixels) {
  const Earth earth(lattice, tile);
  const PixelsByCell cells(pixels, mesh.side);
  std::vector<std::uint8_t> seen(pixels.size(), 0);
  std::vector<std::uint32_t> counts;
  proto::PixelErrors errors;
  double greatest_m = 0, squares = 0;
  std::uint32_t measured = 0;
  for (const auto& triangle : mesh.triangles) {
    if (!is_published(mesh, triangle)) continue;
    const Facet facet = facet_of(earth, mesh, triangle);
    if (!facet.plane.shows()) continue;
    const auto [low, high] = std::minmax({facet.corner[0].y, facet.corner[1].y, facet.corner[2].y});
    for (std::int32_t row = low; row < std::min(high + 1, mesh.side); ++row) {
      const auto [west, east] = facet.stretch(row, mesh.side);
      for (const std::uint32_t k : cells.row(row, west, east)) {
        const raster::PixelPoint& pixel = pixels[k];
        if (seen[k] != 0 || !facet.holds(pixel.x, pixel.y)) continue;
        seen[k] = 1;
        const Place place = earth.place({pixel.x, pixel.y});
        const double surface_m = (facet.plane.offset - proto::dot(facet.plane.normal, place.at)) / proto::dot(facet.plane.normal, place.up);
        const double error_m = std::abs(facet.range.clamp(surface_m) - pixel.height_m);
        greatest_m = std::max(greatest_m, error_m);
        squares += error_m * error_m;
        const std::uint32_t step = pixel_error_step(error_m);
        if (step >= counts.size()) counts.resize(step + 1, 0);
        ++counts[step];
        ++measured;
      }
    }
  }
  errors.set_max(greatest_m);
  errors.set_sum_squared(squares);
  errors.set_pixels(measured);
  errors.set_uncovered(static_cast<std::uint32_t>(pixels.size()) - measured);
  const auto first = std::find_if(counts.begin(), counts.end(), [](std::uint32_t n) { return n > 0; });
  errors.set_first(static_cast<std::uint32_t>(first - counts.begin()));
  errors.mutable_counts()->Add(first, counts.end());
  return errors;
}

proto::PixelErrors pixel_errors(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::TileMesh& mesh, raster::Source& source) {
  const std::int64_t west = lattice.west(tile), south = lattice.south(tile), side = lattice.tile_units(tile.z);
  const auto pixels = source.pixels(lattice, {west, south, west + side, south + side});
  return pixels.ok() ? pixel_errors(lattice, tile, mesh, *pixels) : proto::PixelErrors();
}

}  // namespace cordillera::pipeline
