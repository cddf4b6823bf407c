// Positions on WGS 84: exact where two tiles must agree, and right everywhere, as GeographicLib sees it.
#include "proto/ellipsoid.h"

#include <gtest/gtest.h>

#include <GeographicLib/Geocentric.hpp>
#include <GeographicLib/Geodesic.hpp>
#include <bit>
#include <cmath>
#include <random>

namespace cordillera::proto {
namespace {

constexpr double kPolarRadius_m = 6356752.314245179;  // EPSG:7030
constexpr double kRounding_m = 2e-5;                  // sines and cosines have steps of 2^-40, at the earth's radius

Lattice lattice(int finest_level) { return {finest_level}; }
RowFrame row(const Lattice& l, std::int64_t j) { return row_frames(l, j, 1).front(); }
ColumnFrame column(const Lattice& l, std::int64_t i) { return column_frames(l, i, 1).front(); }

/// Equal to the last bit, the sign of zero too.
void expect_same(const RowFrame& a, const RowFrame& b) {
  EXPECT_EQ(std::bit_cast<std::uint64_t>(a.sin_lat), std::bit_cast<std::uint64_t>(b.sin_lat));
  EXPECT_EQ(std::bit_cast<std::uint64_t>(a.cos_lat), std::bit_cast<std::uint64_t>(b.cos_lat));
  EXPECT_EQ(std::bit_cast<std::uint64_t>(a.radius_m), std::bit_cast<std::uint64_t>(b.radius_m));
  EXPECT_EQ(std::bit_cast<std::uint64_t>(a.axis_m), std::bit_cast<std::uint64_t>(b.axis_m));
}
void expect_same(const ColumnFrame& a, const ColumnFrame& b) {
  EXPECT_EQ(std::bit_cast<std::uint64_t>(a.sin_lon), std::bit_cast<std::uint64_t>(b.sin_lon));
  EXPECT_EQ(std::bit_cast<std::uint64_t>(a.cos_lon), std::bit_cast<std::uint64_t>(b.cos_lon));
}

TEST(Ellipsoid, QuartersOfTheCircleAreExact) {
  for (const int z : {0, 9, 14, kMaxLevel}) {
    const Lattice l = lattice(z);
    const std::int64_t n = l.columns();
    const double sines[] = {0, -1, 0, 1, 0}, cosines[] = {-1, 0, 1, 0, -1};  // 180 W, 90 W, 0, 90 E, 180 E
    for (int k = 0; k <= 4; ++k) {
      EXPECT_EQ(column(l, k * n / 4).sin_lon, sines[k]) << "level " << z << ", quarter " << k;
      EXPECT_EQ(column(l, k * n / 4).cos_lon, cosines[k]) << "level " << z << ", quarter " << k;
    }
    EXPECT_EQ(column(l, 5 * n / 8).sin_lon, column(l, 5 * n / 8).cos_lon);  // 45 E
  }
}

TEST(Ellipsoid, TheAntimeridianIsOneMeridian) {
  const Lattice l = lattice(12);
  expect_same(column(l, 0), column(l, l.columns()));
  const auto over = column_frames(l, l.columns() - 5, 11), under = column_frames(l, -5, 11);
  for (std::size_t k = 0; k < over.size(); ++k) {
    expect_same(over[k], under[k]);
    expect_same(over[k], column(l, (l.columns() - 5 + static_cast<std::int64_t>(k)) % l.columns()));
  }
}

TEST(Ellipsoid, HemispheresAreMirrors) {
  const Lattice l = lattice(10);
  std::mt19937 random(1);
  for (int n = 0; n < 2000; ++n) {
    const auto j = static_cast<std::int64_t>(random()) % (l.rows() + 1), i = static_cast<std::int64_t>(random()) % l.columns();
    const RowFrame south = row(l, j), north = row(l, l.rows() - j);
    EXPECT_EQ(south.sin_lat, -north.sin_lat) << j;
    EXPECT_EQ(south.cos_lat, north.cos_lat) << j;
    EXPECT_EQ(south.radius_m, north.radius_m) << j;
    EXPECT_EQ(south.axis_m, -north.axis_m) << j;
    const ColumnFrame west = column(l, i), east = column(l, l.columns() - i);
    const ColumnFrame across = column(l, i + l.columns() / 2), quarter = column(l, i + l.columns() / 4);
    EXPECT_EQ(west.sin_lon, -east.sin_lon) << i;
    EXPECT_EQ(west.cos_lon, east.cos_lon) << i;
    EXPECT_EQ(west.sin_lon, -across.sin_lon) << i;
    EXPECT_EQ(west.cos_lon, -across.cos_lon) << i;
    EXPECT_EQ(west.sin_lon, -quarter.cos_lon) << i;
    EXPECT_EQ(west.cos_lon, quarter.sin_lon) << i;
  }
}

TEST(Ellipsoid, OctantsAreMirrors) {
  // sin a and cos(90 - a) of a library differ in the last bit, which rounding lets through once in thousands.
  const Lattice l = lattice(12);
  const std::int64_t equator = l.columns() / 2, quarter = l.columns() / 4;
  const auto east = column_frames(l, equator, static_cast<std::size_t>(quarter) + 1);
  std::size_t apart = 0;
  for (std::size_t k = 0; k < east.size(); ++k) apart += east[k].sin_lon != east[east.size() - 1 - k].cos_lon;
  EXPECT_EQ(apart, 0u) << "of " << east.size();
}

TEST(Ellipsoid, PolesAndEquator) {
  const Lattice l = lattice(11);
  const RowFrame south = row(l, 0), equator = row(l, l.rows() / 2), north = row(l, l.rows());
  EXPECT_EQ(north.sin_lat, 1);
  EXPECT_EQ(north.cos_lat, 0);
  EXPECT_EQ(north.radius_m, 0);
  EXPECT_NEAR(north.axis_m, kPolarRadius_m, 1e-6);
  EXPECT_NEAR(south.axis_m, -kPolarRadius_m, 1e-6);
  EXPECT_EQ(equator.sin_lat, 0);
  EXPECT_EQ(equator.cos_lat, 1);
  EXPECT_EQ(equator.radius_m, kSemiMajor_m);
  EXPECT_EQ(equator.axis_m, 0);
  // A pole is one point, whatever the column.
  for (const std::int64_t i : {std::int64_t{0}, std::int64_t{12345}, l.columns() / 2}) {
    const Vec3 pole = ecef(north, column(l, i), 2835);
    EXPECT_EQ(pole.x, 0);
    EXPECT_EQ(pole.y, 0);
    EXPECT_NEAR(pole.z, kPolarRadius_m + 2835, 1e-6);
  }
}

TEST(Ellipsoid, RowsBeyondAPoleAreThePole) {
  const Lattice l = lattice(3);
  const auto south = row_frames(l, -2, 4), north = row_frames(l, l.rows() - 1, 4);
  expect_same(south[0], south[2]);
  expect_same(south[1], south[2]);
  EXPECT_GT(south[3].radius_m, 0);
  EXPECT_GT(north[0].radius_m, 0);
  expect_same(north[2], north[1]);
  expect_same(north[3], north[1]);
}

TEST(Ellipsoid, AVertexHasOnePositionWhateverTheWindowAndTheLevel) {
  std::mt19937 random(5);
  for (int z = 0; z < kMaxLevel; ++z) {
    const Lattice l = lattice(z), finer = lattice(z + 1);
    const auto i = static_cast<std::int64_t>(random()) % l.columns(), j = static_cast<std::int64_t>(random()) % l.rows();
    const auto rows = row_frames(l, std::max<std::int64_t>(j - 9, 0), 20);
    expect_same(rows[static_cast<std::size_t>(std::min<std::int64_t>(j, 9))], row(l, j));
    expect_same(column_frames(l, i - 9, 20)[9], column(l, i));
    expect_same(row(finer, 2 * j), row(l, j));
    expect_same(column(finer, 2 * i), column(l, i));
  }
}

TEST(Ellipsoid, SinesAreOfOneStepAndNearlyOfOneLength) {
  const Lattice l = lattice(16);
  for (std::int64_t i = 0; i < l.columns(); i += 12347) {
    const ColumnFrame c = column(l, i);
    EXPECT_EQ(std::ldexp(c.sin_lon, 40), std::nearbyint(std::ldexp(c.sin_lon, 40)));
    EXPECT_EQ(std::ldexp(c.cos_lon, 40), std::nearbyint(std::ldexp(c.cos_lon, 40)));
    EXPECT_NEAR(c.sin_lon * c.sin_lon + c.cos_lon * c.cos_lon, 1, 0x1p-39);
  }
}

TEST(Ellipsoid, PositionsAreThoseOfGeographicLib) {
  const auto& earth = GeographicLib::Geocentric::WGS84();
  std::mt19937 random(2);
  std::uniform_real_distribution<double> heights(-11000, 9000);
  for (int n = 0; n < 5000; ++n) {
    const Lattice l = lattice(static_cast<int>(random() % (kMaxLevel + 1)));
    const auto i = static_cast<std::int64_t>(random()) % l.columns(), j = static_cast<std::int64_t>(random()) % (l.rows() + 1);
    const double height = heights(random);
    double x = 0, y = 0, z = 0;
    earth.Forward(l.latitude_deg(j), l.longitude_deg(i), height, x, y, z);
    const Vec3 at = ecef(row(l, j), column(l, i), height);
    ASSERT_NEAR(at.x, x, kRounding_m) << l.finest_level << ": " << i << ", " << j;
    ASSERT_NEAR(at.y, y, kRounding_m) << l.finest_level << ": " << i << ", " << j;
    ASSERT_NEAR(at.z, z, kRounding_m) << l.finest_level << ": " << i << ", " << j;
  }
}

TEST(Ellipsoid, HeightIsAlongTheUnitNormal) {
  const Lattice l = lattice(8);
  for (std::int64_t j = 0; j <= l.rows(); j += 911) {
    const RowFrame r = row(l, j);
    const ColumnFrame c = column(l, 3 * j + 1);
    const Vec3 n = normal(r, c), up = ecef(r, c, 1000) - ecef(r, c, 0);
    EXPECT_NEAR(dot(n, n), 1, 1e-11);
    EXPECT_NEAR(dot(up, n), 1000, 1e-8);
    const Vec3 apart = cross(up, n);
    EXPECT_LT(std::sqrt(dot(apart, apart)), 1e-5);
    EXPECT_GT(dot(n, ecef(r, c, 0)), 6.3e6);  // outwards
  }
}

TEST(Ellipsoid, CellsAreAsHighAsGeographicLibMeasures) {
  const Lattice l = lattice(13);
  for (const std::int64_t j : {std::int64_t{1}, l.rows() / 7, l.rows() / 2, l.rows() * 3 / 4, l.rows() - 1}) {
    double distance = 0;
    GeographicLib::Geodesic::WGS84().Inverse(l.latitude_deg(j - 1), 7, l.latitude_deg(j + 1), 7, distance);
    EXPECT_NEAR(cell_height_m(l, j), distance / 2, 1e-6) << j;
  }
}

}  // namespace
}  // namespace cordillera::proto
