// Any CRS, any geotransform, any place: heights that are a linear function of map coordinates must come back at every vertex.
#include <ogr_spatialref.h>

#include <cmath>
#include <memory>

#include "fixture.h"

namespace cordillera::raster_test {
namespace {

using Crs = RasterTest;

struct Linear {
  std::array<double, 6> gt;
  double middle_x, middle_y, unit;
  double operator()(double x, double y) const { return 500 + (3 * (x - middle_x) + 2 * (y - middle_y)) / unit; }
  double pixel(int c, int r) const {
    return (*this)(gt[0] + (c + 0.5) * gt[1] + (r + 0.5) * gt[2], gt[3] + (c + 0.5) * gt[4] + (r + 0.5) * gt[5]);
  }
};

Linear linear(const Spec& s) {
  const auto& g = s.geotransform;
  return {g, g[0] + s.columns / 2.0 * g[1] + s.rows / 2.0 * g[2], g[3] + s.columns / 2.0 * g[4] + s.rows / 2.0 * g[5],
          std::max(std::hypot(g[1], g[4]), std::hypot(g[2], g[5]))};
}

/// Samples the raster at the level and compares every vertex that is no closer than a pixel to the rim. Returns how many it
/// compared.
int compare(raster::Source& source, const Spec& spec, const Linear& f, int level) {
  OGRSpatialReference wgs84, srs;
  wgs84.importFromEPSG(4326);
  wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  srs.SetFromUserInput(spec.crs.c_str());
  srs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::unique_ptr<OGRCoordinateTransformation> to_map(OGRCreateCoordinateTransformation(&wgs84, &srs));
  const proto::Lattice l = lattice(level);
  const proto::Samples s = whole(source, l);
  int compared = 0;
  for (std::int64_t j = s.south; j < s.south + s.rows; ++j) {
    for (std::int64_t i = s.west; i < s.west + s.columns; ++i) {
      double x = std::remainder(l.longitude_deg(i), 360.0), y = l.latitude_deg(j);
      if (!to_map->Transform(1, &x, &y)) continue;
      constexpr double kMercatorTurn_m = 2 * 20037508.342789244;
      if (spec.crs == "EPSG:3857") x = f.middle_x + std::remainder(x - f.middle_x, kMercatorTurn_m);
      const auto& g = f.gt;
      const double det = g[1] * g[5] - g[2] * g[4];
      const double c = ((x - g[0]) * g[5] - (y - g[3]) * g[2]) / det, r = ((y - g[3]) * g[1] - (x - g[0]) * g[4]) / det;
      if (c < 1 || r < 1 || c > spec.columns - 1 || r > spec.rows - 1) {
        const bool outside = c < -0.01 || r < -0.01 || c > spec.columns + 0.01 || r > spec.rows + 0.01;
        EXPECT_TRUE(!outside || s.at(i, j) == proto::kNoHeight);
        continue;
      }
      EXPECT_NEAR(s.at(i, j) / 1024.0, f(x, y), 0.01) << spec.crs << " at " << l.longitude_deg(i) << ", " << l.latitude_deg(j);
      ++compared;
      if (::testing::Test::HasFailure()) return compared;
    }
  }
  return compared;
}

struct Case {
  const char* what;
  const char* crs;
  std::array<double, 6> geotransform;
  int level;
};

const Case kCases[] = {
    {"geographic", "EPSG:4326", {10, 0.01, 0, 45, 0, -0.01}, 7},
    {"another datum", "EPSG:4277", {-2, 0.01, 0, 52, 0, -0.01}, 7},
    {"south-up", "EPSG:4326", {10, 0.01, 0, 45, 0, 0.01}, 7},
    {"east-left", "EPSG:4326", {10, -0.01, 0, 45, 0, -0.01}, 7},
    {"not square", "EPSG:4326", {10, 0.002, 0, 45, 0, -0.01}, 9},
    {"rotated", "EPSG:32633", {500000, 250, 120, 5200000, 130, -240}, 9},
    {"rotated by a right angle", "EPSG:32633", {500000, 0, 250, 5200000, 250, 0}, 9},
    {"utm south", "EPSG:32719", {300000, 90, 0, 7000000, 0, -90}, 11},
    {"web mercator", "EPSG:3857", {1000000, 100, 0, 6000000, 0, -100}, 11},
    {"web mercator over the antimeridian", "EPSG:3857", {-20037508.342789244 - 2000, 100, 0, -5000000, 0, -100}, 11},
    {"feet", "EPSG:2248", {1296399, 300, 0, 417474, 0, -300}, 11},
    {"no code", "+proj=laea +lat_0=47 +lon_0=9 +ellps=GRS80 +units=m +no_defs", {20000, 100, 0, 30000, 0, -100}, 11},
    {"oblique", "EPSG:2056", {2600000, 100, 0, 1200000, 0, -100}, 11},
    {"bound",
     "+proj=tmerc +lat_0=0 +lon_0=9 +k=1 +x_0=3500000 +ellps=bessel +towgs84=598.1,73.7,418.2,0.202,0.045,-2.455,6.7 +units=m",
     {3500000, 100, 0, 5500000, 0, -100},
     11},
    {"nad27", "EPSG:26710", {557805, 30, 0, 5122005, 0, -30}, 12},
    {"prime meridian of Paris", "EPSG:27572", {600000, 100, 0, 2400000, 0, -100}, 11},
    {"grads", "EPSG:4807", {0.5, 0.01, 0, 52, 0, -0.01}, 8},
    {"polar", "EPSG:3031", {2301440, 320, 0, 495688, 0, -320}, 9},
    {"over the pole", "EPSG:3413", {-40000, 2000, 0, 40000, 0, -2000}, 6},
};

TEST_F(Crs, LinearSurfacesComeBack) {
  for (const Case& k : kCases) {
    SCOPED_TRACE(k.what);
    Spec spec;
    spec.crs = k.crs, spec.geotransform = k.geotransform, spec.columns = 40, spec.rows = 30, spec.type = "Float64";
    const Linear f = linear(spec);
    spec.value = [f](int c, int r) { return f.pixel(c, r); };
    const auto source = must_open(write(spec));
    ASSERT_TRUE(source);
    EXPECT_GT(compare(*source, spec, f, k.level), 300);
    if (::testing::Test::HasFailure()) return;
  }
}

TEST_F(Crs, PixelSizeIsOnTheGround) {
  Spec spec;
  spec.crs = "EPSG:3857", spec.geotransform = {-13604024, 14.4614, 0, 5816655, 0, -14.4614}, spec.columns = 307, spec.rows = 446;
  const auto source = must_open(write(spec));
  EXPECT_NEAR(source->description().pixel_width_m(), 10, 0.1);
  EXPECT_NEAR(source->description().pixel_height_m(), 10, 0.1);
  EXPECT_EQ(source->description().crs(), "WGS 84 / Pseudo-Mercator (EPSG:3857)");
}

TEST_F(Crs, NamesItsDatumAndSaysWhetherProjKnowsAWayFromIt) {
  const auto described = [this](const std::string& crs, double west = 500000) {
    Spec spec;
    spec.crs = crs;
    spec.geotransform = {west, 30, 0, 5500000, 0, -30};
    return must_open(write(spec))->description();
  };
  EXPECT_EQ(described("EPSG:32632").horizontal_datum(), "WGS 1984");
  EXPECT_FALSE(described("EPSG:32632").datum_ignored());
  EXPECT_FALSE(described("EPSG:31467", 3500000).datum_ignored()) << "DHDN has a way without a grid";
  EXPECT_TRUE(described("+proj=utm +zone=32 +ellps=bessel +units=m +no_defs").datum_ignored());
}

/// PROJ calls the way over another prime meridian ballpark, and applies the shift.
TEST_F(Crs, AShiftThatTheCrsSaysIsNotIgnored) {
  Spec spec;
  spec.geotransform = {31, 0.01, 0, 48, 0, -0.01}, spec.crs = "";
  const std::string file = write(spec);
  const auto described = [&](const std::string& shift) {
    proto::BuildOptions options;
    options.set_crs("+proj=longlat +ellps=bessel +pm=ferro" + shift);
    return must_open(file, options)->description();
  };
  const proto::Source shifted = described(" +towgs84=682,-203,480,0,0,0,0");
  EXPECT_FALSE(shifted.datum_ignored());
  EXPECT_NEAR(shifted.bbox(0), 13.328579, 1e-5) << "13.333333 without the shift";
  EXPECT_FALSE(described(" +nadgrids=@null").datum_ignored());
  EXPECT_TRUE(described("").datum_ignored());
}

TEST_F(Crs, OverTheAntimeridian) {
  for (const double west : {175.0, -185.0}) {
    Spec spec;
    spec.columns = 40, spec.rows = 20, spec.geotransform = {west, 0.25, 0, 10, 0, -0.25};
    spec.value = [](int c, int) { return 10.0 * c; };
    const auto source = must_open(write(spec));
    ASSERT_TRUE(source);
    const proto::Lattice l = lattice(2);
    const auto w = source->window(l);
    EXPECT_EQ(w.west, std::llround((175.0 + 180) / l.cell_deg() + 0.4999));
    EXPECT_GT(w.east, l.columns());
    EXPECT_NEAR(height_m(*source, l, 0, 555), 195, 0.01);
    EXPECT_NEAR(height_m(*source, l, l.columns(), 555), 195, 0.01);
    EXPECT_EQ(valid_share(whole(*source, l)), 1.0);
    EXPECT_GT(source->description().bbox(0), source->description().bbox(2));
  }
}

TEST_F(Crs, TheGlobeClosesWithoutASeam) {
  for (const double west : {-180.0, 0.0, -180.5}) {
    Spec spec;
    const bool registered = west == -180.5;  // points on whole degrees, the last column repeats the first, rims past the poles
    spec.columns = registered ? 361 : 360, spec.rows = registered ? 181 : 180, spec.point = registered;
    spec.geotransform = {west, 1, 0, registered ? 90.5 : 90, 0, -1}, spec.type = "Float64";
    spec.value = [west](int c, int) { return 1000 * std::cos((west + c + 0.5) * 3.14159265358979 / 180); };
    const auto source = must_open(write(spec));
    ASSERT_TRUE(source);
    const proto::Lattice l = lattice(1);
    const auto w = source->window(l);
    EXPECT_EQ(w.west, 0);
    EXPECT_EQ(w.east, l.columns());
    EXPECT_EQ(w.south, 0);
    EXPECT_EQ(w.north, l.rows());
    const proto::Samples s = whole(*source, l);
    EXPECT_EQ(valid_share(s), 1.0);
    for (std::int64_t i = 0; i <= l.columns(); ++i) {
      ASSERT_EQ(s.at(i, 0), s.at(0, 0));  // a pole is one point
      ASSERT_EQ(s.at(i, l.rows()), s.at(0, l.rows()));
      const double expected = 1000 * std::cos(l.longitude_deg(i) * 3.14159265358979 / 180);
      ASSERT_NEAR(s.at(i, 200) / 1024.0, expected, 0.2) << "longitude " << l.longitude_deg(i) << " from " << west;
    }
    ASSERT_EQ(s.at(0, 200), s.at(l.columns(), 200));
  }
}

// As header files of grids write 1/12 of a degree: the last row would end a hand's breadth before the pole.
TEST_F(Crs, AWorldOfRoundedPixelsGoesUpToThePoles) {
  for (const bool point : {false, true}) {
    Spec spec;
    spec.columns = 720, spec.rows = point ? 361 : 360, spec.point = point;
    spec.geotransform = {-180, 0.4999999, 0, (point ? 180.5 : 180) * 0.4999999, 0, -0.4999999};
    spec.value = [](int, int) { return 250.0; };
    const auto source = must_open(write(spec));
    ASSERT_TRUE(source);
    const proto::Lattice l = lattice(1);
    EXPECT_EQ(source->window(l).south, 0);
    EXPECT_EQ(source->window(l).north, l.rows());
    EXPECT_EQ(valid_share(whole(*source, l)), 1.0) << (point ? "points" : "areas");
  }
}

// A strip of it stays where it is.
TEST_F(Crs, ARasterThatEndsBeforeAPoleStaysThere) {
  Spec spec;
  spec.columns = 720, spec.rows = 20, spec.geotransform = {-180, 0.5, 0, 89.95, 0, -0.5};
  const auto source = must_open(write(spec));
  ASSERT_TRUE(source);
  EXPECT_LT(source->window(lattice(3)).north, lattice(3).rows());
  EXPECT_NEAR(source->description().bbox(3), 89.95, 1e-9);
}

TEST_F(Crs, RowsPastThePoleAreCutOff) {
  Spec spec;
  spec.columns = 720, spec.rows = 20, spec.geotransform = {-180, 0.5, 0, 92, 0, -0.5};  // four rows beyond 90
  spec.value = [](int, int r) { return r < 4 ? 9999.0 : 100.0; };
  const auto source = must_open(write(spec));
  ASSERT_TRUE(source);
  const proto::Lattice l = lattice(1);
  EXPECT_EQ(source->window(l).north, l.rows());
  for (std::int64_t i = 0; i < l.columns(); i += 7) { ASSERT_NEAR(height_m(*source, l, i, l.rows() - 2), 100, 0.01); }
  ASSERT_EQ(source->description().notes_size(), 1);
  EXPECT_EQ(source->description().notes(0),
            "2880 of 14400 pixels of dem.tif lie beyond a pole, and are left out: is it placed right?");
}

/// Half a pixel beyond a pole, or one column twice, is how grids of points are written.
TEST_F(Crs, PixelsThatLieNowhereAreTold) {
  const auto notes = [this](const Spec& spec) {
    const auto source = must_open(write(spec));
    return std::vector<std::string>(source->description().notes().begin(), source->description().notes().end());
  };
  Spec world;
  world.columns = 361, world.rows = 181, world.point = true, world.geotransform = {-180.5, 1, 0, 90.5, 0, -1};
  EXPECT_EQ(notes(world), std::vector<std::string>());
  world.columns = 370;
  EXPECT_EQ(notes(world), std::vector<std::string>{"1810 of 66970 pixels of dem.tif lie in columns beyond 360 degrees, where "
                                                   "others are, and are left out: is it placed right?"});
  world.columns = 550, world.geotransform[1] = 0.7;  // no whole number of them is a turn
  EXPECT_EQ(notes(world).size(), 1u);
  Spec tall;  // four rows beyond each pole
  tall.columns = 4, tall.rows = 200, tall.geotransform = {10, 1, 0, -94, 0, 0.94};
  EXPECT_EQ(notes(tall),
            std::vector<std::string>{"32 of 800 pixels of dem.tif lie beyond a pole, and are left out: is it placed right?"});
  Spec aslant;
  aslant.columns = aslant.rows = 10, aslant.geotransform = {10, 0.1, 0, 90, 0.1, -0.1};
  EXPECT_EQ(notes(aslant),
            std::vector<std::string>{"45 of 100 pixels of dem.tif lie beyond a pole, and are left out: is it placed right?"});
}

TEST_F(Crs, TheRequestMaySayWhatTheSourceDoesNotSayAboutHeights) {
  proto::BuildOptions options;
  const std::string flat = write({});
  for (const auto& [crs, datum] : {std::pair{"EPSG:4979", "ellipsoid"}, {"EPSG:4326+5773", "EGM96"}}) {
    options.set_crs(crs);
    const auto source = must_open(flat, options);
    ASSERT_TRUE(source) << crs;
    EXPECT_EQ(source->description().vertical_datum(), datum);
    EXPECT_EQ(source->description().vertical_datum_from(), "request");
    EXPECT_EQ(source->description().crs_from(), "source");
  }
  Spec high;
  high.crs = "EPSG:4979";
  options.set_crs("EPSG:4326+5773");
  EXPECT_EQ(problem_type(write(high), options), "crs-conflict");
  options.set_crs("EPSG:4979");
  EXPECT_EQ(must_open(write(high), options)->description().vertical_datum_from(), "source");
  Spec bare;
  bare.crs = "";
  EXPECT_EQ(must_open(write(bare), options)->description().vertical_datum_from(), "request");
}

TEST_F(Crs, AroundThePole) {
  Spec spec;
  spec.crs = "EPSG:3413", spec.geotransform = {-400000, 20000, 0, 400000, 0, -20000}, spec.columns = spec.rows = 40;
  const auto source = must_open(write(spec));
  ASSERT_TRUE(source);
  const proto::Lattice l = lattice(1);
  const auto w = source->window(l);
  EXPECT_EQ(w.west, 0);
  EXPECT_EQ(w.east, l.columns());
  EXPECT_EQ(w.north, l.rows());
  EXPECT_LT(l.latitude_deg(w.south), 85.1);
  EXPECT_GT(l.latitude_deg(w.south), 83);
  const proto::Samples s = whole(*source, l);
  for (std::int64_t i = 0; i < l.columns(); ++i) {
    ASSERT_EQ(s.at(i, l.rows()), 100 * 1024);
    ASSERT_EQ(s.at(i, l.rows() - 4), 100 * 1024);
  }
  EXPECT_EQ(source->description().bbox(3), 90);
}

/// Every vertex around the window is taken to the map by itself: what lies in the raster must lie in the window.
TEST_F(Crs, WindowsCutNothingOffAndAreSnug) {
  for (const Case& k : kCases) {
    SCOPED_TRACE(k.what);
    Spec spec;
    spec.crs = k.crs, spec.geotransform = k.geotransform, spec.columns = 40, spec.rows = 30;
    const auto source = must_open(write(spec));
    ASSERT_TRUE(source);
    OGRSpatialReference wgs84, srs;
    wgs84.importFromEPSG(4326);
    wgs84.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    srs.SetFromUserInput(spec.crs.c_str());
    srs.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
    const std::unique_ptr<OGRCoordinateTransformation> to_map(OGRCreateCoordinateTransformation(&wgs84, &srs));
    const proto::Lattice l = lattice(k.level);
    const auto w = source->window(l);
    const auto& g = spec.geotransform;
    const double det = g[1] * g[5] - g[2] * g[4];
    const double middle = g[0] + g[1] * spec.columns / 2 + g[2] * spec.rows / 2;
    std::int64_t south = w.north, north = w.south;
    for (std::int64_t j = w.south - 30; j <= std::min(w.north + 30, l.rows()); ++j) {
      for (std::int64_t i = w.west - 30; i <= w.east + 30; ++i) {
        double x = std::remainder(l.longitude_deg(i), 360.0), y = l.latitude_deg(j);
        if (!to_map->Transform(1, &x, &y)) continue;
        if (spec.crs == "EPSG:3857") x = middle + std::remainder(x - middle, 2 * 20037508.342789244);
        const double c = ((x - g[0]) * g[5] - (y - g[3]) * g[2]) / det, r = ((y - g[3]) * g[1] - (x - g[0]) * g[4]) / det;
        if (c < 0.001 || r < 0.001 || c > spec.columns - 0.001 || r > spec.rows - 0.001) continue;
        const bool around = w.east - w.west >= l.columns();
        ASSERT_TRUE(j >= w.south && j <= w.north && (around || (i >= w.west && i <= w.east))) << i << ", " << j;
        south = std::min(south, j), north = std::max(north, j);
      }
    }
    EXPECT_GT(static_cast<double>(north - south + 1) / static_cast<double>(w.north - w.south + 1), 0.9);
  }
}

TEST_F(Crs, RequestsAndRefusals) {
  Spec bare;
  bare.crs = "";
  const std::string file = write(bare);
  EXPECT_EQ(problem_type(file), "raster-without-crs");
  proto::BuildOptions options = plain_options();
  options.set_crs("EPSG:4326");
  const auto source = must_open(file, options);
  ASSERT_TRUE(source);
  EXPECT_EQ(source->description().crs_from(), "request");
  options.set_crs("4326");
  EXPECT_EQ(must_open(file, options)->description().crs(), source->description().crs());
  for (const char* unknown : {"EPSG:999999", "999999", "nonsense", "/etc/passwd", "https://example.com/a.prj"}) {
    options.set_crs(unknown);
    auto refused = open(file, options);
    ASSERT_FALSE(refused.ok());
    EXPECT_EQ(refused.problem().type, "crs-unknown");
    EXPECT_EQ(refused.problem().parameter, "crs");
  }
  options.set_crs("LOCAL_CS[\"site grid\",UNIT[\"metre\",1]]");
  EXPECT_EQ(problem_type(file, options), "crs-unsupported");
  options.set_crs("EPSG:4978");
  EXPECT_EQ(problem_type(file, options), "crs-unsupported");
  options.set_crs("EPSG:25832");
  EXPECT_EQ(problem_type(write({}), options), "crs-conflict");
  EXPECT_NE(open(write({}), options).problem().accepted.find("gdal_translate -a_srs EPSG:25832 dem.tif dem-2.tif"),
            std::string::npos);
  options.set_crs("EPSG:4326");
  EXPECT_TRUE(must_open(write({}), options));
  Spec local;
  local.crs = "LOCAL_CS[\"site grid\",UNIT[\"metre\",1]]";
  EXPECT_EQ(problem_type(write(local)), "crs-unsupported");
  EXPECT_EQ(open(write(local)).problem().parameter, "crs");
  const auto placed = must_open(write(local), options);
  ASSERT_TRUE(placed) << "a local system says nothing of the earth";
  EXPECT_EQ(placed->description().crs_from(), "request");
  Spec metres;
  metres.geotransform = {376313, 30, 0, 3807917, 0, -30};
  EXPECT_EQ(problem_type(write(metres)), "crs-mismatch");
  Spec degrees;
  degrees.crs = "EPSG:32632", degrees.geotransform = {7.5, 0.0002, 0, 46, 0, -0.0002};
  EXPECT_EQ(problem_type(write(degrees)), "crs-mismatch");
  Spec around_a_pole;  // half of its rows lie beyond it, and its middle where a pixel has no width
  around_a_pole.geotransform = {8, 0.01, 0, 90 + 0.01 * around_a_pole.rows / 2, 0, -0.01};
  EXPECT_TRUE(must_open(write(around_a_pole)));
  Spec nowhere;
  nowhere.crs = "EPSG:3857", nowhere.geotransform = {1e12, 30, 0, 1e12, 0, -30};
  EXPECT_NE(problem_type(write(nowhere)), "");
  Spec unplaced;
  unplaced.georeferenced = false;
  EXPECT_EQ(problem_type(write(unplaced)), "raster-not-georeferenced");
  EXPECT_NE(open(write(unplaced)).problem().accepted.find("gdal_translate -a_ullr WEST NORTH EAST SOUTH dem.tif dem-2.tif"),
            std::string::npos);
}

}  // namespace
}  // namespace cordillera::raster_test
