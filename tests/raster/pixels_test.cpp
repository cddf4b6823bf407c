// The raster's own pixels on the lattice, and samples that are moved until the surface meets them.
#include <gdal_priv.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <fstream>

#include "fixture.h"
#include "raster/sample/back_projection.h"

namespace cordillera::raster_test {
namespace {

using Pixels = RasterTest;
using Window = raster::Source::Window;

constexpr int kLevel = 12;

/// Rough ground: neighbours differ by metres to tens of metres.
double rough(int c, int r) {
  const auto noise = [](int a, int b) {
    return static_cast<double>((static_cast<unsigned>(a) * 2654435761u ^ static_cast<unsigned>(b) * 40503u * 977u) >> 16 & 255u) /
           255;
  };
  return 800 + 200 * std::sin(c * 0.05) * std::cos(r * 0.04) + 15 * noise(c / 2, r / 2) + 8 * noise(c, r);
}

/// Pixels of 30 m in UTM, askew on the lattice: cells of level 12 are 0.64 of them.
Spec rough_utm() {
  Spec spec;
  spec.columns = 90, spec.rows = 80;
  spec.crs = "EPSG:32611";
  spec.geotransform = {400000, 30, 0, 3800000, 0, -30};
  spec.value = rough;
  return spec;
}

constexpr double kWithin_m = 0.02;

std::unique_ptr<raster::Source> moved(std::unique_ptr<raster::Source> source, double within_m = kWithin_m, int level = kLevel) {
  return raster::project_back(std::move(source), level, within_m);
}

double surface_m(const proto::Samples& s, const raster::PixelPoint& p) {
  const auto c = static_cast<std::int64_t>(p.x), r = std::min<std::int64_t>(static_cast<std::int64_t>(p.y), s.rows - 2);
  const double fx = p.x - static_cast<double>(c), fy = p.y - static_cast<double>(r);
  const auto at = [&](std::int64_t dc, std::int64_t dr) {
    const std::int32_t h = s.at(s.west + c + dc, s.south + r + dr);
    return h == proto::kNoHeight ? NAN : h * proto::kHeightStep_m;
  };
  return fx >= fy ? at(0, 0) + fx * (at(1, 0) - at(0, 0)) + fy * (at(1, 1) - at(1, 0))
                  : at(0, 0) + fy * (at(0, 1) - at(0, 0)) + fx * (at(1, 1) - at(0, 1));
}

struct Off {
  double greatest_m = 0;
  int pixels = 0;
};

/// Of all pixels between vertices with data.
Off off(raster::Source& source, int level) {
  const proto::Samples samples = whole(source, lattice(level));
  const auto pixels = source.pixels(
      lattice(level), {samples.west, samples.south, samples.west + samples.columns - 1, samples.south + samples.rows - 1});
  EXPECT_TRUE(pixels.ok());
  Off off;
  for (const raster::PixelPoint& p : *pixels) {
    const double away_m = std::abs(surface_m(samples, p) - p.height_m);
    if (std::isnan(away_m)) continue;
    off.greatest_m = std::max(off.greatest_m, away_m);
    ++off.pixels;
  }
  return off;
}

TEST_F(Pixels, EachOnceInTheCellsOfItsPlace) {
  const auto source = must_open(write(rough_utm()));
  const Window w = source->window(lattice(kLevel));
  const auto all = source->pixels(lattice(kLevel), {w.west - 2, w.south - 2, w.east + 2, w.north + 2});
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->size(), 90u * 80u);
  std::size_t parts = 0;
  for (std::int64_t south = w.south - 2; south < w.north + 2; south += 37) {
    for (std::int64_t west = w.west - 2; west < w.east + 2; west += 41) {
      const auto some =
          source->pixels(lattice(kLevel), {west, south, std::min(west + 41, w.east + 2), std::min(south + 37, w.north + 2)});
      ASSERT_TRUE(some.ok());
      parts += some->size();
    }
  }
  EXPECT_EQ(parts, all->size());
}

TEST_F(Pixels, StandOnVerticesWhereTheyWereMadeThere) {
  Spec spec;
  spec.columns = spec.rows = 16;
  spec.point = true;
  spec.geotransform = cells_of(8, 70000, 50000);
  spec.geotransform[0] -= spec.geotransform[1] / 2, spec.geotransform[3] -= spec.geotransform[5] / 2;
  spec.value = [](int c, int r) { return 10.0 * c + r; };
  proto::BuildOptions options = plain_options();
  options.set_vertical_datum("EGM96");
  const auto source = moved(must_open(write(spec), options));
  const auto pixels = source->pixels(lattice(8), {70000, 49984, 70016, 50001});
  ASSERT_TRUE(pixels.ok());
  ASSERT_EQ(pixels->size(), 256u);
  for (const raster::PixelPoint& p : *pixels) {
    ASSERT_EQ(p.x, std::floor(p.x));
    ASSERT_EQ(p.y, std::floor(p.y));
    EXPECT_NEAR(p.height_m,
                height_m(*source, lattice(8), 70000 + static_cast<std::int64_t>(p.x), 49984 + static_cast<std::int64_t>(p.y)),
                0.001);
  }
}

TEST_F(Pixels, BackProjectionMeetsThem) {
  const std::string file = write(rough_utm());
  const auto plain = must_open(file), exact = moved(must_open(file));
  const Off before = off(*plain, kLevel), after = off(*exact, kLevel);
  EXPECT_GT(before.greatest_m, 5);
  EXPECT_LT(after.greatest_m, 0.05);
  EXPECT_EQ(before.pixels, after.pixels);
  EXPECT_GT(after.pixels, 6500);
}

// A tower of 80 m in pixels of 1 m. Where samples may go where they like, they meet its pixels too, and its roof wears spikes of
// 28 m.
TEST_F(Pixels, BackProjectionLeavesARoofWithoutACrown) {
  Spec spec;
  spec.columns = spec.rows = 60;
  spec.crs = "EPSG:32632";
  spec.geotransform = {356000, 1, 0, 5699100, 0, -1};
  spec.value = [](int c, int r) { return std::abs(c - r) < 30 && c > 12 && r > 15 && c < 45 && r < 50 ? 180.0 : 100.0; };
  const auto exact = moved(must_open(write(spec)), 0.015, 17);
  const proto::Samples samples = whole(*exact, lattice(17));
  std::int32_t highest = INT32_MIN, lowest = INT32_MAX;
  for (const std::int32_t h : samples.height) {
    if (h == proto::kNoHeight) continue;
    highest = std::max(highest, h), lowest = std::min(lowest, h);
  }
  EXPECT_LT(highest * proto::kHeightStep_m, 180 + 14);
  EXPECT_GT(lowest * proto::kHeightStep_m, 100 - 14);
  const Off after = off(*exact, 17);
  EXPECT_LT(after.greatest_m, 0.15);
  EXPECT_GT(after.pixels, 3300);
}

TEST_F(Pixels, BackProjectionIsNearerWhereTheLatticeIsTooCoarseToMeetThem) {
  Spec spec = rough_utm();
  spec.geotransform[1] = 20, spec.geotransform[5] = -20;  // cells of 0.96 pixels
  const std::string file = write(spec);
  const auto plain = must_open(file), exact = moved(must_open(file));
  EXPECT_LT(off(*exact, kLevel).greatest_m, 0.6 * off(*plain, kLevel).greatest_m);
  EXPECT_EQ(whole(*plain, lattice(kLevel - 1)).height, whole(*exact, lattice(kLevel - 1)).height)
      << "another level stays as it is";
}

// Heights of points are valid between four of them alone, so a line of single ones in a void was painted over by the fill.
TEST_F(Pixels, WhatAFillClosesMeetsPixelsInIt) {
  Spec spec = rough_utm();
  spec.point = true;
  spec.nodata = -1;
  spec.value = [](int c, int r) {
    return c > 20 && c < 60 && r > 20 && r < 60 && r != 40 ? -1 : rough(c, r) + (r == 40 ? 300 : 0);
  };
  const std::string file = write(spec);
  proto::BuildOptions options = plain_options();
  options.set_voids("fill");
  auto filled = raster::open_filled_source(file, "dem.tif", raster::Trust::operator_file, options);
  ASSERT_TRUE(filled.ok()) << filled.problem().line();
  const Off closed = off(*moved(std::move(*filled)), kLevel);
  EXPECT_GE(closed.pixels, off(*must_open(file), kLevel).pixels + 39) << "all those of the line";
  EXPECT_LT(closed.greatest_m, 1);
}

TEST_F(Pixels, BesideAVoidCornerTheOtherThreeMeetThem) {
  Spec spec = rough_utm();
  spec.nodata = -1;
  spec.value = [](int c, int r) { return (c * 7 + r * 11) % 23 == 0 ? -1 : rough(c, r); };
  const auto source = moved(must_open(write(spec)));
  const proto::Samples samples = whole(*source, lattice(kLevel));
  const auto pixels = source->pixels(
      lattice(kLevel), {samples.west, samples.south, samples.west + samples.columns - 1, samples.south + samples.rows - 1});
  ASSERT_TRUE(pixels.ok());
  int met = 0, near = 0;
  for (const raster::PixelPoint& p : *pixels) {
    const auto c = static_cast<std::int64_t>(p.x), r = static_cast<std::int64_t>(p.y);
    const double fx = p.x - static_cast<double>(c), fy = p.y - static_cast<double>(r);
    const auto at = [&](std::int64_t dc, std::int64_t dr) { return samples.at(samples.west + c + dc, samples.south + r + dr); };
    if (r + 1 >= samples.rows || c + 1 >= samples.columns || at(1, 1) != proto::kNoHeight || fx + fy > 1) continue;
    if (at(0, 0) == proto::kNoHeight || at(1, 0) == proto::kNoHeight || at(0, 1) == proto::kNoHeight) continue;
    ++met;
    near += std::abs(((1 - fx - fy) * at(0, 0) + fx * at(1, 0) + fy * at(0, 1)) * proto::kHeightStep_m - p.height_m) < 1 ? 1 : 0;
  }
  EXPECT_GT(met, 10);
  EXPECT_EQ(near, met);
}

TEST_F(Pixels, BackProjectionDoesNotDependOnTheWindow) {
  Spec spec = rough_utm();
  spec.nodata = -1;
  spec.value = [](int c, int r) {
    return (c - 40) * (c - 40) + (r - 30) * (r - 30) < 90 ? -1 : c > 70 && r > 50 ? 600 : rough(c, r);
  };
  const auto source = moved(must_open(write(spec)));
  const proto::Samples all = whole(*source, lattice(kLevel));
  int voids = 0;
  for (std::int64_t j = all.south; j < all.south + all.rows; j += 23) {
    for (std::int64_t i = all.west; i < all.west + all.columns; i += 31) {
      const auto columns = static_cast<std::int32_t>(std::min<std::int64_t>(31, all.west + all.columns - i)),
                 rows = static_cast<std::int32_t>(std::min<std::int64_t>(23, all.south + all.rows - j));
      const auto part = source->sample(lattice(kLevel), i, j, columns, rows);
      ASSERT_TRUE(part.ok());
      for (std::int32_t r = 0; r < rows; ++r)
        for (std::int32_t c = 0; c < columns; ++c) {
          ASSERT_EQ(part->at(i + c, j + r), all.at(i + c, j + r));
          voids += part->at(i + c, j + r) == proto::kNoHeight ? 1 : 0;
        }
    }
  }
  EXPECT_GT(voids, 100);
  const auto plain = must_open(path("dem.tif"));
  const proto::Samples before = whole(*plain, lattice(kLevel));
  int still = 0;
  for (std::size_t k = 0; k < before.height.size(); ++k) {
    EXPECT_EQ(before.height[k] == proto::kNoHeight, all.height[k] == proto::kNoHeight);
    if (before.flat_water[k] == 0) continue;
    EXPECT_EQ(before.height[k], all.height[k]) << "water stays still";
    ++still;
  }
  EXPECT_GT(still, 300);
}

TEST_F(Pixels, AroundTheEarth) {
  Spec spec;
  spec.columns = 1024, spec.rows = 512;
  spec.geotransform = {-180, 360.0 / 1024, 0, 90, 0, -180.0 / 512};
  spec.value = rough;
  const auto source = moved(must_open(write(spec)), 0.05, 2);
  const proto::Lattice l = lattice(2);  // cells of half a pixel
  const auto all = source->pixels(l, {0, 0, l.columns(), l.rows()});
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->size(), 1024u * 512u);
  const auto a = source->sample(l, -8, 400, 16, 16), b = source->sample(l, 0, 400, static_cast<std::int32_t>(l.columns()), 16);
  ASSERT_TRUE(a.ok() && b.ok());
  for (std::int64_t c = 0; c < 8; ++c)
    for (std::int64_t r = 0; r < 16; ++r) EXPECT_EQ(a->at(c, 400 + r), b->at(c, 400 + r));
  for (std::int64_t c = -8; c < 0; ++c)
    for (std::int64_t r = 0; r < 16; ++r) EXPECT_EQ(a->at(c, 400 + r), b->at(l.columns() + c, 400 + r));
  EXPECT_LT(off(*source, 2).greatest_m, 0.1);
}

