// Orthophotos at the vertices of a lattice.
#include "raster/photo/orthophoto.h"

#include <cpl_conv.h>
#include <gdal_priv.h>
#include <gdal_utils.h>
#include <ogr_spatialref.h>

#include <cmath>

#include "fixture.h"

namespace cordillera::raster_test {
namespace {

using Rgba = std::array<int, 4>;

constexpr int kPhotoLevel = 14;                                                                          // a cell is 4.8 m high
constexpr std::int64_t kPhotoWest = std::int64_t{256} * 17386, kPhotoNorth = std::int64_t{256} * 12470;  // near 11 E, 47 N
constexpr int kPhotoSide = 200;

/// A photo to be written.
struct Sheet {
  std::array<double, 6> place = cells_of(kPhotoLevel, kPhotoWest, kPhotoNorth);
  std::string crs = "EPSG:4326";
  int columns = kPhotoSide, rows = kPhotoSide;
  std::function<Rgba(int c, int r)> colour = [](int c, int r) { return Rgba{c, r, 100, 255}; };
  int bands = 4;
  GDALDataType type = GDT_Byte;
  std::vector<int> overviews;
  std::optional<double> nodata;
  bool mask = false;  ///< by colour's last number
};

class Photo : public RasterTest {
 protected:
  std::string write_photo(const Sheet& sheet, const std::string& name = "photo.tif") const {
    GDALAllRegister();
    const std::string file = path(name);
    const char* const options[] = {"PHOTOMETRIC=RGB", sheet.bands == 4 ? "ALPHA=YES" : nullptr, nullptr};
    GDALDatasetUniquePtr out(
        GetGDALDriverManager()->GetDriverByName("GTiff")->Create(file.c_str(), sheet.columns, sheet.rows, sheet.bands, sheet.type,
                                                                 sheet.bands >= 3 ? const_cast<char**>(options) : nullptr));
    std::array<double, 6> place = sheet.place;
    if (!sheet.crs.empty()) {
      out->SetGeoTransform(place.data());
      OGRSpatialReference crs;
      crs.SetFromUserInput(sheet.crs.c_str());
      out->SetSpatialRef(&crs);
    }
    const CPLConfigOptionSetter inside("GDAL_TIFF_INTERNAL_MASK", "YES", false);
    if (sheet.mask) out->CreateMaskBand(GMF_PER_DATASET);
    for (int k = 0; k < sheet.bands + (sheet.mask ? 1 : 0); ++k) {
      GDALRasterBand* const band = k < sheet.bands ? out->GetRasterBand(k + 1) : out->GetRasterBand(1)->GetMaskBand();
      if (sheet.nodata && k < sheet.bands) band->SetNoDataValue(*sheet.nodata);
      std::vector<std::int32_t> line(static_cast<std::size_t>(sheet.columns));
      for (int r = 0; r < sheet.rows; ++r) {
        for (int c = 0; c < sheet.columns; ++c)
          line[static_cast<std::size_t>(c)] = sheet.colour(c, r)[static_cast<std::size_t>(k)];
        EXPECT_EQ(band->RasterIO(GF_Write, 0, r, sheet.columns, 1, line.data(), sheet.columns, 1, GDT_Int32, 0, 0, nullptr),
                  CE_None);
      }
    }
    if (!sheet.overviews.empty()) {
      std::vector<int> factors = sheet.overviews;
      EXPECT_EQ(out->BuildOverviews("AVERAGE", static_cast<int>(factors.size()), factors.data(), 0, nullptr, nullptr, nullptr),
                CE_None);
    }
    return file;
  }
  std::shared_ptr<raster::Orthophoto> photo(const Sheet& sheet, const std::string& name = "photo.tif") const {
    auto opened = raster::open_orthophoto(write_photo(sheet, name));
    EXPECT_TRUE(opened.ok()) << (opened.ok() ? "" : opened.problem().line());
    return opened.ok() ? *opened : nullptr;
  }
  static std::string problem_of(const std::string& file) {
    const auto opened = raster::open_orthophoto(file);
    return opened.ok() ? "" : opened.problem().type + ": " + opened.problem().line();
  }
};

/// The colours of a window, by row from the north; alpha 0 everywhere where there is nothing.
std::vector<Rgba> colours(raster::Orthophoto& photo, int level, const raster::VertexWindow& window) {
  const auto bytes = photo.colours(lattice(level), window);
  EXPECT_TRUE(bytes.ok());
  std::vector<Rgba> out(static_cast<std::size_t>(window.columns) * static_cast<std::size_t>(window.rows));
  if (bytes.ok() && *bytes)
    for (std::size_t k = 0; k < out.size(); ++k)
      for (std::size_t n = 0; n < 4; ++n) out[k][n] = (**bytes)[4 * k + n];
  return out;
}
Rgba colour(raster::Orthophoto& photo, int level, std::int64_t i, std::int64_t j) {
  return colours(photo, level, {i, j, 1, 1})[0];
}

TEST_F(Photo, IsExactAtItsPixelsAndEndsAtItsRim) {
  Sheet sheet;
  sheet.place[0] -= sheet.place[1] / 2;  // centres on vertices
  sheet.place[3] -= sheet.place[5] / 2;
  const auto made = photo(sheet);
  for (const auto& [c, r] : {std::pair{0, 0}, {kPhotoSide - 1, kPhotoSide - 1}, {17, 5}})
    EXPECT_EQ(colour(*made, kPhotoLevel, kPhotoWest + c, kPhotoNorth - r), (Rgba{c, r, 100, 255}));
  EXPECT_EQ(colour(*made, kPhotoLevel, kPhotoWest - 1, kPhotoNorth - 5), Rgba());
  EXPECT_EQ(colour(*made, kPhotoLevel, kPhotoWest + 5, kPhotoNorth + 1), Rgba());
  EXPECT_FALSE(made->colours(lattice(kPhotoLevel), {kPhotoWest + kPhotoSide, kPhotoNorth - 50, 50, 50}).value().has_value());
  // Between its pixels it is a plane, as it was written.
  EXPECT_EQ(colour(*made, kPhotoLevel + 1, 2 * kPhotoWest + 41, 2 * (kPhotoNorth - 20)), (Rgba{20, 20, 100, 255}))
      << "20.5, to the even";
}

/// Red and green by longitude and latitude, in UTM: some 1.5 m a pixel, and askew to the lattice.
Sheet in_utm() {
  OGRSpatialReference utm, degrees;
  utm.importFromEPSG(32632);
  degrees.importFromEPSG(4326);
  degrees.SetAxisMappingStrategy(OAMS_TRADITIONAL_GIS_ORDER);
  const std::shared_ptr<OGRCoordinateTransformation> to(OGRCreateCoordinateTransformation(&utm, &degrees));
  const std::shared_ptr<OGRCoordinateTransformation> from(to->GetInverse());
  const proto::Lattice cells = lattice(kPhotoLevel);
  double east = cells.longitude_deg(kPhotoWest), north = cells.latitude_deg(kPhotoNorth);
  from->Transform(1, &east, &north);
  Sheet sheet;
  sheet.crs = "EPSG:32632";
  sheet.columns = 300;
  sheet.rows = 280;
  sheet.place = {east, 1.5, 0.2, north, 0.1, -1.5};
  sheet.colour = [place = sheet.place, to](int c, int r) {
    double x = place[0] + (c + 0.5) * place[1] + (r + 0.5) * place[2], y = place[3] + (c + 0.5) * place[4] + (r + 0.5) * place[5];
    to->Transform(1, &x, &y);
    const proto::Lattice all = lattice(kPhotoLevel);
    const double cell = all.cell_deg();
    return Rgba{static_cast<int>(std::lround((x - all.longitude_deg(kPhotoWest)) / cell)),
                static_cast<int>(std::lround((all.latitude_deg(kPhotoNorth) - y) / cell)), 50, c < 40 ? 0 : 255};
  };
  return sheet;
}

TEST_F(Photo, LiesWhereItsCrsSays) {
  const auto made = photo(in_utm());
  int seen = 0;
  for (int r = 4; r < 150; r += 7) {
    for (int c = 4; c < 200; c += 7) {
      const Rgba at = colour(*made, kPhotoLevel, kPhotoWest + c, kPhotoNorth - r);
      if (at[3] != 255) continue;
      EXPECT_NEAR(at[0], c, 1.01) << c << " " << r;
      EXPECT_NEAR(at[1], r, 1.01) << c << " " << r;
      ++seen;
    }
  }
  EXPECT_GT(seen, 120);
}

TEST_F(Photo, HasTheSameBytesWhicheverWindowAsks) {
  Sheet sheet = in_utm();
  for (const bool overviews : {false, true}) {
    sheet.overviews = overviews ? std::vector<int>{2, 4} : std::vector<int>();
    const auto made = photo(sheet, overviews ? "small.tif" : "photo.tif");
    for (const int level : {kPhotoLevel + 1, kPhotoLevel, kPhotoLevel - 1, kPhotoLevel - 3}) {
      const std::int64_t west = level > kPhotoLevel ? 2 * kPhotoWest : kPhotoWest >> (kPhotoLevel - level),
                         north = level > kPhotoLevel ? 2 * kPhotoNorth : kPhotoNorth >> (kPhotoLevel - level);
      const int side = 160 >> std::max(kPhotoLevel - level, 0);
      const auto whole = colours(*made, level, {west, north - side, side, side});
      const auto part = colours(*made, level, {west + side / 4, north - side / 2, side / 2, side / 4});
      bool any = false;
      for (int r = 0; r < side / 4; ++r)
        for (int c = 0; c < side / 2; ++c) {
          const Rgba& one = part[static_cast<std::size_t>(r * (side / 2) + c)];
          EXPECT_EQ(one, whole[static_cast<std::size_t>((side / 4 + r) * side + side / 4 + c)])
              << level << ": " << c << ", " << r;
          any |= one[3] == 255;
        }
      EXPECT_TRUE(any) << level;
    }
  }
}

TEST_F(Photo, IsAMeanWhereCellsAreWider) {
  Sheet sheet;
  sheet.colour = [](int c, int r) { return Rgba{(c + r) % 2 * 255, c < kPhotoSide / 2 ? 200 : 0, 10, 255}; };
  for (const std::vector<int>& overviews : {std::vector<int>{}, {2, 4, 8}}) {
    sheet.overviews = overviews;
    const auto made = photo(sheet, overviews.empty() ? "photo.tif" : "small.tif");
    for (const int up : {2, 4}) {
      const std::int64_t i = (kPhotoWest + 64) >> up, j = (kPhotoNorth - 112) >> up;
      const Rgba at = colour(*made, kPhotoLevel - up, i, j);
      EXPECT_NEAR(at[0], 127, 3) << up;
      EXPECT_EQ(at[1], 200) << up;
      EXPECT_EQ(at[3], 255) << up;
    }
  }
}

TEST_F(Photo, HasHolesWhereAlphaMaskOrNodataSay) {
  const auto hole = [](int c, int r) { return c >= 100 ? Rgba{0, 0, 0, 0} : Rgba{c, 0, r == 3 ? 0 : 9, 255}; };
  Sheet sheet;
  sheet.place[0] -= sheet.place[1] / 2;
  sheet.place[3] -= sheet.place[5] / 2;
  sheet.colour = hole;
  const auto check = [&](const std::string& name) {
    const auto made = photo(sheet, name);
    EXPECT_EQ(colour(*made, kPhotoLevel, kPhotoWest + 50, kPhotoNorth - 50), (Rgba{50, 0, 9, 255})) << name;
    EXPECT_EQ(colour(*made, kPhotoLevel, kPhotoWest, kPhotoNorth - 20)[3], 255) << name << ": a colour may be zero in part";
    EXPECT_EQ(colour(*made, kPhotoLevel, kPhotoWest + 150, kPhotoNorth - 50), Rgba()) << name;
    EXPECT_EQ(colour(*made, kPhotoLevel - 2, (kPhotoWest + 40) >> 2, (kPhotoNorth - 48) >> 2)[2], 9)
        << name << ": what is void has no colour";
  };
  check("alpha.tif");
  sheet.bands = 3;
  sheet.mask = true;
  check("mask.tif");
  sheet.mask = false;
  sheet.nodata = 0;
  check("nodata.tif");
}

TEST_F(Photo, GoesOnOverTheAntimeridian) {
  Sheet sheet;
  sheet.columns = 64;
  sheet.rows = 32;
  sheet.place = {176, 0.125, 0, 10, 0, -0.125};
  const auto made = photo(sheet);
  const proto::Lattice cells = lattice(3);  // 0.088 degrees
  const std::int64_t around = cells.columns(), row = std::llround(98 / cells.cell_deg());
  for (const std::int64_t i : {std::int64_t{0}, std::int64_t{10}, around - 10}) EXPECT_EQ(colour(*made, 3, i, row)[3], 255) << i;
  EXPECT_EQ(colour(*made, 3, around, row), colour(*made, 3, 0, row));
  EXPECT_EQ(colour(*made, 3, 100, row)[3], 0);
}

/// As flights and map servers deliver them, with a world file and an .aux.xml.
TEST_F(Photo, MayBeAPictureOfACommonFormat) {
  GDALDatasetUniquePtr tiff(GDALDataset::Open(write_photo({}).c_str()));
  for (const auto& [driver, name] : {std::pair("PNG", "photo.png"), {"JPEG", "photo.jpg"}}) {
    GDALDriver* const made_by = GetGDALDriverManager()->GetDriverByName(driver);
    ASSERT_NE(made_by, nullptr);
    const char* const rgb[] = {"-b", "1", "-b", "2", "-b", "3", "-of", driver, nullptr};
    const std::unique_ptr<GDALTranslateOptions, decltype(&GDALTranslateOptionsFree)> how(
        GDALTranslateOptionsNew(const_cast<char**>(rgb), nullptr), GDALTranslateOptionsFree);
    GDALClose(GDALTranslate(path(name).c_str(), GDALDataset::ToHandle(tiff.get()), how.get(), nullptr));
    const auto photo = raster::open_orthophoto(path(name));
    EXPECT_TRUE(photo.ok()) << (photo.ok() ? "" : photo.problem().line());
  }
}

TEST_F(Photo, ThatIsNoneIsToldAsWhatItIs) {
  Sheet sheet;
  sheet.columns = sheet.rows = 4;
  sheet.bands = 1;
  EXPECT_NE(problem_of(write_photo(sheet)).find("raster-bands: photo.tif has one band, and none that are red, green and blue"),
            std::string::npos);
  sheet.bands = 3;
  sheet.type = GDT_UInt16;
  EXPECT_NE(problem_of(write_photo(sheet)).find("raster-type: photo.tif has colours of type UInt16; accepted: bands of bytes"),
            std::string::npos);
  sheet.type = GDT_Byte;
  sheet.crs = "";
  EXPECT_EQ(problem_of(write_photo(sheet)).substr(0, 6), "raster");
  EXPECT_EQ(problem_of(path("none.tif")).substr(0, 40), "raster-not-found: none.tif does not exis");
  EXPECT_EQ(problem_of(write_text("no picture", "text.tif")).substr(0, 25), "raster-format-unsupported");
  sheet.crs = "EPSG:4326";
  const std::string file = write_photo(sheet, "cut.tif");
  std::filesystem::resize_file(file, std::filesystem::file_size(file) - 20);
  EXPECT_NE(problem_of(file), "");
}

}  // namespace
}  // namespace cordillera::raster_test
