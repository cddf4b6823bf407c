// Points as text: what their columns are called, and where a file has none.
#include <cmath>

#include "fixture.h"
#include "raster/open/point_lines.h"
#include "sent.h"

namespace cordillera::raster_test {
namespace {

using raster::Trust;

/// A grid of points from the south, 100 m + its number high; has: which of them there are.
struct Grid {
  static constexpr int kColumns = 7, kRows = 5;

  static double longitude(int column) { return 10 + 0.01 * column; }
  static double latitude(int row) { return 45 + 0.01 * row; }
  static double height(int column, int row) { return 100 + 10 * row + column; }

  template <class Line>
  static std::string text(const std::string& first, const Line& line) {
    std::string lines = first + "\n";
    for (int row = 0; row < kRows; ++row)
      for (int column = 0; column < kColumns; ++column) lines += line(column, row);
    return lines;
  }
};

class Points : public RasterTest {
 protected:
  Points() { options_.set_crs("EPSG:4326"); }

  double at(raster::Source& source, int column, int row) {
    const double longitude = Grid::longitude(column), latitude = Grid::latitude(row);
    double height = 0;
    EXPECT_TRUE(source.nearest(std::span(&longitude, 1), std::span(&latitude, 1), &height).ok());
    return height;
  }
  void expect_heights(raster::Source& source) {
    for (int row = 0; row < Grid::kRows; ++row)
      for (int column = 0; column < Grid::kColumns; ++column)
        EXPECT_EQ(at(source, column, row), Grid::height(column, row)) << column << " " << row;
  }

  proto::BuildOptions options_ = plain_options();
};

TEST_F(Points, ColumnsAreWhatTheirNamesSay) {
  const auto number = [](double value) { return std::to_string(value); };
  const auto x = [&](int c, int) { return number(Grid::longitude(c)); };
  const auto y = [&](int, int r) { return number(Grid::latitude(r)); };
  const auto z = [&](int c, int r) { return number(Grid::height(c, r)); };
  const auto other = [](int, int) { return std::string("7"); };
  using Column = std::function<std::string(int, int)>;
  struct Kind {
    const char* names;
    const char* separator;
    std::vector<Column> columns;
  };
  const Kind kinds[] = {
      {"lat,lon,elevation", ",", {y, x, z}},
      {"Latitude,Longitude,Elevation", ",", {y, x, z}},
      {"lon,lat,count,elevation", ",", {x, y, other, z}},
      {"northing;easting;elev", ";", {y, x, z}},
      {"# Easting (m),Northing (m),Elevation (m)", ",", {x, y, z}},
      {"lat lon depth_of_snow", " ", {y, x, z}},  // of three it is the third
      {"X\tY\tIntensity\tElevation", "\t", {x, y, other, z}},
      {"lon,lat,elevation,a column of a name so long that all the names together are more than a hundred letters long",
       ",",
       {x, y, z, other}},
      {"lon,lat,alt", ",", {x, y, z}},
      {"point;latitude;longitude;height_error;height",
       ";",
       {other, y, x, other, z}},                      // the word itself goes before what begins with it
      {"Rechtswert;Hochwert;Hoehe", ";", {x, y, z}},  // as no names are known
  };
  int count = 0;
  for (const Kind& kind : kinds) {
    SCOPED_TRACE(kind.names);
    const std::string text = Grid::text(kind.names, [&](int c, int r) {
      std::string line;
      for (const Column& column : kind.columns) line += (line.empty() ? "" : kind.separator) + column(c, r);
      return line + "\n";
    });
    const std::string name = "points" + std::to_string(++count) + ".csv";
    for (const auto& file : {write_text(text, name), write_text("\xef\xbb\xbf" + text, "marked" + name)}) {
      const auto source = must_open(file, options_);
      if (source) expect_heights(*source);
    }
    zip_files(path(name + ".zip"), {{name, path(name)}});
    const auto unpacked = must_open(path(name + ".zip"), options_, Trust::posted_file, name + ".zip");
    if (unpacked) expect_heights(*unpacked);
  }
}

TEST_F(Points, WithoutAColumnOfHeightsAreRefused) {
  const std::string text = Grid::text("lon,lat,count,temperature", [](int c, int r) {
    return std::to_string(Grid::longitude(c)) + "," + std::to_string(Grid::latitude(r)) + ",7,20\n";
  });
  const auto refused = open(write_text(text, "points.csv"), options_);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().type, "raster-format-unsupported");
  EXPECT_EQ(refused.problem().detail,
            "points.csv has points whose first line names no column of heights: lon,lat,count,temperature");
}

/// GDAL declares no value of its own for points that are missing where one is as low as -32768, and of bytes with a 0.
TEST_F(Points, ColumnsBeforeThemMayBeEmptyOrWords) {
  const std::string text = Grid::text("id,x,y,z", [](int c, int r) {
    const std::string id = r % 2 == 0 ? "" : "P" + std::to_string(c);
    return id + "," + std::to_string(Grid::longitude(c)) + "," + std::to_string(Grid::latitude(r)) + "," +
           (c + r == 0 ? "-99999" : std::to_string(Grid::height(c, r))) + "\n";
  });
  options_.set_nodata("-99999");
  const auto source = must_open(write_text(text, "ids.csv"), options_);
  ASSERT_TRUE(source);
  for (int row = 0; row < Grid::kRows; ++row)
    for (int column = row == 0 ? 1 : 0; column < Grid::kColumns; ++column)
      EXPECT_EQ(at(*source, column, row), Grid::height(column, row)) << column << " " << row;
}

TEST_F(Points, OtherTextsAreNone) {
  for (const char* name : {"east.dem", "east.grd"})
    EXPECT_EQ(raster::names_for_gdal("EASTPORT ME\n1 2 3\n", name).value(), std::nullopt) << name;
  EXPECT_EQ(raster::names_for_gdal("# UTM zone 32 north\n600000 5000000 100 1 2\n", "a.xyz").value(), std::nullopt);
  EXPECT_EQ(raster::names_for_gdal("1 2 3\n4 5 6\n", "a.xyz").value(), std::nullopt);
  EXPECT_EQ(raster::names_for_gdal("", "a.xyz").value(), std::nullopt);
}

TEST_F(Points, WhereThereAreNoneIsNoData) {
  const auto is_there = [](int column, int row) { return column + row < 9; };
  for (const int lowest : {0, 1, -20, -32768, -99999}) {
    SCOPED_TRACE(lowest);
    const auto height = [&](int column, int row) { return column + row == 0 ? lowest : 100 + column; };
    const std::string text = Grid::text("x y z", [&](int c, int r) {
      if (!is_there(c, r)) return std::string();
      return std::to_string(Grid::longitude(c)) + " " + std::to_string(Grid::latitude(r)) + " " + std::to_string(height(c, r)) +
             "\n";
    });
    options_.set_nodata(lowest < -9000 ? std::to_string(lowest) : "");
    const auto source = must_open(write_text(text, "gap" + std::to_string(-lowest) + ".xyz"), options_);
    ASSERT_TRUE(source);
    for (int row = 0; row < Grid::kRows; ++row)
      for (int column = 0; column < Grid::kColumns; ++column) {
        const double found = at(*source, column, row);
        if (is_there(column, row) && height(column, row) > -9000)
          EXPECT_EQ(found, height(column, row)) << column << " " << row;
        else
          EXPECT_TRUE(std::isnan(found)) << column << " " << row << ": " << found;
      }
  }
}

}  // namespace
}  // namespace cordillera::raster_test
