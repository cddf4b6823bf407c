// voids= a height, of several rasters: data of any of them comes before it.
#include <cmath>

#include "raster/mosaic/mosaic.h"
#include "tests/raster/fixture.h"

namespace cordillera::raster_test {
namespace {

constexpr int kCells = 12;
constexpr std::int64_t kAtWest = 900000, kAtNorth = 700000;
constexpr double kNone = -9999;

class VoidHeights : public RasterTest {
 protected:
  /// A square of pixels that are cells of the lattice, `east` and `south` of the corner. voids: empty for none.
  raster::MosaicMember square(const std::string& name, int east, int south, int side, const std::string& voids,
                              std::function<double(int, int)> value, bool point = false) {
    Spec spec;
    spec.columns = spec.rows = side;
    spec.geotransform = cells_of(kCells, kAtWest + east, kAtNorth - south);
    spec.value = std::move(value);
    spec.nodata = kNone;
    spec.point = point;
    proto::BuildOptions options = plain_options();
    options.set_voids(voids);
    const auto member = raster::examine(write(spec, name), name, raster::Trust::operator_file, options);
    EXPECT_TRUE(member.ok()) << member.problem().line();
    return *member;
  }
  double at(raster::Source& source, int east, int south) {
    return height_m(source, lattice(kCells), kAtWest + east, kAtNorth - south);
  }
  /// Of the pixel that holds the middle of the cell south-east of a vertex.
  double nearest(raster::Source& source, int east, int south) {
    const std::int64_t west = kAtWest + east, north = kAtNorth - south;
    double out = 0;
    EXPECT_TRUE(source.nearest_in_cells(lattice(kCells), {west, north - 1, west + 1, north}, &out).ok());
    return out;
  }
};

/// 100 m with no data in the columns from `first` to before `end`.
std::function<double(int, int)> gap(int first, int end, double height_m) {
  return [=](int c, int) { return c >= first && c < end ? kNone : height_m; };
}

TEST_F(VoidHeights, are_put_where_no_raster_has_data) {
  const auto upper = square("a.tif", 0, 0, 64, "600", gap(20, 64, 100)),
             lower = square("b.tif", 32, 0, 64, "600", gap(8, 16, 300));
  const auto source = raster::make_mosaic({upper, lower}, 0);
  EXPECT_EQ(at(*source, 10, 30), 100);
  EXPECT_EQ(at(*source, 26, 30), 600) << "of the upper alone";
  EXPECT_EQ(at(*source, 36, 30), 300) << "a void of the upper, with data below";
  EXPECT_EQ(at(*source, 44, 30), 600) << "a void of both";
  EXPECT_EQ(at(*source, 80, 30), 300);
  EXPECT_TRUE(std::isnan(at(*source, 10, 80))) << "beside all";
  EXPECT_EQ(nearest(*source, 26, 30), 600);
  EXPECT_EQ(nearest(*source, 36, 30), 300);
  EXPECT_EQ(nearest(*source, 44, 30), 600);
  const auto feathered = raster::make_mosaic({upper, lower}, 500);
  EXPECT_EQ(at(*feathered, 26, 30), 600);
  EXPECT_EQ(at(*feathered, 36, 30), 300);
  EXPECT_EQ(at(*feathered, 44, 30), 600);
}

/// The first whose list gives it one.
TEST_F(VoidHeights, are_those_of_the_raster_that_has_one) {
  const auto open = square("a.tif", 0, 0, 64, "", gap(20, 40, 100)), put = square("b.tif", 0, 0, 64, "7", gap(20, 30, 300)),
             below = square("c.tif", 0, 0, 64, "8", gap(20, 30, 400));
  const auto source = raster::make_mosaic({open, put, below}, 0);
  EXPECT_EQ(at(*source, 25, 30), 7);
  EXPECT_EQ(at(*source, 35, 30), 300);
}

TEST_F(VoidHeights, do_not_depend_on_the_window_that_asked) {
  const auto rough = [](int c, int r) { return (c / 7 + r / 5) % 3 == 0 ? kNone : std::fmod(c * 7.3 + r * 3.1, 97.0); };
  for (const double feather_m : {0.0, 600.0}) {
    const auto source = raster::make_mosaic({square("a.tif", 0, 0, 80, "50", rough), square("b.tif", 40, 30, 80, "50", rough),
                                             square("c.tif", -20, 60, 90, "60", rough)},
                                            feather_m);
    const proto::Samples all = whole(*source, lattice(kCells));
    for (const auto [c, r, columns, rows] : {std::array{3, 5, 40, 20}, std::array{50, 40, 17, 60}, std::array{0, 0, 9, 130}}) {
      const proto::Samples part = source->sample(lattice(kCells), all.west + c, all.south + r, columns, rows).value();
      for (int y = 0; y < rows; ++y) {
        for (int x = 0; x < columns; ++x)
          ASSERT_EQ(part.at(part.west + x, part.south + y), all.at(part.west + x, part.south + y)) << c + x << " " << r + y;
      }
    }
  }
}

/// So that a block that a new raster does not touch stays as it is.
TEST_F(VoidHeights, where_one_raster_lies_are_as_it_has_them_alone) {
  const auto rough = [](int c, int r) { return (c / 7 + r / 5) % 3 == 0 ? kNone : std::fmod(c * 7.3 + r * 3.1, 97.0); };
  const auto member = square("a.tif", 0, 0, 80, "50", rough), beside = square("b.tif", 60, 60, 80, "50", rough);
  proto::BuildOptions options = plain_options();
  options.set_voids("50");
  const auto alone = must_open(member.path, options), both = raster::make_mosaic({member, beside}, 0);
  const raster::Source::Window over{kAtWest, kAtNorth - 80, kAtWest + 59, kAtNorth},
      wider{over.west, over.south, kAtWest + 80, over.north};
  const auto sampled = [&](raster::Source& source, const raster::Source::Window& w) {
    return source
        .sample(lattice(kCells), w.west, w.south, static_cast<std::int32_t>(w.east - w.west + 1),
                static_cast<std::int32_t>(w.north - w.south + 1))
        .value();
  };
  EXPECT_EQ(sampled(*both, over).height, sampled(*alone, over).height);
  const proto::Samples a = sampled(*alone, wider), b = sampled(*both, wider);
  for (std::int64_t j = wider.south; j <= wider.north; ++j)
    for (std::int64_t i = wider.west; i <= over.east; ++i)
      ASSERT_EQ(a.at(i, j), b.at(i, j)) << i - wider.west << " " << j - wider.south;
  const auto count = [&](raster::Source& source) {
    const auto pixels = source.pixels(lattice(kCells), wider).value();
    return std::ranges::count_if(pixels, [](const raster::PixelPoint& pixel) { return pixel.x < 59; });
  };
  EXPECT_EQ(count(*alone), 59 * 80) << "what is put there is a pixel, too";
  EXPECT_EQ(count(*both), count(*alone));
}

/// Tiles that were cut from one grid: but on their common sides, where each has its own, all is as in one raster.
TEST_F(VoidHeights, of_one_grid_have_no_gap_between_rasters) {
  for (const bool point : {false, true}) {
    const auto ground = [](int c, int r) { return c + r > 90 ? kNone : 10.0 * c + r; };
    const std::string k = point ? "p.tif" : "a.tif";
    const auto piece = [&](const std::string& name, int east, int south, int side) {
      return square(
          name + k, east, south, side, "5", [=](int c, int r) { return ground(c + east, r + south); }, point);
    };
    proto::BuildOptions options = plain_options();
    options.set_voids("5");
    const auto one = must_open(piece("whole", 0, 0, 80).path, options);
    const auto four =
        raster::make_mosaic({piece("nw", 0, 0, 40), piece("ne", 40, 0, 40), piece("sw", 0, 40, 40), piece("se", 40, 40, 40)}, 0);
    const proto::Samples a = whole(*one, lattice(kCells)),
                         b = four->sample(lattice(kCells), a.west, a.south, a.columns, a.rows).value();
    int apart = 0;
    for (std::int64_t j = a.south; j < a.south + a.rows; ++j) {
      for (std::int64_t i = a.west; i < a.west + a.columns; ++i) {
        EXPECT_EQ(a.at(i, j) == proto::kNoHeight, b.at(i, j) == proto::kNoHeight)
            << i - kAtWest << " " << kAtNorth - j << " " << k;
        if (a.at(i, j) != b.at(i, j)) ++apart;
        const bool near_side = std::abs(i - kAtWest - 40) <= 3 || std::abs(kAtNorth - j - 40) <= 3;
        EXPECT_TRUE(near_side || a.at(i, j) == b.at(i, j)) << i - kAtWest << " " << kAtNorth - j << " " << k;
      }
    }
    EXPECT_LE(apart, 8) << k;
  }
}

}  // namespace
}  // namespace cordillera::raster_test
