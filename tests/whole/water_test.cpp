// Water masks, from the raster to the byte that a client reads.
#include <cpl_vsi.h>
#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "pipeline/build/build.h"
#include "pipeline/encode/json.h"
#include "pipeline/faces/face.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/store/water_mask.h"
#include "tests/pipeline/quantized_mesh_decoder.h"
#include "tests/whole/dem.h"

namespace cordillera::whole {
namespace {

using pipeline::Json;
using pipeline::kWaterSide;
using pipeline::WaterPixels;

constexpr int kLevel = 9;
constexpr int kColumns = 700, kRows = 600;
const Corner kShore{kLevel, 520 * proto::kTileCells + 40, 330 * proto::kTileCells + 90};

/// A sea in the west, a lake that is no sea in the east.
bool sea(int c, int r) { return c < 300 + 60 * std::sin(r / 40.0); }
double ground(int c, int r) {
  if (sea(c, r)) return 0;
  return std::hypot(c - 550, r - 300) < 40 ? 321 : 5 + 0.3 * c + 20 * std::sin(c / 9.0) * std::cos(r / 11.0);
}

std::array<int, 4> png_pixel(const std::string& png, int column, int row) {
  const char* const file = "/vsimem/picture.png";
  VSIFCloseL(VSIFileFromMemBuffer(file, reinterpret_cast<GByte*>(const_cast<char*>(png.data())), png.size(), FALSE));
  const char* const drivers[] = {"PNG", nullptr};
  std::array<int, 4> out{};
  const GDALDatasetUniquePtr picture(GDALDataset::Open(file, GDAL_OF_RASTER, drivers));
  const int bands = picture->GetRasterCount();  // three: nothing is clear
  EXPECT_EQ(picture->RasterIO(GF_Read, column, row, 1, 1, out.data(), 1, 1, GDT_Int32, bands, nullptr, 0, 0, 0, nullptr),
            CE_None);
  return out;
}

class Water : public ::testing::Test {
 protected:
  void build(const proto::BuildOptions& extra) {
    write(cells_of(kShore, kColumns, kRows, ground), folder_.path("dem.tif"));
    pipeline::BuildRequest request;
    request.raster_path = folder_.path("dem.tif");
    request.raster_name = "dem.tif";
    request.id = "water";
    request.store_path = folder_.path("a.db");
    request.options.set_vertical_datum("ellipsoid");
    request.options.set_error(30);
    request.options.set_max_level(kLevel);
    request.options.set_threads(2);
    request.options.set_device("cpu");
    request.options.MergeFrom(extra);
    const std::atomic<bool> stop{false};
    const auto built = pipeline::build(request, nullptr, stop);
    ASSERT_TRUE(built.ok()) << built.problem().detail;
    manifest_ = *built;
    terrain_ =
        std::make_unique<pipeline::faces::Terrain>(std::shared_ptr(pipeline::StoreReader::open(request.store_path).value()));
  }
  std::optional<std::string> fetch(const std::string& path, const std::string& ramp = "") {
    auto found = pipeline::faces::find(path);
    found->place.ramp = ramp;
    auto made = found->resource->make(*terrain_, found->place).value();
    return made ? std::optional(std::string(made->bytes)) : std::nullopt;
  }
  /// The mask at the end of a tile; empty: none. One byte stands for all pixels.
  WaterPixels mask(const std::string& path) {
    const auto bytes = fetch(path);
    EXPECT_TRUE(bytes) << path;
    return bytes ? pipeline::testing::TerrainReader(*bytes).read().water : WaterPixels();
  }
  static bool water_at(const WaterPixels& mask, int column, int row) {
    return (mask.size() == 1 ? mask[0] : mask[static_cast<std::size_t>(row * kWaterSide + column)]) == pipeline::kWater;
  }
  /// The zoom 9 pixel over a cell of the raster.
  std::array<int, 4> colour(const std::string& face, int c, int r) {
    const proto::Lattice lattice{kLevel};
    const double x = pipeline::faces::longitude_pixel(9, lattice.longitude_deg(kShore.west + c) + lattice.cell_deg() / 2),
                 y = pipeline::faces::latitude_pixel(9, lattice.latitude_deg(kShore.north - r) - lattice.cell_deg() / 2);
    const auto png = fetch(face.substr(0, face.find('?')) + "/9/" + std::to_string(static_cast<int>(x / 256)) + "/" +
                               std::to_string(static_cast<int>(y / 256)) + ".png",
                           face.find('?') == face.npos ? "" : face.substr(face.find('=') + 1));
    return png_pixel(png.value(), static_cast<int>(x) % 256, static_cast<int>(y) % 256);
  }
  /// All pixels of the finest level against the function that the raster was made from.
  void expect_sea_exactly() {
    std::size_t checked = 0, water = 0, whole = 0;
    for (const pipeline::TileExtent& node : terrain_->store().extents(kLevel, 0, 0, 1023, 511)) {
      const auto& [z, x, y] = node.tile;
      const WaterPixels pixels = mask("terrain/9/" + std::to_string(x) + "/" + std::to_string(y) + ".terrain");
      ASSERT_TRUE(pixels.size() == 1 || pixels.size() == 65536);
      whole += pixels.size() == 1 ? 1 : 0;
      for (int row = 0; row < kWaterSide; ++row) {
        for (int column = 0; column < kWaterSide; ++column) {
          const auto c = static_cast<int>(x * std::int64_t{kWaterSide} + column - kShore.west);
          const auto r = static_cast<int>(kShore.north - 1 - (y * std::int64_t{kWaterSide} + kWaterSide - 1 - row));
          const bool inside = c >= 0 && r >= 0 && c < kColumns && r < kRows;
          ASSERT_EQ(water_at(pixels, column, row), inside && sea(c, r)) << x << " " << y << ", pixel " << c << " " << r;
          ++checked;
          water += inside && sea(c, r) ? 1 : 0;
        }
      }
    }
    EXPECT_GT(checked, 400000U);
    EXPECT_GT(water, 100000U);
    EXPECT_GT(whole, 0U);
  }