/// The corners of a sinusoidal map are on no earth, whatever value they have.
TEST_F(Pixels, BeyondAMapsOutlineThereAreNone) {
  constexpr double kRadius_m = 6371000, kPi = 3.14159265358979323846, kPixel_m = kPi * kRadius_m / 180;
  Spec spec;
  spec.columns = 360, spec.rows = 180;
  spec.crs = "+proj=sinu +R=6371000 +units=m +no_defs";
  spec.geotransform = {-180 * kPixel_m, kPixel_m, 0, 90 * kPixel_m, 0, -kPixel_m};
  const auto is_on_map = [](int c, int r) { return std::abs(c + 0.5 - 180) <= 180 * std::cos((90 - r - 0.5) * kPi / 180); };
  std::size_t on_map = 0;
  for (int r = 0; r < spec.rows; ++r)
    for (int c = 0; c < spec.columns; ++c) on_map += is_on_map(c, r) ? 1 : 0;
  spec.value = [&](int c, int r) { return is_on_map(c, r) ? 1000.0 : 0.0; };
  const auto source = must_open(write(spec));
  const proto::Lattice l = lattice(1);
  const auto all = source->pixels(l, {0, 0, l.columns(), l.rows()});
  ASSERT_TRUE(all.ok());
  EXPECT_EQ(all->size(), on_map);
  for (const raster::PixelPoint& p : *all) EXPECT_EQ(p.height_m, 1000);
}

