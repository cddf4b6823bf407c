#pragma once
// The real program with a raster whose build takes long enough to look at it meanwhile.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>

#include "program_fixture.h"

namespace cordillera::server {

/// The program with a raster whose build takes long enough to look at it meanwhile.
class LiveProgram : public Program {
 protected:
  void SetUp() override {
    constexpr int kSide = 640;
    raster_ = (folder_.path() / "hills.asc").string();
    std::ofstream out(raster_);
    out << "ncols " << kSide << "\nnrows " << kSide << "\nxllcorner 10\nyllcorner 46\ncellsize 0.0005\n";
    for (int row = 0; row < kSide; ++row) {
      for (int column = 0; column < kSide; ++column)
        out << static_cast<int>(1000 + 300 * std::sin(column / 9.0) * std::cos(row / 7.0)) << ' ';
      out << '\n';
    }
    out.close();
    start_server();
  }
  /// Its provisional tiles stand, and its build goes on.
  std::string posted(const std::string& options = "&error=2") {
    const Json answer = curl("--data-binary @" + raster_ + " '" + server_.base() +
                             "/v1/datasets?name=hills.asc&crs=EPSG:4326&vertical_datum=ellipsoid&threads=1" + options + "'");
    const std::string id = answer.value("id", "");
    EXPECT_TRUE(eventually([&] { return status(id)["provisional"] == true; })) << answer.dump() << server_.log();
    return id;
  }
  Json status(const std::string& id) { return curl(server_.base() + "/v1/datasets/" + id); }
  Json get(const std::string& id, const std::string& path) { return curl(server_.base() + "/v1/datasets/" + id + path); }
  std::string head(const std::string& id, const std::string& path, const std::string& more = "") {
    return shell("curl -q -s -m 500 -D - -o /dev/null " + more + server_.base() + "/v1/datasets/" + id + path).output;
  }
  /// A tile of the level that holds the raster's middle.
  static std::string middle(int level) {
    const double tiles = std::ldexp(1, level) / 180;
    return "/tiles/" + std::to_string(level) + "/" + std::to_string(static_cast<int>((10.15 + 180) * tiles)) + "/" +
           std::to_string(static_cast<int>((46.15 + 90) * tiles)) + ".drc";
  }
  bool is_ready(const std::string& id) {
    return eventually([&] { return status(id)["state"] == "ready"; });
  }
  std::filesystem::path folder_of(const std::string& id) const { return folder_.path() / "data" / "datasets" / id; }
};

/// And with lazy datasets of it.
class LazyProgram : public LiveProgram {
 protected:
  /// A finest tile, so far south-west or north-east of the middle that its block is another.
  std::string finest(double shift_deg) const {
    const double tiles = std::ldexp(1, kFinest) / 180;
    const auto at = [&](double deg) { return std::to_string(static_cast<int>((deg + shift_deg) * tiles)); };
    return "/tiles/" + std::to_string(kFinest) + "/" + at(10.15 + 180) + "/" + at(46.15 + 90) + ".drc";
  }
  /// Now: nobody waits for it.
  bool is_there(const std::string& id, const std::string& path) {
    return head(id, path, "-H 'Prefer: wait=0' ").find("200 OK") != std::string::npos;
  }
  static constexpr int kFinest = 13;
  static constexpr double kAway_deg = 0.12;
  const std::string lazy_ = "&error=8&build=lazy&max_level=" + std::to_string(kFinest);
};

}  // namespace cordillera::server
