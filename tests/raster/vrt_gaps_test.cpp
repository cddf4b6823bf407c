// A VRT of rasters gives what the rasters give: where none of them lies there is nothing.
#include <gmock/gmock.h>

#include "fixture.h"
#include "raster/mosaic/mosaic.h"
#include "raster/open/coverage.h"

namespace cordillera {
namespace {

using raster::Coverage;
using raster_test::lattice;
using raster_test::Spec;

constexpr int kLevel = 10;

struct PlacedRaster {
  std::string path;
  int column = 0, row = 0, columns = 0, rows = 0;
  std::string nodata;  ///< that the VRT tells of it alone
};

class VrtGaps : public raster_test::RasterTest {
 protected:
  /// A part of one surface, in pixels of the lattice; `hole` pixels have the nodata value -9999.
  PlacedRaster part(const std::string& name, int column, int row, int columns, int rows, const std::string& type = "Float32",
                    const std::function<bool(int, int)>& hole = nullptr) const {
    Spec spec;
    spec.columns = columns, spec.rows = rows, spec.type = type;
    spec.geotransform = raster_test::cells_of(kLevel, 40000 + column, 30000 - row);
    spec.value = [=](int c, int r) { return hole && hole(c, r) ? -9999.0 : 300.0 + (column + c) * 7 % 50 + (row + r) * 5 % 40; };
    if (hole) spec.nodata = -9999;
    return {write(spec, name), column, row, columns, rows, hole ? "-9999" : ""};
  }
  static std::string rectangle(const std::string& name, double x, double y, double columns, double rows) {
    return "<" + name + " xOff=\"" + std::to_string(x) + "\" yOff=\"" + std::to_string(y) + "\" xSize=\"" +
           std::to_string(columns) + "\" ySize=\"" + std::to_string(rows) + "\"/>";
  }
  static std::string source(const PlacedRaster& part, const std::string& from = "", const std::string& to = "") {
    const std::string kind = part.nodata.empty() ? "SimpleSource" : "ComplexSource";
    return "<" + kind + "><SourceFilename relativeToVRT=\"1\">" + std::filesystem::path(part.path).filename().string() +
           "</SourceFilename><SourceBand>1</SourceBand><SourceProperties RasterXSize=\"" + std::to_string(part.columns) +
           "\" RasterYSize=\"" + std::to_string(part.rows) + "\" DataType=\"Float32\" BlockXSize=\"128\" BlockYSize=\"128\"/>" +
           (from.empty() ? rectangle("SrcRect", 0, 0, part.columns, part.rows) : from) +
           (to.empty() ? rectangle("DstRect", part.column, part.row, part.columns, part.rows) : to) +
           (part.nodata.empty() ? "" : "<NODATA>" + part.nodata + "</NODATA>") + "</" + kind + ">";
  }
  std::string vrt(const std::string& sources, int columns, int rows, const std::string& type = "Float32",
                  const std::string& attributes = "") const {
    const auto place = raster_test::cells_of(kLevel, 40000, 30000);
    std::string numbers;
    for (const double number : place) {
      char text[40];
      std::snprintf(text, sizeof text, "%s%.17g", numbers.empty() ? "" : ",", number);
      numbers += text;
    }
    return write_text("<VRTDataset rasterXSize=\"" + std::to_string(columns) + "\" rasterYSize=\"" + std::to_string(rows) +
                          "\"><SRS>EPSG:4326</SRS><GeoTransform>" + numbers + "</GeoTransform><VRTRasterBand dataType=\"" + type +
                          "\" band=\"1\"" + attributes + ">" + sources + "</VRTRasterBand></VRTDataset>",
                      "all.vrt");
  }
  static std::vector<float> heights(raster::Source& source, const raster::Source::Window& w) {
    const auto samples = source.sample(lattice(kLevel), w.west, w.south, static_cast<int>(w.east - w.west + 1),
                                       static_cast<int>(w.north - w.south + 1));
    EXPECT_TRUE(samples.ok());
    return samples.ok() ? std::vector<float>(samples->height.begin(), samples->height.end()) : std::vector<float>();
  }
  /// The VRT's heights are those of its rasters as a mosaic, and voids where that has none.
  static void expect_same(const std::string& vrt, const std::vector<PlacedRaster>& parts) {
    const auto options = raster_test::plain_options();
    std::vector<raster::MosaicMember> members;
    for (const PlacedRaster& part : parts) {
      auto member = raster::examine(part.path, "", raster::Trust::operator_file, options);
      ASSERT_TRUE(member.ok()) << member.problem().line();
      members.push_back(*std::move(member));
    }
    const auto mosaic = raster::make_mosaic(std::move(members), 0);
    const auto one = raster_test::must_open(vrt);
    ASSERT_TRUE(one);
    const auto window = one->window(lattice(kLevel));
    EXPECT_EQ(heights(*one, window), heights(*mosaic, window));
  }
};

TEST_F(VrtGaps, BetweenItsRastersAreVoids) {
  for (const char* type : {"Float32", "Int16", "Byte"}) {
    const std::vector parts{part("a.tif", 0, 0, 30, 40, type), part("b.tif", 50, 0, 30, 40, type),
                            part("c.tif", 34, 12, 10, 9, type)};
    const std::string all = vrt(source(parts[0]) + source(parts[1]) + source(parts[2]), 80, 40, type);
    expect_same(all, parts);
    const auto opened = raster_test::must_open(all);
    EXPECT_EQ(opened->description().nodata(), raster::kUnstoredBlocks) << "which a note is about";
    EXPECT_TRUE(opened->empty(lattice(kLevel), 40036, 29965, 8, 8)) << "told without a pixel";
    EXPECT_FALSE(opened->empty(lattice(kLevel), 40036, 29965, 20, 8));
    auto ground = raster_test::plain_options();
    ground.set_voids("0");
    EXPECT_EQ(raster_test::height_m(*raster_test::must_open(all, ground), lattice(kLevel), 40040, 29970), 0);
  }
}

TEST_F(VrtGaps, OneWithoutGapsStaysAsItIs) {
  const std::vector parts{part("a.tif", 0, 0, 30, 40), part("b.tif", 30, 0, 30, 40)};
  const std::string all = vrt(source(parts[0]) + source(parts[1]), 60, 40);
  expect_same(all, parts);
  EXPECT_EQ(raster_test::must_open(all)->description().nodata(), "none");
}

/// gdalbuildvrt takes the nodata value of the first raster: others keep theirs to themselves.
TEST_F(VrtGaps, WhatARasterLeavesOutByItsOwnNodataIsVoid) {
  const auto hole = [](int c, int r) { return c > 10 && r > 20; };
  for (const char* type : {"Float32", "Int16"}) {
    const std::vector parts{part("a.tif", 0, 0, 30, 40, type), part("b.tif", 40, 0, 30, 40, type, hole)};
    expect_same(vrt(source(parts[0]) + source(parts[1]), 70, 40, type), parts);
  }
}

TEST_F(VrtGaps, ARectangleMayReachBeyondItsRasterOrLieBetweenPixels) {
  const PlacedRaster a = part("a.tif", 0, 0, 30, 40);
  const auto valid = [&](const std::string& from, const std::string& to) {
    const auto opened = raster_test::must_open(vrt(source(a, from, to), 80, 40));
    const auto row = heights(*opened, {40000, 29980, 40080, 29980});
    std::vector<int> columns;
    for (int k = 0; k < 81; ++k)
      if (row[static_cast<std::size_t>(k)] != 0 && !std::isnan(raster_test::height_m(*opened, lattice(kLevel), 40000 + k, 29980)))
        columns.push_back(k);
    return columns.empty() ? std::pair(0, 0) : std::pair(columns.front(), columns.back());
  };
  EXPECT_EQ(valid(rectangle("SrcRect", -10, 0, 50, 40), rectangle("DstRect", 5, 0, 50, 40)), std::pair(15, 45));
  EXPECT_EQ(valid("", rectangle("DstRect", 20.0004, 0, 30, 40)), std::pair(20, 50));
  EXPECT_EQ(valid("", rectangle("DstRect", 20.4, 0, 30, 40)), std::pair(20, 51));
}

/// What another program would compute of pixels need not be 0 where no source lies.
TEST_F(VrtGaps, AFunctionOfPixelsIsLeftAsItIs) {
  const PlacedRaster a = part("a.tif", 0, 0, 30, 40);
  const auto opened = raster_test::must_open(vrt("<PixelFunctionType>sum</PixelFunctionType>" + source(a) + source(a), 80, 40,
                                                 "Float32", " subClass=\"VRTDerivedRasterBand\""));
  EXPECT_EQ(raster_test::height_m(*opened, lattice(kLevel), 40060, 29980), 0);
}

TEST(CoverageOfRectangles, IsTheUnionOfThem) {
  std::uint32_t seed = 1;
  const auto any = [&](int below) { return static_cast<std::int64_t>((seed = seed * 1664525 + 1013904223) >> 8) % below; };
  for (int turn = 0; turn < 300; ++turn) {
    constexpr int kColumns = 23, kRows = 17;
    std::vector<Coverage::Rectangle> parts;
    std::vector<bool> there(kColumns * kRows);
    for (std::int64_t k = any(9); k-- > 0;) {
      const std::int64_t x = any(30) - 4, y = any(24) - 4;
      parts.push_back({x, y, x + any(14), y + any(14)});
      for (std::int64_t r = std::max<std::int64_t>(y, 0); r < std::min<std::int64_t>(parts.back().bottom, kRows); ++r)
        for (std::int64_t c = std::max<std::int64_t>(x, 0); c < std::min<std::int64_t>(parts.back().right, kColumns); ++c)
          there[static_cast<std::size_t>(r * kColumns + c)] = true;
    }
    const Coverage covered(parts, kColumns, kRows);
    const auto all = static_cast<std::size_t>(std::count(there.begin(), there.end(), true));
    EXPECT_EQ(covered.is_whole(), all == there.size());
    EXPECT_EQ(covered.is_empty(), all == 0);
    const std::int64_t x = any(kColumns), y = any(kRows);
    const Coverage::Rectangle window{x, y, x + 1 + any(static_cast<int>(kColumns - x)), y + 1 + any(static_cast<int>(kRows - y))};
    std::vector<bool> left(there.size(), true);
    covered.each_gap(window, [&](std::int64_t row, std::int64_t west, std::int64_t east) {
      for (std::int64_t c = west; c < east; ++c) left[static_cast<std::size_t>(row * kColumns + c)] = false;
    });
    bool touched = false;
    for (std::int64_t r = window.top; r < window.bottom; ++r) {
      for (std::int64_t c = window.left; c < window.right; ++c) {
        const auto at = static_cast<std::size_t>(r * kColumns + c);
        ASSERT_EQ(left[at], there[at]) << turn;
        touched |= there[at];
      }
    }
    EXPECT_EQ(covered.touches(window), touched);
  }
}

}  // namespace
}  // namespace cordillera