/// Makes a tile of a tiled TIFF unreadable.
void damage_tile(const std::string& file, int column, int row) {
  std::uint64_t at = 0;
  {
    const GDALDatasetUniquePtr dataset(GDALDataset::Open(file.c_str()));
    const std::string item = "BLOCK_OFFSET_" + std::to_string(column) + "_" + std::to_string(row);
    const char* const offset = dataset->GetRasterBand(1)->GetMetadataItem(item.c_str(), "TIFF");
    ASSERT_TRUE(offset);
    at = std::stoull(offset);
  }
  std::fstream bytes(file, std::ios::in | std::ios::out | std::ios::binary);
  bytes.seekp(static_cast<std::streamoff>(at));
  bytes << std::string(40, '\xff');
}

// Cells on both sides of the antimeridian lie at both ends of the raster: what is between is not read. It was, all of it, for
// each strip of samples there.
TEST_F(Pixels, BesideTheAntimeridianNothingElseIsRead) {
  for (const bool closes : {true, false}) {
    Spec spec;
    spec.columns = closes ? 1024 : 1022, spec.rows = 512;
    spec.geotransform = {closes ? -180 : -180 + 360.0 / 1024, 360.0 / 1024, 0, 90, 0, -180.0 / 512};
    spec.value = rough;
    spec.create = {"TILED=YES", "BLOCKXSIZE=128", "BLOCKYSIZE=128", "COMPRESS=DEFLATE"};
    const std::string file = write(spec, closes ? "closed.tif" : "open.tif");
    const proto::Lattice l = lattice(2);  // cells of half a pixel
    const auto pixels_of = [&](const Window& cells) {
      const auto found = must_open(file)->pixels(l, cells);
      EXPECT_TRUE(found.ok()) << found.problem().line();
      std::vector<std::array<double, 3>> all;
      if (found.ok()) {
        for (const raster::PixelPoint& p : *found)
          all.push_back({static_cast<double>(cells.west) + p.x, static_cast<double>(cells.south) + p.y, p.height_m});
      }
      std::sort(all.begin(), all.end());
      return all;
    };
    const auto expected = pixels_of({0, 0, 2 * l.columns(), l.rows()});  // twice around
    damage_tile(file, 4, 1);
    for (const Window cells :
         {Window{l.columns() - 40, 600, l.columns() + 30, 700}, Window{l.columns() - 64, 600, l.columns(), 664},
          Window{l.columns() + 1, 640, l.columns() + 50, 700}}) {
      std::vector<std::array<double, 3>> wanted;
      for (const auto& p : expected) {
        const auto i = static_cast<std::int64_t>(std::floor(p[0])), j = static_cast<std::int64_t>(std::floor(p[1]));
        if (i >= cells.west && i < cells.east && j >= cells.south && j < cells.north) wanted.push_back(p);
      }
      EXPECT_EQ(pixels_of(cells), wanted) << closes << " " << cells.west;
      EXPECT_GT(wanted.size(), 500u);
    }
    EXPECT_FALSE(must_open(file)->pixels(l, {1000, 600, 1100, 700}).ok()) << "the damaged tile lies there";
  }
}

