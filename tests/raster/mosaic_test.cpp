// Several rasters as one.
#include <cmath>

#include "raster/mosaic/blend.h"
#include "raster/mosaic/mosaic.h"
#include "tests/raster/fixture.h"

namespace cordillera::raster_test {
namespace {

constexpr int kLevel = 12;
constexpr std::int64_t kWest = 900000, kNorth = 700000;

class Mosaic : public RasterTest {
 protected:
  /// A square of pixels that are cells of the lattice, `east` and `south` of the corner.
  raster::MosaicMember square(const std::string& name, int east, int south, int side, std::function<double(int, int)> value) {
    Spec spec;
    spec.columns = spec.rows = side;
    spec.geotransform = cells_of(kLevel, kWest + east, kNorth - south);
    spec.value = std::move(value);
    spec.nodata = -9999;
    const auto member = raster::examine(write(spec, name), name, raster::Trust::operator_file, plain_options());
    EXPECT_TRUE(member.ok()) << member.problem().line();
    return *member;
  }
  raster::MosaicMember plane(const std::string& name, int east, int south, int side, double height) {
    return square(name, east, south, side, [height](int, int) { return height; });
  }
  double at(raster::Source& source, int east, int south) {
    return height_m(source, lattice(kLevel), kWest + east, kNorth - south);
  }
};

TEST_F(Mosaic, the_first_wins_and_the_next_fills_its_voids) {
  const auto holed = [](int c, int r) { return c >= 20 && c < 30 && r >= 20 && r < 30 ? -9999.0 : 100.0; };
  const auto source = raster::make_mosaic({square("a.tif", 0, 0, 64, holed), plane("b.tif", 10, 10, 64, 300)}, 0);
  EXPECT_EQ(at(*source, 15, 15), 100);
  EXPECT_EQ(at(*source, 25, 25), 300);
  EXPECT_EQ(at(*source, 70, 70), 300);
  EXPECT_TRUE(std::isnan(at(*source, 5, 70)));
}

/// The one below is asked for nothing where another hides it: its file could go.
TEST_F(Mosaic, what_is_hidden_is_not_read) {
  const auto upper = plane("a.tif", 0, 0, 64, 100), hidden = plane("b.tif", 10, 10, 20, 300),
             beside = plane("c.tif", 50, 50, 64, 500);
  const auto lattice_of_level = lattice(kLevel);
  const raster::Source::Window over{kWest + 5, kNorth - 40, kWest + 40, kNorth - 5};
  const auto columns = static_cast<std::int32_t>(over.east - over.west + 1),
             rows = static_cast<std::int32_t>(over.north - over.south + 1);
  const auto both = raster::make_mosaic({upper, hidden, beside}, 0);
  std::filesystem::remove(hidden.path);
  const auto samples = both->sample(lattice_of_level, over.west, over.south, columns, rows);
  ASSERT_TRUE(samples.ok()) << samples.problem().line();
  EXPECT_EQ(samples->height, must_open(upper.path)->sample(lattice_of_level, over.west, over.south, columns, rows)->height);
  const auto pixels = both->pixels(lattice_of_level, over);
  ASSERT_TRUE(pixels.ok()) << pixels.problem().line();
  EXPECT_EQ(pixels->size(), must_open(upper.path)->pixels(lattice_of_level, over)->size());
  std::vector<double> nearest(static_cast<std::size_t>((columns - 1) * (rows - 1)));
  ASSERT_TRUE(both->nearest_in_cells(lattice_of_level, over, nearest.data()).ok());
  EXPECT_TRUE(std::ranges::all_of(nearest, [](double height) { return height == 100; }));
  EXPECT_EQ(at(*both, 100, 100), 500);
}

TEST_F(Mosaic, one_raster_is_what_it_is_alone) {
  const auto member = square("a.tif", 0, 0, 64, [](int c, int r) { return c * 3.25 + r; });
  const auto alone = must_open(member.path), mosaic = raster::make_mosaic({member}, 500);
  const proto::Samples a = whole(*alone, lattice(kLevel)),
                       b = mosaic->sample(lattice(kLevel), a.west, a.south, a.columns, a.rows).value();
  EXPECT_EQ(a.height, b.height);
}

TEST_F(Mosaic, a_seam_is_feathered_without_a_step) {
  const auto one = plane("a.tif", 0, 0, 100, 0), other = plane("b.tif", 50, 0, 100, 100);
  const double cell_m = 111000.0 * 180 / (256 << kLevel), feather_m = 20 * cell_m;
  const auto source = raster::make_mosaic({one, other}, feather_m);
  double before = at(*source, 40, 50);
  EXPECT_EQ(before, 0) << "far from its rim the first is unchanged";
  for (int east = 41; east <= 120; ++east) {
    const double now = at(*source, east, 50);
    EXPECT_LE(now - before, 12) << "at " << east;
    EXPECT_GE(now, before) << "at " << east;
    before = now;
  }
  EXPECT_EQ(before, 100);
}

TEST_F(Mosaic, a_height_does_not_depend_on_the_window_that_asked) {
  const auto rough = [](int c, int r) { return std::fmod(c * 7.3 + r * 3.1, 97.0); };
  const auto source = raster::make_mosaic(
      {square("a.tif", 0, 0, 80, rough), square("b.tif", 40, 30, 80, rough), plane("c.tif", -20, 60, 90, 50)}, 600);
  const proto::Samples all = whole(*source, lattice(kLevel));
  for (const auto [c, r, columns, rows] :
       {std::array{3, 5, 40, 20}, std::array{50, 40, 17, 60}, std::array{60, 70, 1, 1}, std::array{0, 0, 9, 130}}) {
    const proto::Samples part = source->sample(lattice(kLevel), all.west + c, all.south + r, columns, rows).value();
    for (int y = 0; y < rows; ++y) {
      for (int x = 0; x < columns; ++x)
        ASSERT_EQ(part.at(part.west + x, part.south + y), all.at(part.west + x, part.south + y)) << c + x << " " << r + y;
    }
  }
}

// Its pixels count as wide as they are at its centre, not as beside the pole: cells of the lattice become as narrow there.
TEST_F(Mosaic, of_pixels_in_degrees_up_to_a_pole_they_are_those_of_one_raster) {
  const auto from = [&](const std::string& name, double south, int rows) {
    Spec spec;
    spec.columns = 10, spec.rows = rows;
    spec.geotransform = {10, 0.01, 0, south + 0.01 * rows, 0, -0.01};
    return raster::examine(write(spec, name), name, raster::Trust::operator_file, plain_options()).value();
  };
  const auto one = raster::make_mosaic({from("all.tif", 89, 100)}, 0),
             two = raster::make_mosaic({from("s.tif", 89, 50), from("n.tif", 89.5, 50)}, 0);
  const double width_m = one->description().pixel_width_m();
  EXPECT_NEAR(two->description().pixel_width_m(), width_m, 0.01 * width_m);
}

TEST_F(Mosaic, the_window_holds_all_members_and_the_finest_says_the_level) {
  const auto fine = plane("a.tif", 0, 0, 64, 1);
  Spec coarse;
  coarse.geotransform = {-170, 0.5, 0, 45, 0, -0.5};
  const auto other = raster::examine(write(coarse, "c.tif"), "c.tif", raster::Trust::operator_file, plain_options()).value();
  const auto source = raster::make_mosaic({other, fine}, 0);
  EXPECT_EQ(source->description().pixel_height_m(), fine.description.pixel_height_m());
  EXPECT_EQ(source->description().file(), "2 rasters");
  const auto all = source->window(lattice(kLevel));
  for (const auto& member : {fine, other}) {
    const auto w = raster::coarser(member.window, lattice(kLevel));
    EXPECT_TRUE(raster::touch(w, all, lattice(kLevel)));
    EXPECT_GE(all.north, w.north);
    EXPECT_LE(all.south, w.south);
  }
  EXPECT_LE(all.east - all.west, lattice(kLevel).columns() / 2 + 60000) << "the short way round";
}

/// 1201 = 3 * 400 + 1: cutters leave slivers, whose two heights alone would ask for a level more.
TEST_F(Mosaic, slivers_do_not_make_it_finer) {
  const auto wide = plane("a.tif", 0, 0, 64, 1), sliver = plane("b.tif", 64, 0, 1, 1);
  ASSERT_EQ(sliver.description.columns(), 1u);
  const auto source = raster::make_mosaic({sliver, wide}, 0);
  EXPECT_EQ(source->description().columns(), 64u);
  EXPECT_EQ(source->description().rows(), 64u);
}

TEST_F(Mosaic, a_member_that_vanished_is_named) {
  const auto member = plane("a.tif", 0, 0, 64, 1);
  const auto source = raster::make_mosaic({member, plane("b.tif", 30, 0, 64, 1)}, 0);
  std::filesystem::remove(member.path);
  const auto samples = source->sample(lattice(kLevel), kWest, kNorth - 60, 10, 10);
  ASSERT_FALSE(samples.ok());
  EXPECT_EQ(samples.problem().type, "raster-not-found");
  EXPECT_NE(samples.problem().detail.find("a.tif"), std::string::npos);
}

/// A raster of nothing but voids is known for one; a single pixel with data, wherever it lies, makes it another.
TEST_F(Mosaic, a_raster_of_voids_is_known_for_one) {
  const auto looked_at = [&](const std::string& name, int side, std::function<double(int, int)> value) {
    const auto member = square(name, 0, 0, side, std::move(value));
    const auto found = raster::examine_pixels(member.path, name, raster::Trust::operator_file, plain_options());
    EXPECT_TRUE(found.ok()) << found.problem().line();
    return found->description.all_void();
  };
  EXPECT_TRUE(looked_at("void.tif", 300, [](int, int) { return -9999.0; }));
  EXPECT_TRUE(looked_at("dot-void.tif", 1, [](int, int) { return -9999.0; }));
  EXPECT_FALSE(looked_at("corner.tif", 300, [](int c, int r) { return c == 299 && r == 299 ? 5 : -9999.0; }));
  EXPECT_FALSE(looked_at("middle.tif", 300, [](int c, int r) { return c == 150 && r == 150 ? 0 : -9999.0; }));
}

TEST(Blend, distances_count_diagonals_as_one) {
  proto::Samples samples;
  samples.columns = samples.rows = 9;
  samples.height.assign(81, 5);
  samples.flat_water.assign(81, 0);
  samples.height[4 * 9 + 4] = proto::kNoHeight;
  const auto distance = raster::distance_to_void(samples, 3);
  for (int r = 0; r < 9; ++r) {
    for (int c = 0; c < 9; ++c)
      EXPECT_EQ(distance[static_cast<std::size_t>(r * 9 + c)], std::min(3, std::max(std::abs(r - 4), std::abs(c - 4))));
  }
}

/// Tiles that were cut from one grid give what the grid gives: no seam is to be seen.
using Window = raster::Source::Window;

/// Places to a millionth of a cell, for the same place is reached from another corner.
std::vector<std::array<std::int64_t, 3>> sorted_pixels(raster::Source& source, int level, const Window& cells) {
  std::vector<std::array<std::int64_t, 3>> all;
  const auto pixels = source.pixels(lattice(level), cells);
  EXPECT_TRUE(pixels.ok());
  for (const raster::PixelPoint& pixel : *pixels)
    all.push_back({std::llround(pixel.x * 1e6), std::llround(pixel.y * 1e6), std::llround(pixel.height_m * 1e6)});
  std::sort(all.begin(), all.end());
  return all;
}

TEST_F(Mosaic, rasters_of_one_grid_are_interpolated_across_their_sides) {
  const auto slope = [](int c, int r) { return 10.0 * c + std::fmod(r * 37.0, 50.0) + std::fmod(c * 13.0, 31.0); };
  for (const auto& [finer, point] : {std::pair(0, false), {2, false}, {0, true}, {2, true}}) {  // pixels of one and of four cells
    const auto piece = [&, finer = finer, point = point](const std::string& name, int column, int row, int columns, int rows) {
      Spec spec;
      spec.point = point;
      spec.columns = columns, spec.rows = rows;
      spec.geotransform = cells_of(kLevel - finer, kWest / (1 << finer) + column, kNorth / (1 << finer) - row);
      spec.value = [&slope, column, row](int c, int r) { return slope(c + column, r + row); };
      const auto member = raster::examine(write(spec, name), name, raster::Trust::operator_file, plain_options());
      EXPECT_TRUE(member.ok()) << member.problem().line();
      return *member;
    };
    const std::string k = std::to_string(finer) + (point ? "p" : "");
    const auto whole_grid = must_open(piece("whole" + k + ".tif", 0, 0, 60, 40).path);
    const auto pieces = raster::make_mosaic({piece("a" + k + ".tif", 0, 0, 25, 17), piece("b" + k + ".tif", 25, 0, 35, 17),
                                             piece("c" + k + ".tif", 0, 17, 25, 23), piece("d" + k + ".tif", 25, 17, 35, 23)},
                                            0);
    // Cut with a row and a column of the next ones, and with several: those pixels are in two of them, or in four.
    const std::vector<raster::MosaicMember> lapped{piece("e" + k + ".tif", 0, 0, 26, 18), piece("f" + k + ".tif", 25, 0, 35, 18),
                                                   piece("g" + k + ".tif", 0, 17, 32, 23),
                                                   piece("h" + k + ".tif", 25, 14, 35, 26)};
    const auto in_order = raster::make_mosaic(lapped, 0), reversed = raster::make_mosaic({lapped.rbegin(), lapped.rend()}, 0);
    for (const int level : {kLevel, kLevel - 1, kLevel - 2, kLevel + 2}) {
      const proto::Samples a = whole(*whole_grid, lattice(level));
      const Window cells{a.west, a.south, a.west + a.columns - 1, a.south + a.rows - 1};
      const auto pixels_there = sorted_pixels(*whole_grid, level, cells);
      for (raster::Source* const cut : {pieces.get(), in_order.get(), reversed.get()}) {
        const proto::Samples b = cut->sample(lattice(level), a.west, a.south, a.columns, a.rows).value();
        std::size_t other = 0;
        for (std::size_t v = 0; v < a.height.size(); ++v) other += a.height[v] != b.height[v] ? 1 : 0;
        EXPECT_EQ(other, 0u) << "of " << a.height.size() << ", level " << level;
        EXPECT_EQ(sorted_pixels(*cut, level, cells), pixels_there) << "level " << level;
      }
    }
  }
}

/// Between areas and points of one grid half a pixel belongs to neither, and heights are interpolated there as elsewhere.
TEST_F(Mosaic, areas_and_points_of_one_grid_have_no_gap_between_them) {
  constexpr int kSide = 30;
  const auto slope = [](int c, int r) { return 10.0 * c + 3.0 * r + std::fmod(c * 13.0 + r * 37.0, 31.0); };
  const auto piece = [&](const std::string& name, bool point, int east, int south, int columns, int rows) {
    Spec spec;
    spec.point = point;
    spec.columns = columns, spec.rows = rows;
    spec.geotransform = cells_of(kLevel - 2, kWest / 4 + east, kNorth / 4 - south);
    spec.value = [&slope, east, south](int c, int r) { return slope(c + east, r + south); };
    const auto member = raster::examine(write(spec, name), name, raster::Trust::operator_file, plain_options());
    EXPECT_TRUE(member.ok()) << member.problem().line();
    return *member;
  };
  const auto grid = must_open(piece("grid.tif", true, 0, 0, 2 * kSide, 2 * kSide).path);
  const std::vector<raster::MosaicMember> pieces{
      piece("a.tif", false, 0, 0, kSide, kSide), piece("b.tif", true, kSide, 0, kSide, kSide),
      piece("c.tif", true, 0, kSide, kSide, kSide), piece("d.tif", false, kSide, kSide, kSide, kSide)};
  for (const auto& members : {pieces, std::vector(pieces.rbegin(), pieces.rend())}) {
    const auto mosaic = raster::make_mosaic(members, 0);
    for (const int level : {kLevel, kLevel - 1, kLevel + 1}) {
      const proto::Samples a = whole(*grid, lattice(level)),
                           b = mosaic->sample(lattice(level), a.west, a.south, a.columns, a.rows).value();
      std::size_t other = 0;
      for (std::size_t v = 0; v < a.height.size(); ++v)
        other += a.height[v] != proto::kNoHeight && a.height[v] != b.height[v] ? 1 : 0;
      EXPECT_EQ(other, 0u) << "of " << a.height.size() << ", level " << level;
    }
  }
}

/// A pixel that the winner has another for is no part of the surface, however the rasters lie.
TEST_F(Mosaic, where_rasters_of_one_grid_overlap_only_the_first_ones_pixels_count) {
  const auto source = raster::make_mosaic({plane("first.tif", 0, 0, 40, 100), plane("second.tif", 30, 0, 40, 300)}, 0);
  const proto::Samples all = whole(*source, lattice(kLevel));
  const Window cells{all.west, all.south, all.west + all.columns - 1, all.south + all.rows - 1};
  std::size_t first = 0, second = 0;
  for (const auto& [x, y, height] : sorted_pixels(*source, kLevel, cells)) ++(height == 100000000 ? first : second);
  EXPECT_EQ(first, 40u * 40) << "all of them";
  EXPECT_EQ(second, 30u * 40) << "those beyond the first one's side";
}

/// GEBCO's grid and others come in pieces that meet at the poles, and none of them knows the others' last row.
TEST_F(Mosaic, a_pole_has_one_height_whatever_window_asked) {
  for (const double north : {90.0, -80.0}) {
    std::vector<raster::MosaicMember> members;
    for (int k = 0; k < 4; ++k) {
      Spec spec;
      spec.columns = 90, spec.rows = 10;
      spec.geotransform = {-180.0 + 90 * k, 1, 0, north, 0, -1};
      spec.value = [k](int, int) { return 100.0 * (k + 1); };
      const std::string name = "quarter-" + std::to_string(k) + (north > 0 ? "-n.tif" : "-s.tif");
      const auto member = raster::examine(write(spec, name), name, raster::Trust::operator_file, plain_options());
      ASSERT_TRUE(member.ok()) << member.problem().line();
      members.push_back(*member);
    }
    constexpr proto::Lattice kCoarse{3};
    const std::int64_t pole = north > 0 ? kCoarse.rows() : 0, beside = north > 0 ? pole - 1 : 1;
    const auto source = raster::make_mosaic(members, 0);
    const std::int64_t quarter = kCoarse.columns() / 4;
    for (std::int64_t k = 0; k < 4; ++k) {
      const auto samples = source->sample(kCoarse, k * quarter + 20, std::min(pole, beside), 5, 2).value();
      EXPECT_EQ(samples.at(samples.west, pole), std::lround(100 / proto::kHeightStep_m)) << "of the first, quarter " << k;
      EXPECT_EQ(samples.at(samples.west, beside), std::lround(100 * static_cast<double>(k + 1) / proto::kHeightStep_m));
    }
  }
}

}  // namespace
}  // namespace cordillera::raster_test
