#pragma once
// A folder with a small raster, and the program's command lines and server in it.
#include <cmath>

#include "real_server.h"

namespace cordillera::server {

/// A cone of 64 x 64 samples of half an arc minute, as an Esri ASCII grid.
inline std::string cone() {
  std::ostringstream text;
  text << "ncols 64\nnrows 64\nxllcorner 10\nyllcorner 46\ncellsize 0.0083333333333333\nNODATA_value -9999\n";
  for (int row = 0; row < 64; ++row) {
    for (int column = 0; column < 64; ++column) text << 3000 - 40 * std::hypot(row - 31.5, column - 31.5) << ' ';
    text << '\n';
  }
  return text.str();
}

class Program : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_.path() / "cone.asc") << cone();
    raster_ = (folder_.path() / "cone.asc").string();
  }
  std::string build(const std::string& arguments) {
    return kProgram + " build " + raster_ + " --crs EPSG:4326 --vertical-datum ellipsoid " + arguments;
  }

  void start_server() { server_.start(folder_.path()); }
  /// To be kept in what is not const: a member that an answer lacks is null there, and ends the program in a constant.
  Json curl(const std::string& arguments) { return Json::parse(shell("curl -q -s -m 500 " + arguments).output, nullptr, false); }
  std::string post_arguments(const std::string& query = "") {
    return "--data-binary @" + raster_ + " '" + server_.base() +
           "/v1/datasets?name=cone.asc&crs=EPSG:4326&vertical_datum=ellipsoid" + query + "'";
  }

  TempFolder folder_;
  std::string raster_;
  RealServer server_;
};

}  // namespace cordillera::server