TEST_F(Pixels, UnderAGeoidAndABox) {
  Spec spec = rough_utm();
  proto::BuildOptions options = plain_options();
  options.set_vertical_datum("EGM96");
  const std::string file = write(spec);
  const auto source = moved(must_open(file, options));
  EXPECT_LT(off(*source, kLevel).greatest_m, 0.05);
  const auto b = source->description().bbox();
  for (const double v : {b[0] + 0.005, b[1] + 0.005, b[2] - 0.005, b[3] - 0.005}) options.add_bbox(v);
  const auto cut = moved(must_open(file, options));
  const Window w = cut->window(lattice(kLevel));
  const auto inside = cut->pixels(lattice(kLevel), {w.west - 50, w.south - 50, w.east + 50, w.north + 50});
  ASSERT_TRUE(inside.ok());
  EXPECT_GT(inside->size(), 1500u);
  constexpr double kNearly_deg = 1e-9;
  for (const raster::PixelPoint& p : *inside) {
    const double longitude = lattice(kLevel).longitude_deg(w.west - 50) + p.x * lattice(kLevel).cell_deg();
    EXPECT_GE(longitude, options.bbox(0) - kNearly_deg);
    EXPECT_LE(longitude, options.bbox(2) + kNearly_deg);
  }
  EXPECT_LT(off(*cut, kLevel).greatest_m, 0.05);
}

