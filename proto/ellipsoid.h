#pragma once
// WGS 84 positions of lattice vertices (EPSG:4979 -> EPSG:4978), the same bits everywhere.
//
// Sines and cosines are made on the host, by octant symmetry (so that column 0 and column n, and the two hemispheres, agree
// exactly), and rounded to a fixed binary step, because library versions differ in the last bit. What is left is + and x only.
// Formulas: Hofmann-Wellenhof & Moritz, Physical Geodesy, eq. 5-27.
#include <cmath>
#include <cstdint>
#include <vector>

#include "proto/host_device.h"
#include "proto/lattice.h"

namespace cordillera::proto {

inline constexpr double kSemiMajor_m = 6378137.0;
inline constexpr double kSemiMinor_m = 6356752.314245179;
inline constexpr double kFlattening = 1 / 298.257223563;

struct Vec3 {
  double x = 0, y = 0, z = 0;
};
CORDILLERA_HD inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
CORDILLERA_HD inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
CORDILLERA_HD inline Vec3 operator*(double s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
CORDILLERA_HD inline double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline double length(Vec3 a) { return std::sqrt(dot(a, a)); }
CORDILLERA_HD inline Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }

/// What all vertices of one lattice row (parallel) share.
struct RowFrame {
  double sin_lat = 0, cos_lat = 0;
  double radius_m = 0;  ///< distance of the ellipsoid from the axis: N cos(lat)
  double axis_m = 0;    ///< height of the ellipsoid over the equator's plane: N (1 - e2) sin(lat)
};

/// What all vertices of one lattice column (meridian) share.
struct ColumnFrame {
  double sin_lon = 0, cos_lon = 0;
};

/// Row 0 is the south pole; rows outside [0, rows()] are clamped to the pole. Columns are taken modulo the circle.
RowFrame row_frame(const Lattice& lattice, std::int64_t row);
ColumnFrame column_frame(const Lattice& lattice, std::int64_t column);

/// Rows south .. south+count-1.
std::vector<RowFrame> row_frames(const Lattice& lattice, std::int64_t south, std::size_t count);
/// Columns west .. west+count-1.
std::vector<ColumnFrame> column_frames(const Lattice& lattice, std::int64_t west, std::size_t count);

/// Earth-centred, earth-fixed position in metres of the point at ellipsoidal height height_m.
CORDILLERA_HD inline Vec3 ecef(const RowFrame& row, const ColumnFrame& column, double height_m) {
  const double r = row.radius_m + height_m * row.cos_lat;
  return {r * column.cos_lon, r * column.sin_lon, row.axis_m + height_m * row.sin_lat};
}
/// Outward unit normal of the ellipsoid.
CORDILLERA_HD inline Vec3 normal(const RowFrame& row, const ColumnFrame& column) {
  return {row.cos_lat * column.cos_lon, row.cos_lat * column.sin_lon, row.sin_lat};
}

/// Length in metres of one lattice cell along the meridian at row j, on the ellipsoid.
double cell_height_m(const Lattice& lattice, std::int64_t row);

}  // namespace cordillera::proto
