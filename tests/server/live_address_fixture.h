#pragma once
// The program beside a host that has rasters, and what is asked of both.
#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "program_fixture.h"
#include "raster_host.h"

namespace cordillera::server {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

/// A cone whose top is so high, in metres.
inline std::string cone_of(int top) {
  std::ostringstream text;
  text << "ncols 64\nnrows 64\nxllcorner 10\nyllcorner 46\ncellsize 0.0083333333333333\nNODATA_value -9999\n";
  for (int row = 0; row < 64; ++row) {
    for (int column = 0; column < 64; ++column) text << top - 10 * std::hypot(row - 31.5, column - 31.5) << ' ';
    text << '\n';
  }
  return text.str();
}

class LiveAddress : public Program {
 protected:
  void SetUp() override {
    host_.has_tagged("/dems/cone.asc", cone_of(2000), "\"one\"");
    host_.has_tagged("/dems/signed.asc?sig=secret", cone_of(1000), "\"signed\"");
  }
  void start(std::vector<std::string> more = {}, const std::string& allowed = "/dems/") {
    more.insert(more.begin(), {"--source-allow", host_.address() + allowed, "--max-wait", "600"});
    server_.start(folder_.path(), more);
  }
  /// The query of a raster on the host.
  std::string query(const std::string& target, const std::string& options = "") const {
    std::string escaped;
    for (const char c : host_.address() + target)
      escaped += c == '?' ? "%3F" : c == '=' ? "%3D" : c == '&' ? "%26" : std::string(1, c);
    return "?url=" + escaped + "&crs=EPSG:4326&vertical_datum=ellipsoid&error=20" + options;
  }
  /// The whole answer, its head first.
  std::string whole(const std::string& path, const std::string& more = "") {
    return shell("curl -q -s -i -m 500 " + more + " '" + server_.base() + path + "'").output;
  }
  std::string body(const std::string& path, const std::string& more = "") {
    return shell("curl -q -s -m 500 " + more + " '" + server_.base() + path + "'").output;
  }
  Json json(const std::string& path, const std::string& more = "") { return Json::parse(body(path, more), nullptr, false); }
  std::string slug(const std::string& path, const std::string& more = "") {
    Json answer = json(path, more);
    const std::string type = answer.is_object() ? answer.value("type", "") : "";
    return type.substr(type.rfind(':') + 1);
  }
  /// The dataset of a query; something of it can be read.
  std::string id_of(const std::string& query, const std::string& more = "") {
    const Json answer = json("/v1/live" + query, "-H 'Prefer: wait=500' " + more);
    EXPECT_TRUE(answer.contains("id")) << answer << server_.log();
    return answer.value("id", "");
  }
  Json status(const std::string& id) { return json("/v1/datasets/" + id); }
  /// Height in the middle; 0: there is none.
  double top(const std::string& query) {
    Json answer = json("/v1/live/elevation" + query + "&points=10.2666,46.2666");
    return answer["points"].is_array() && answer["points"][0]["ellipsoidal_height"].is_number()
               ? answer["points"][0]["ellipsoidal_height"].get<double>()
               : 0;
  }
  long asked(const std::string& target) const {
    const auto all = host_.asked();
    return std::count(all.begin(), all.end(), target);
  }
  fs::path folder_of(const std::string& id) const { return folder_.path() / "data" / "datasets" / id; }

  RasterHost host_;
};

/// A raster that is read by ranges: a COG that is large beside what is looked at.
class ByRanges : public LiveAddress {
 protected:
  static constexpr int kSide = 2048;
  static constexpr double kWest_deg = 10.74, kNorth_deg = 46.92, kPixel_deg = 0.0005;  // four blocks meet in the middle
  static constexpr const char* kCog = "/dems/hills.tif";
  void SetUp() override {
    raster_ = (folder_.path() / "hills.tif").string();
    hills_ = cog_of(1000);
    host_.has_parts(kCog, hills_, "\"one\"");
  }
  /// Gentle hills about a height in metres, or a part of them, in columns and rows. The file stays.
  struct Part {
    int column = 0, row = 0, columns = kSide, rows = kSide;
  };
  std::string cog_of(int height) const { return cog_of(height, Part(), raster_); }
  static std::string cog_of(int height, const Part& part, const std::string& file) {
    GDALAllRegister();
    const auto driver = [](const char* name) { return GetGDALDriverManager()->GetDriverByName(name); };
    const GDALDatasetUniquePtr pixels(driver("MEM")->Create("", part.columns, part.rows, 1, GDT_Int16, nullptr));
    double place[] = {kWest_deg + part.column * kPixel_deg, kPixel_deg, 0, kNorth_deg - part.row * kPixel_deg, 0, -kPixel_deg};
    pixels->SetGeoTransform(place);
    std::vector<std::int16_t> line(static_cast<std::size_t>(part.columns));
    for (int row = 0; row < part.rows; ++row) {
      for (int column = 0; column < part.columns; ++column)
        line[static_cast<std::size_t>(column)] = static_cast<std::int16_t>(
            height + 200 * std::sin((part.column + column) / 300.0) * std::cos((part.row + row) / 250.0));
      EXPECT_EQ(pixels->GetRasterBand(1)->RasterIO(GF_Write, 0, row, part.columns, 1, line.data(), part.columns, 1, GDT_Int16, 0,
                                                   0, nullptr),
                CE_None);
    }
    const char* options[] = {"COMPRESS=NONE", "BLOCKSIZE=256", nullptr};
    EXPECT_TRUE(GDALDatasetUniquePtr(
        driver("COG")->CreateCopy(file.c_str(), pixels.get(), FALSE, const_cast<char**>(options), nullptr, nullptr)));
    return file_text(file);
  }
  std::string sought() const { return query(kCog, "&max_level=11"); }
  /// Of the finest level, or another.
  static std::string tile_at(double longitude_deg, double latitude_deg, int level = 11) {
    const double tiles = std::ldexp(1, level) / 180;
    return "/tiles/" + std::to_string(level) + "/" + std::to_string(static_cast<int>((180 + longitude_deg) * tiles)) + "/" +
           std::to_string(static_cast<int>((90 + latitude_deg) * tiles)) + ".drc";
  }
  std::string final_tile(const std::string& id, const std::string& tile) {
    return body("/v1/datasets/" + id + tile, "-H 'Prefer: wait=500'");
  }
  std::string posted() {
    return curl("--data-binary @" + raster_ + " -H 'Prefer: wait=500' '" + server_.base() +
                "/v1/datasets?name=hills.tif&crs=EPSG:4326&vertical_datum=ellipsoid&error=20&build=lazy&max_level=11'")
        .value("id", "");
  }
  std::string hills_;
};

}  // namespace cordillera::server
