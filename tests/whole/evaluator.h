#pragma once
// The independent judge of stated errors: what a client decoded, ray by ray, in plain double precision.
//
// Nothing here is shared with gpu/measure/surface_error: textbook geodesy with the library's sines, Möller and Trumbore's
// ray-triangle test (doi:10.1080/10867651.1997.10487468), candidates from a grid of bins over longitude and latitude.
#include <array>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "proto/lattice.h"

namespace cordillera::whole {

using Point = std::array<double, 3>;  ///< ECEF, metres

/// EPSG:4979 to EPSG:4978.
Point ecef_point(double longitude_deg, double latitude_deg, double height_m);

/// The ellipsoid's normal where the line along it through p meets it.
Point up_at(const Point& p);

/// A decoded .drc: tile-local units from the south-west, height steps. Points of triangles only.
struct DecodedTile {
  proto::TileAddress tile;
  std::int32_t side = 0;                                ///< units a tile side
  std::vector<std::int32_t> u, v, h;                    ///< indexed by vertex
  std::vector<std::array<std::uint32_t, 3>> triangles;  ///< counter-clockwise seen from above
};

/// Triangles in space: a decoded .glb (skirts left out), or a decoded .drc by the documented formula.
struct DecodedSurface {
  std::vector<Point> points;
  std::vector<std::array<std::uint32_t, 3>> triangles;
};

/// lon = -180 + (x + u / side) * 180 / 2^z, lat = -90 + (y + v / side) * 180 / 2^z, height = h * height_step_m.
DecodedSurface surface_of(const DecodedTile& tile, double height_step_m = 1.0 / 1024);

/// True height in metres at finest lattice vertex (i, j), none where there is no data. i is not taken modulo the circle.
using TrueHeight = std::function<std::optional<double>(std::int64_t i, std::int64_t j)>;

struct Measured {
  double max_m = 0;             ///< greatest |error|; where a ray meets several triangles, the worst of them
  double rmse_m = 0;            ///< where a ray meets several triangles, the nearest of them
  std::uint64_t samples = 0;    ///< with data and seen
  std::uint64_t uncovered = 0;  ///< with data, but no triangle there. A tile's equatorward side is a row of chords that bend into
                                ///< the tile: samples on the side itself are still seen, those between are the neighbour's, so
                                ///< append its triangles to the surface where a chord is long
  std::int64_t worst_i = 0, worst_j = 0;
};

/// A closed rectangle of finest lattice vertices. Columns are not taken modulo the circle.
struct SampleWindow {
  std::int64_t west = 0, south = 0, east = 0, north = 0;
};

/// Measures every `stride`-th sample (1: all) of the window along the ellipsoid's normal. The window may leave the tile's
/// rectangle.
Measured measure(const DecodedSurface& surface, const proto::Lattice& lattice, const proto::TileAddress& tile,
                 const TrueHeight& truth, const SampleWindow& window, std::int64_t stride);

/// Measures every `stride`-th sample (1: all) of the tile's closed rectangle.
Measured measure(const DecodedSurface& surface, const proto::Lattice& lattice, const proto::TileAddress& tile,
                 const TrueHeight& truth, std::int64_t stride = 1);

}  // namespace cordillera::whole