  Folder folder_;
  proto::Manifest manifest_;
  std::unique_ptr<pipeline::faces::Terrain> terrain_;
};

TEST_F(Water, IsWhereTheRasterIsExactlySoHigh) {
  proto::BuildOptions options;
  options.set_water(0);
  build(options);
  EXPECT_EQ(Json::parse(*fetch("layer.json"))["extensions"], Json::array({"octvertexnormals", "watermask"}));
  expect_sea_exactly();
}

TEST_F(Water, OfASeaIsFoundByItself) {
  proto::BuildOptions above_geoid;
  above_geoid.set_vertical_datum("EGM96");
  build(above_geoid);
  EXPECT_EQ(manifest_.options().water(), 0);
  EXPECT_THAT(manifest_.notes(), testing::Contains(testing::HasSubstr("water=none")));
  expect_sea_exactly();
  for (const auto& [c, r] : {std::pair(20, 20), std::pair(100, 300), std::pair(295, 20), std::pair(200, 580)})
    EXPECT_EQ(colour("terrarium", c, r), (std::array{128, 0, 0, 0})) << "the mesh is off by as much as 30 m";
  EXPECT_NE(colour("terrarium", 600, 100), (std::array{128, 0, 0, 0}));
  above_geoid.set_no_water(true);
  build(above_geoid);
  EXPECT_FALSE(manifest_.options().has_water());
  EXPECT_EQ(Json::parse(*fetch("layer.json"))["extensions"], Json::array({"octvertexnormals"}));
}

TEST_F(Water, IsNotLookedForAboveTheEllipsoid) {
  build({});
  EXPECT_FALSE(manifest_.options().has_water());
}

TEST_F(Water, IsBlueInPicturesOfTheAtlas) {
  proto::BuildOptions options;
  options.set_water(321);
  build(options);
  const auto blue = [](const std::array<int, 4>& rgba) { return rgba[2] - rgba[0]; };
  for (const char* face : {"relief", "color-relief", "color-relief?ramp=atlas"}) {
    EXPECT_GT(blue(colour(face, 550, 300)), 40) << face << ": the lake";
    EXPECT_GT(blue(colour(face, 560, 325)), 40) << face << ": the lake";
    EXPECT_GT(blue(colour(face, 100, 300)), 40) << face << ": the sea, by its height";
    EXPECT_LT(blue(colour(face, 550, 250)), 0) << face << ": the shore";
  }
  EXPECT_EQ(colour("relief", 550, 300), colour("relief", 545, 310)) << "no shades on water";
  EXPECT_LT(blue(colour("color-relief?ramp=land", 550, 300)), 40) << "colours that were asked for stay";
}

TEST_F(Water, IsWhereAMaskInAnotherProjectionSaysSo) {
  // A mask of 60 m on the map, a pixel of the elevation model being 150 m.
  const proto::Lattice lattice{kLevel};
  const double west_deg = lattice.longitude_deg(kShore.west), north_deg = lattice.latitude_deg(kShore.north),
               cell_deg = lattice.cell_deg();
  constexpr double kRadius = 6378137, kPixel_m = 60;
  const auto map_y = [](double deg) { return kRadius * std::asinh(std::tan(deg * 3.14159265358979323846 / 180)); };
  const double west_m = kRadius * west_deg * 3.14159265358979323846 / 180, north_m = map_y(north_deg);
  Dem dem;
  dem.crs = "EPSG:3857";
  dem.geotransform = {west_m - 5 * kPixel_m, kPixel_m, 0, north_m + 5 * kPixel_m, 0, -kPixel_m};
  dem.columns = static_cast<int>(kColumns * cell_deg * 111320 / kPixel_m) + 20;
  dem.rows = static_cast<int>((north_m - map_y(north_deg - kRows * cell_deg)) / kPixel_m) + 20;
  dem.height = [&](int c, int r) {
    const double x = (west_m + (c - 4.5) * kPixel_m) / kRadius * 180 / 3.14159265358979323846;
    const double y = std::atan(std::sinh((north_m - (r - 4.5) * kPixel_m) / kRadius)) * 180 / 3.14159265358979323846;
    const int column = static_cast<int>(std::floor((x - west_deg) / cell_deg)),
              row = static_cast<int>(std::floor((north_deg - y) / cell_deg));
    return column >= 0 && row >= 0 && column < kColumns && row < kRows && sea(column, row) ? 7.0 : 0.0;
  };
  write(dem, folder_.path("mask.tif"));
  proto::BuildOptions options;
  options.set_water_mask(folder_.path("mask.tif"));
  build(options);
  EXPECT_EQ(manifest_.options().water_mask(), "mask.tif") << "no path of this machine in a document";
  // A pixel of the mask may lie over the shore: one cell to either side of it is not asked.
  std::size_t checked = 0;
  for (const pipeline::TileExtent& node : terrain_->store().extents(kLevel, 0, 0, 1023, 511)) {
    const WaterPixels pixels = mask("terrain/9/" + std::to_string(node.tile.x) + "/" + std::to_string(node.tile.y) + ".terrain");
    for (int row = 0; row < kWaterSide; ++row) {
      for (int column = 0; column < kWaterSide; ++column) {
        const auto c = static_cast<int>(node.tile.x * std::int64_t{kWaterSide} + column - kShore.west);
        const auto r = static_cast<int>(kShore.north - 1 - (node.tile.y * std::int64_t{kWaterSide} + kWaterSide - 1 - row));
        if (c < 1 || r < 1 || c >= kColumns - 1 || r >= kRows - 1) continue;
        bool shore = false;
        for (int k = 0; k < 9; ++k) shore |= sea(c + k % 3 - 1, r + k / 3 - 1) != sea(c, r);
        if (shore) continue;
        ASSERT_EQ(water_at(pixels, column, row), sea(c, r)) << c << " " << r;
        ++checked;
      }
    }
  }
  EXPECT_GT(checked, 300000U);
}

TEST_F(Water, OfAParentIsTheMeanOfItsChildren) {
  proto::BuildOptions options;
  options.set_water(0);
  build(options);
  std::size_t between = 0;
  for (int z = kLevel - 1; z >= 5; --z) {
    for (const pipeline::TileExtent& node :
         terrain_->store().extents(z, 0, 0, proto::tiles_across(z) - 1, proto::tiles_up(z) - 1)) {
      const WaterPixels parent = pipeline::unpack_water(terrain_->store().water(node.tile));
      for (int c = 0; c < 4 && !parent.empty(); ++c) {
        const WaterPixels child = pipeline::unpack_water(terrain_->store().water(node.tile.child(c)));
        for (int row = 0; row < 128; ++row) {
          for (int column = 0; column < 128; ++column) {
            int sum = 0;
            for (int k = 0; k < 4 && !child.empty(); ++k)
              sum += child[static_cast<std::size_t>((2 * row + k / 2) * kWaterSide + 2 * column + k % 2)];
            const int at =
                parent[static_cast<std::size_t>((row + (c < 2 ? 128 : 0)) * kWaterSide + column + (c % 2 != 0 ? 128 : 0))];
            ASSERT_EQ(at, (sum + 2) / 4);
            between += at > 0 && at < 255 ? 1 : 0;
          }
        }
      }
    }
  }
  EXPECT_GT(between, 300U) << "the shore";
}

TEST_F(Water, InWebMercatorIsTheSameWater) {
  proto::BuildOptions options;
  options.set_water(0);
  build(options);
  EXPECT_EQ(Json::parse(*fetch("web-mercator/layer.json"))["extensions"], Json::array({"octvertexnormals", "watermask"}));
  // A tile of zoom 10 in the data: pixel by pixel by latitude, which is what positions in the format are linear in.
  const double middle_deg = proto::Lattice{kLevel}.latitude_deg(kShore.north - kRows / 2);
  const double map = (1 + std::asinh(std::tan(middle_deg * 3.14159265358979323846 / 180)) / 3.14159265358979323846) / 2 * 1024;
  const auto y = static_cast<int>(map);
  const auto parallel = [](int row) {
    return std::atan(std::sinh(3.14159265358979323846 * (row / 512.0 - 1))) * 180 / 3.14159265358979323846;
  };
  const WaterPixels pixels = mask("web-mercator/terrain/10/521/" + std::to_string(y) + ".terrain");
  ASSERT_EQ(pixels.size(), 65536U);
  std::size_t water = 0;
  for (int row = 0; row < kWaterSide; ++row) {
    const double latitude = parallel(y + 1) + (parallel(y) - parallel(y + 1)) * (row + 0.5) / kWaterSide;
    const auto r = static_cast<int>(kShore.north - 1 - static_cast<std::int64_t>((latitude + 90) * 512 * 256 / 180));
    for (int column = 0; column < kWaterSide; ++column) {
      const auto c = static_cast<int>(521 * kWaterSide + column - kShore.west);
      ASSERT_EQ(water_at(pixels, column, row), sea(c, r)) << column << " " << row;
      water += sea(c, r) ? 1 : 0;
    }
  }
  EXPECT_GT(water, 1000U);
}

TEST_F(Water, IsNotSpokenOfWhereNobodyAskedForIt) {
  build({});
  EXPECT_EQ(Json::parse(*fetch("layer.json"))["extensions"], Json::array({"octvertexnormals"}));
  EXPECT_TRUE(mask("terrain/8/260/165.terrain").empty());
}

TEST_F(Water, AMaskThatLiesElsewhereIsNoted) {
  proto::BuildOptions options;
  options.set_water_mask(folder_.path("mask.tif"));
  write(cells_of({kLevel, kShore.west, kShore.north - 2 * kRows}, 80, 60, [](int, int) { return 1.0; }), options.water_mask());
  options.set_error(500);
  build(options);
  EXPECT_THAT(manifest_.notes(), testing::Contains("The water mask mask.tif lies elsewhere: nothing is water"));
}

TEST_F(Water, AMaskThatCannotBeReadIsNamed) {
  proto::BuildOptions options;
  options.set_water_mask(folder_.path("no.tif"));
  options.set_vertical_datum("ellipsoid");
  write(cells_of(kShore, 80, 60, ground), folder_.path("dem.tif"));
  pipeline::BuildRequest request;
  request.raster_path = folder_.path("dem.tif");
  request.raster_name = "dem.tif";
  request.store_path = folder_.path("a.db");
  request.options = options;
  const std::atomic<bool> stop{false};
  const auto built = pipeline::build(request, nullptr, stop);
  ASSERT_FALSE(built.ok());
  EXPECT_EQ(built.problem().parameter, "water_mask");
  request.options.set_water(0);
  EXPECT_EQ(pipeline::build(request, nullptr, stop).problem().type, "options-conflict");
}

TEST(WaterMask, PacksAndUnpacks) {
  EXPECT_EQ(pipeline::pack_water({}), "");
  EXPECT_EQ(pipeline::pack_water(WaterPixels(65536, 0)), "");
  EXPECT_EQ(pipeline::pack_water(WaterPixels(65536, 255)), "\xff");
  EXPECT_EQ(pipeline::unpack_water("\xff"), WaterPixels(65536, 255));
  WaterPixels pixels(65536);
  for (std::size_t k = 0; k < pixels.size(); ++k) pixels[k] = static_cast<std::uint8_t>(k * k / 977);
  EXPECT_EQ(pipeline::unpack_water(pipeline::pack_water(pixels)), pixels);
  EXPECT_THROW(pipeline::unpack_water("nonsense"), std::exception);
}

}  // namespace
}  // namespace cordillera::whole
