#pragma once
// How far a tile of the finest level is from the source's own pixels.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "cordillera.pb.h"
#include "gpu/measure/surface_error_plane.h"
#include "pipeline/bound/earth.h"
#include "pipeline/tile/tile_mesh.h"
#include "proto/lattice.h"
#include "proto/mesh.h"
#include "raster/source.h"

namespace cordillera::pipeline {

/// Errors are distances, along the ellipsoid's normal, from pixels' centres to the flat triangle above or below them, as .drc
/// tiles are decoded.
class TilePixels {
 public:
  using Corners = std::array<gpu::MeshPoint, 3>;
  /// pixels: Source::pixels of the tile's cells. side: of the tile, cells. Borrows the lattice.
  TilePixels(const proto::Lattice& lattice, const proto::TileAddress& tile, std::int32_t side,
             const std::vector<raster::PixelPoint>& pixels);

  const raster::PixelPoint& operator[](std::size_t k) const { return pixels_[k].pixel; }
  /// In a cell that has any there are more than one on average: no samples meet them all.
  bool crowd() const;

  /// f(pixel, error in metres) for those in a triangle, its sides included, until it returns false.
  template <class F>
  void each_error(const Corners& corners, const F& f) const {
    each_error(Facet(corners, {earth_.at(corners[0]), earth_.at(corners[1]), earth_.at(corners[2])}, poles_), f);
  }

  /// Indices of a mesh's published triangles that are farther than the limit from a pixel.
  std::vector<std::uint32_t> triangles_over(const proto::TileMesh& mesh, double limit_m);
  /// Each pixel's error once. On an edge, which does not run above its line on the lattice, two triangles have different
  /// heights there: the greater error counts.
  proto::PixelErrors errors(const proto::TileMesh& mesh);

 private:
  /// Rows of the tile that are a pole.
  struct Poles {
    bool south = false;
    std::optional<std::int32_t> north;
    /// A pole's row is one point. A triangle with one corner there, a, shows all columns between the other two up to the pole,
    /// and beside it triangles that have two show nothing. a, b and c are counter-clockwise.
    bool fan_out_at(const gpu::MeshPoint& a, const gpu::MeshPoint& b, const gpu::MeshPoint& c) const;
  };

  /// A triangle in plan, with all that it shows of a pole, and in space.
  class Facet {
   public:
    Facet(const Corners& corners, const std::array<Spot, 3>& spots, const Poles& poles);

    /// False for a triangle that is a line in space.
    bool shows() const { return plane_.shows(); }
    std::int32_t first_row() const { return low_; }
    std::int32_t last_row() const { return high_; }  ///< of pixels on its northern end
    /// First and last cell of a row that it reaches into, or one more.
    std::pair<std::int32_t, std::int32_t> stretch(std::int32_t row) const {
      double west = INFINITY, east = 0;
      for (const Side& side : sides()) {
        if (row > side.north || row + 1 < side.south) continue;
        const double a = side.x_at(std::max(row, side.south)), b = side.x_at(std::min(row + 1, side.north));
        west = std::min({west, a, b});
        east = std::max({east, a, b});
      }
      constexpr double kRounded = 1e-6;
      return {static_cast<std::int32_t>(west - kRounded), static_cast<std::int32_t>(east + kRounded)};
    }
    /// Exact: places are multiples of 2^-20 of a cell.
    bool holds(double x, double y) const {
      return std::ranges::all_of(sides(), [&](const Side& s) { return s.dx * (y - s.y) - s.dy * (x - s.x) >= 0; });
    }
    /// At a place on the ellipsoid and what is up there.
    double error_m(const proto::Vec3& at, const proto::Vec3& up, double height_m) const {
      const double surface_m = (plane_.offset - proto::dot(plane_.normal, at)) / proto::dot(plane_.normal, up);
      return std::abs(range_.clamp(surface_m) - height_m);
    }

   private:
    /// From a corner to the next.
    struct Side {
      double x, y, dx, dy;
      double slope;  ///< x by y; 0 of one that runs along a row, which its neighbours' ends bound
      std::int32_t south, north;
      double x_at(std::int32_t row) const { return x + slope * (row - y); }
    };
    void add_side(const gpu::MeshPoint& a, const gpu::MeshPoint& b);
    std::span<const Side> sides() const { return {side_.data(), sides_}; }

    std::array<Side, 5> side_;  // three, and one more for each pole
    std::size_t sides_ = 0;
    std::int32_t low_, high_;
    gpu::Plane plane_;
    gpu::HeightRange range_;
  };

  struct Placed {
    raster::PixelPoint pixel;
    proto::Vec3 at, up;
  };
  struct PixelError {
    std::uint32_t pixel;
    double error_m;
  };
  /// What was seen of a triangle.
  struct Seen {
    Corners corners;
    std::uint32_t first = 0, end = 0;  ///< of its errors
    double greatest_m = 0;
  };

  std::size_t cell_of(const raster::PixelPoint& pixel) const {
    const auto cell = [this](double at) { return std::min(static_cast<std::int32_t>(at), side_ - 1); };
    return static_cast<std::size_t>(cell(pixel.y) * side_ + cell(pixel.x));
  }

  template <class F>
  void each_error(const Facet& facet, const F& f) const {
    if (!facet.shows()) return;
    for (std::int32_t row = facet.first_row(); row <= std::min(facet.last_row(), side_ - 1); ++row) {
      const auto [west, east] = facet.stretch(row);
      const std::uint32_t* const start = start_.data() + static_cast<std::size_t>(row * side_);
      const std::uint32_t end = start[std::min(east, side_ - 1) + 1];
      for (std::uint32_t k = start[std::min(west, side_ - 1)]; k < end; ++k) {
        const auto& [pixel, at, up] = pixels_[k];
        if (facet.holds(pixel.x, pixel.y) && !f(k, facet.error_m(at, up, pixel.height_m))) return;
      }
    }
  }

  /// Of triangles that are as they were the last time nothing is measured again.
  void see(const proto::TileMesh& mesh);

  const Earth earth_;
  const std::int32_t side_;
  const Poles poles_;
  std::vector<std::uint32_t> start_;  ///< indexed by cell: its first pixel
  std::vector<Placed> pixels_;        ///< cell by cell, by rows from the south-west
  std::vector<Seen> seen_;            ///< indexed by triangle
  std::vector<PixelError> errors_;
};

/// The pixels of a tile of the finest level. Where they cannot be read there are none: the build reads them, too, and says so.
std::vector<raster::PixelPoint> pixels_of(const proto::Lattice& lattice, const proto::TileAddress& tile, raster::Source& source);

struct MetPixels {
  std::uint32_t inserted = 0;  ///< vertices
  bool changed = false;        ///< the mesh: edges may be turned where nothing goes in
  std::vector<gpu::MeshPoint>
      on_sides;  ///< samples on the tile's sides that would have to be vertices, where pixels are still too far off
};

/// Puts samples into a tile of the finest level until its triangles are within the level's target of all pixels, as they are of
/// all samples; as far as vertices can, which do not go onto the tile's sides (see put_on_sides). What was measured of the tile
/// is no longer true if it changed. Where pixels are finer than samples, as of a raster that was added to an older plan, nothing
/// goes in. memory: of the tile at limit_of().
MetPixels meet_pixels(const LevelContext& context, BuiltTile& built, TilePixels& pixels, gpu::SurfaceMemory& memory);

}  // namespace cordillera::pipeline
