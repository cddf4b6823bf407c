// Voids that data encloses are filled: which ones, with what, and the same whatever asks.
#include <algorithm>
#include <cmath>
#include <random>

#include "proto/mesh.h"
#include "raster/mosaic/mosaic.h"
#include "raster/voids/cut_voids.h"
#include "raster/voids/filled_source.h"
#include "tests/raster/fixture.h"

namespace cordillera::raster_test {
namespace {

constexpr int kLevel = 10;
constexpr std::int64_t kWest = 275000, kNorth = 160000;  // 8 E, 19.9 N
constexpr double kNone = -9999;

using Height = std::function<double(int, int)>;

/// Of pixels whose centres are vertices; the first at column west.
std::array<double, 6> centred(std::int64_t west) {
  std::array<double, 6> transform = cells_of(kLevel, west, kNorth);
  transform[0] -= transform[1] / 2;
  transform[3] -= transform[5] / 2;
  return transform;
}

class Fill : public RasterTest {
 protected:
  /// A pixel at each vertex: resampling changes nothing. Pixel (c, r) is vertex (kWest + c, kNorth - r).
  static Spec points(int columns, int rows, Height height) {
    Spec spec;
    spec.columns = columns, spec.rows = rows, spec.point = true, spec.nodata = kNone;
    spec.geotransform = centred(kWest);
    spec.value = std::move(height);
    return spec;
  }
  std::unique_ptr<raster::Source> filled(const Spec& spec, std::uint32_t limit = raster::kFillLimit_cells) {
    return raster::fill_enclosed_voids(must_open(write(spec)), limit);
  }
  static double at(raster::Source& source, int c, int r) { return height_m(source, lattice(kLevel), kWest + c, kNorth - r); }
  static bool is_void(raster::Source& source, int c, int r) { return std::isnan(at(source, c, r)); }
};

/// A disk of voids in something.
Height holed(Height around, double x, double y, double radius) {
  return [=](int c, int r) { return std::hypot(c - x, r - y) < radius ? kNone : around(c, r); };
}
double bumps(int c, int r) { return 500 + 40 * std::sin(c / 9.0) + 30 * std::cos(r / 7.0 + c / 31.0); }

TEST_F(Fill, APlaneGoesOnThroughAVoid) {
  const auto plane = [](int c, int r) { return 100 + 2.5 * c - 1.25 * r; };
  const auto source = filled(points(120, 120, holed(plane, 60, 60, 25)));
  for (int r = 30; r <= 90; ++r)
    for (int c = 30; c <= 90; ++c) ASSERT_NEAR(at(*source, c, r), plane(c, r), 0.01) << c << " " << r;
}

TEST_F(Fill, ARoundHillKeepsItsTop) {
  const auto hill = [](int c, int r) { return 1000 - 0.1 * ((c - 60) * (c - 60) + (r - 60) * (r - 60)); };
  const auto source = filled(points(120, 120, holed(hill, 60, 60, 15)));
  // What only looks at the rim's heights stays at the rim's height, 977.5 m.
  EXPECT_GT(at(*source, 60, 60), 984);
  EXPECT_LT(at(*source, 60, 60), 1000.5);
}

TEST_F(Fill, ThereAreNoStreaksFromOneHighPixelOfTheRim) {
  const auto spike = [](int c, int r) { return c == 44 && r == 60 ? 200.0 : 100.0; };
  const auto source = filled(points(120, 120, holed(spike, 60, 60, 15.9)));
  for (int c = 46; c < 76; ++c) {
    for (int r = 46; r < 75; ++r) {
      if (std::hypot(c - 60, r - 60) >= 15) continue;
      const double here = at(*source, c, r), below = at(*source, c, r + 1);
      ASSERT_LT(std::abs(here - below), 25) << "a step at " << c << " " << r;
    }
  }
  EXPECT_NEAR(at(*source, 70, 60), 100, 3) << "far from it nothing is to be seen of it";
}

TEST_F(Fill, OnlyWhatDataEnclosesIsFilled) {
  // A bay in the western side, a lake in the middle, a corner.
  const auto height = [](int c, int r) {
    if (r >= 20 && r < 30 && c < 25) return kNone;
    if (c + r > 180) return kNone;
    return std::hypot(c - 60, r - 60) < 8 ? kNone : 50.0;
  };
  const auto source = filled(points(100, 100, height));
  EXPECT_TRUE(is_void(*source, 10, 25)) << "open to the west";
  EXPECT_TRUE(is_void(*source, 24, 25));
  EXPECT_TRUE(is_void(*source, 98, 98)) << "a corner of a turned raster";
  EXPECT_NEAR(at(*source, 60, 60), 50, 0.01);
  const proto::Samples all = whole(*source, lattice(kLevel));
  const auto marked = std::count(all.flat_water.begin(), all.flat_water.end(), proto::kFilledVoid);
  EXPECT_EQ(marked, 193) << "pixels nearer than 8 to the middle, and no others";
}

TEST_F(Fill, AVoidAcrossACornerOfTwoPixelsIsTwo) {
  const auto height = [](int c, int r) { return (c == 0 && r <= 5) || (c == 1 && r == 6) || (c == 2 && r == 7) ? kNone : 9.0; };
  const auto source = filled(points(12, 12, height));
  EXPECT_TRUE(is_void(*source, 0, 3));
  EXPECT_EQ(at(*source, 1, 6), 9);
}

TEST_F(Fill, TheLimitIsWidthAndHeightInCells) {
  const auto height = [](int c, int r) { return (c >= 10 && c < 40 && r == 20) || (r >= 50 && r < 80 && c == 30) ? kNone : 7.0; };
  const Spec spec = points(100, 100, height);
  for (const auto& [limit, closed] : {std::pair{30u, true}, {29u, false}, {0u, false}}) {
    const auto source = filled(spec, limit);
    EXPECT_EQ(is_void(*source, 20, 20), !closed) << limit;
    EXPECT_EQ(is_void(*source, 30, 60), !closed) << limit;
  }
}

/// Voids of all sizes, some across the pieces of 128 vertices that are read, some open.
Height ragged() {
  return [](int c, int r) {
    const double field =
        std::sin(c / 11.0) * std::cos(r / 13.0) + 0.4 * std::sin(c / 3.1 + r / 2.3) + 0.5 * std::sin((c - r) / 41.0);
    return field > 0.75 ? kNone : bumps(c, r);
  };
}

TEST_F(Fill, EveryWindowInEveryOrderGivesTheSameBits) {
  const Spec spec = points(420, 390, ragged());
  const auto first = filled(spec);
  const proto::Samples all = whole(*first, lattice(kLevel));
  const auto marked = static_cast<std::size_t>(std::count(all.flat_water.begin(), all.flat_water.end(), proto::kFilledVoid));
  ASSERT_GT(marked, all.height.size() / 50);
  ASSERT_LT(valid_share(all), 0.9999) << "some are open";
  const std::string file = write(spec, "again.tif");
  std::mt19937 random(5);
  for (int n = 0; n < 25; ++n) {
    const auto source = raster::fill_enclosed_voids(must_open(file), raster::kFillLimit_cells);
    for (int w = 0; w < 3; ++w) {
      const auto c = static_cast<std::int32_t>(random() % 400), r = static_cast<std::int32_t>(random() % 370);
      const auto columns = static_cast<std::int32_t>(1 + random() % 90), rows = static_cast<std::int32_t>(1 + random() % 60);
      const auto part = source->sample(lattice(kLevel), all.west + c, all.south + r, columns, rows);
      ASSERT_TRUE(part.ok());
      for (std::int32_t y = 0; y < std::min(rows, all.rows - r); ++y) {
        for (std::int32_t x = 0; x < std::min(columns, all.columns - c); ++x) {
          ASSERT_EQ(part->at(part->west + x, part->south + y), all.at(part->west + x, part->south + y))
              << n << ": " << c + x << " " << r + y;
        }
      }
    }
  }
}

TEST_F(Fill, AVoidWhoseHalfWasForgottenIsFilledAsBefore) {
  // A void over each border of two pieces of 128 vertices; more pieces than are kept.
  const auto height = [](int c, int r) { return (kWest + c + 6) % 128 < 14 && r > 10 && r < 30 ? kNone : bumps(c, r); };
  const auto source = filled(points(20000, 40, height));
  const auto border = [](int n) { return static_cast<int>((kWest / 128 + 1) * 128 - kWest) + 128 * n; };
  const double before = at(*source, border(2) - 3, 20);
  ASSERT_FALSE(std::isnan(before));
  for (int n = 4; n < 140; ++n) {
    ASSERT_FALSE(is_void(*source, border(n), 20)) << n;
    ASSERT_FALSE(is_void(*source, border(2) + 3, 20));  // its other half stays in mind
  }
  EXPECT_EQ(at(*source, border(2) - 3, 20), before);
}

TEST_F(Fill, AcrossTheAntimeridianAndAroundTheEarth) {
  const auto height = holed(bumps, 40, 40, 12);
  const Spec inland = points(80, 80, height);
  Spec beyond = inland;
  beyond.geotransform = centred(lattice(kLevel).columns() - 40);
  const auto here = filled(inland);
  const auto there = raster::fill_enclosed_voids(must_open(write(beyond, "beyond.tif")), raster::kFillLimit_cells);
  const std::int64_t circle = lattice(kLevel).columns();
  for (int c = 25; c < 55; ++c) {
    for (const std::int64_t turn : {std::int64_t{0}, circle}) {
      const double across = height_m(*there, lattice(kLevel), (circle - 40 + c) % circle + turn, kNorth - 40);
      EXPECT_EQ(across, at(*here, c, 40)) << c;
    }
  }
}

TEST_F(Fill, TheWholeEarthHasNoRimButItsPolesStay) {
  Spec earth;
  earth.columns = 360, earth.rows = 180, earth.geotransform = {-180, 1, 0, 90, 0, -1}, earth.nodata = kNone;
  // A void across the antimeridian, one at the north pole.
  earth.value = [](int c, int r) { return r < 4 || ((c < 5 || c >= 354) && r >= 80 && r < 90) ? kNone : 100.0; };
  const auto source = raster::fill_enclosed_voids(must_open(write(earth)), 64);
  const proto::Lattice l = lattice(1);
  EXPECT_NEAR(height_m(*source, l, 0, l.rows() / 2 + 7), 100, 0.01);
  EXPECT_NEAR(height_m(*source, l, l.columns() - 3, l.rows() / 2 + 7), 100, 0.01);
  EXPECT_TRUE(std::isnan(height_m(*source, l, 200, l.rows())));
  EXPECT_TRUE(std::isnan(height_m(*source, l, 200, l.rows() - 3)));
}

TEST_F(Fill, OfSeveralRastersDataComesBeforeFillAndSeamsAreFilledTogether) {
  const auto member = [&](const std::string& name, int west, int columns, Height height) {
    Spec spec = points(columns, 100, [=](int c, int r) { return height(c + west, r); });
    spec.geotransform = centred(kWest + west);
    return raster::examine(write(spec, name), name, raster::Trust::operator_file, plain_options()).value();
  };
  // The first has a void that the second knows better, and both have half of one on their seam at column 100.
  const auto first = [](int c, int r) {
    return std::hypot(c - 40, r - 50) < 9 || std::hypot(c - 100, r - 50) < 9 ? kNone : 100.0;
  };
  const auto second = [](int c, int r) { return std::hypot(c - 100, r - 50) < 9 ? kNone : c < 100 ? 300.0 : 100.0; };
  const auto source = raster::fill_enclosed_voids(
      raster::make_mosaic({member("a.tif", 0, 101, first), member("b.tif", 20, 181, second)}, 0), raster::kFillLimit_cells);
  EXPECT_EQ(at(*source, 40, 50), 300) << "measured, not filled";
  EXPECT_NEAR(at(*source, 96, 50), 100, 0.1);
  EXPECT_NEAR(at(*source, 104, 50), 100, 0.1);
}

TEST_F(Fill, AnEmptyPlaceMayStillBeInsideAVoid) {
  Spec spec = points(512, 512, [](int c, int r) { return c < 128 || r < 128 || c >= 384 || r >= 384 ? 100.0 : 0.0; });
  spec.nodata.reset();
  spec.create = {"SPARSE_OK=TRUE", "TILED=YES", "BLOCKXSIZE=128", "BLOCKYSIZE=128", "COMPRESS=DEFLATE"};
  const auto holes = must_open(write(spec)), source = filled(spec);
  const std::int64_t west = kWest + 200, south = kNorth - 300;
  ASSERT_TRUE(holes->empty(lattice(kLevel), west, south, 50, 50));
  EXPECT_FALSE(source->empty(lattice(kLevel), west, south, 50, 50));
  EXPECT_NEAR(at(*source, 256, 256), 100, 0.1);
  const auto narrow = filled(spec, 100);
  EXPECT_TRUE(narrow->empty(lattice(kLevel), west, south, 50, 50)) << "the void is too large to be filled";
  EXPECT_TRUE(narrow->empty(lattice(kLevel), 10, 10, 50, 50));
}

/// A box through a void, through one of its ends, beside it, and one that the data end before.
TEST_F(Fill, ABoxThatCutsAVoidIsSeen) {
  const std::string file = write(points(120, 120, holed(bumps, 60, 60, 20)));
  const auto cuts = [&](int west, int south, int east, int north) {
    proto::BuildOptions options = plain_options();
    const proto::Lattice l = lattice(kLevel);
    for (const double side : {l.longitude_deg(kWest + west), l.latitude_deg(kNorth - south), l.longitude_deg(kWest + east),
                              l.latitude_deg(kNorth - north)})
      options.add_bbox(side);
    return raster::cuts_voids(*must_open(file, options), l, {options.bbox().data(), 4}).value();
  };
  EXPECT_TRUE(cuts(10, 110, 60, 10)) << "in its eastern side";
  EXPECT_TRUE(cuts(60, 110, 110, 10)) << "in its western side";
  EXPECT_TRUE(cuts(60, 60, 110, 10)) << "in a corner";
  EXPECT_TRUE(cuts(60, 110, 110, 60)) << "in the corner where the way around begins";
  EXPECT_FALSE(cuts(10, 110, 110, 10)) << "it lies within";
  EXPECT_FALSE(cuts(90, 110, 110, 10)) << "it lies without";
  EXPECT_FALSE(cuts(-50, 200, 200, -50)) << "the data end before";
  EXPECT_FALSE(cuts(55, 65, 65, 55)) << "nothing but the void";
}

TEST_F(Fill, OptionsSayWhatIsFilled) {
  proto::BuildOptions options;
  EXPECT_EQ(raster::fill_limit_cells(options), raster::kFillLimit_cells);
  options.set_fill_limit(20);
  EXPECT_EQ(raster::fill_limit_cells(options), 20u);
  for (const char* voids : {"hole", "12.5"}) {
    options.set_voids(voids);
    EXPECT_EQ(raster::fill_limit_cells(options), 0u) << voids;
  }
  proto::BuildOptions earlier;
  earlier.set_nodata("hole");
  EXPECT_EQ(raster::fill_limit_cells(earlier), 0u) << "a store of before voids= was an option";
}

}  // namespace
}  // namespace cordillera::raster_test