/// Those beyond the last sample are under no triangle, and are counted as such with a box, too.
TEST_F(Pixels, ABoxHasAllPixelsThatLieInIt) {
  Spec degrees = rough_utm();
  degrees.crs = "EPSG:4326", degrees.geotransform = {-118.0001, 0.0003, 0, 34.3001, 0, -0.0003};
  for (const Spec& spec : {rough_utm(), degrees}) {
    const std::string file = write(spec);
    const auto source = must_open(file);
    const auto b = source->description().bbox();
    const Window w = source->window(lattice(kLevel));
    const auto count_in = [&](const std::vector<double>& box) {
      proto::BuildOptions options = plain_options();
      for (const double side : box) options.add_bbox(side);
      const auto found = must_open(file, options)->pixels(lattice(kLevel), {w.west - 4, w.south - 4, w.east + 4, w.north + 4});
      EXPECT_TRUE(found.ok());
      return found.ok() ? found->size() : 0;
    };
    const std::size_t all = count_in({});
    EXPECT_EQ(all, 90u * 80u);
    EXPECT_EQ(count_in({b[0] - 1, b[1] - 1, b[2] + 1, b[3] + 1}), all);
    EXPECT_EQ(count_in({b[0], b[1], b[2], b[3]}), all);
    EXPECT_EQ(count_in({-180, -90, 180, 90}), all);
    EXPECT_EQ(count_in({170, -90, b[2] + 1, 90}), all) << "over the antimeridian";
    const double middle = (b[0] + b[2]) / 2 + 1e-7;
    const std::size_t west = count_in({b[0] - 1, b[1] - 1, middle, b[3] + 1}),
                      east = count_in({middle, b[1] - 1, b[2] + 1, b[3] + 1});
    EXPECT_EQ(west + east, all);
    EXPECT_GT(west, all / 3);
    EXPECT_GT(east, all / 3);
  }
}

TEST_F(Pixels, AnotherWordIsRefused) {
  EXPECT_EQ(problem_type(write(rough_utm()),
                         [] {
                           proto::BuildOptions options = plain_options();
                           options.set_pixels("all");
                           return options;
                         }()),
            "option-invalid");
}

}  // namespace
}  // namespace cordillera::raster_test
