#pragma once
// The program itself with a dataset whose rasters can be changed.
#include <gtest/gtest.h>
#include <httplib.h>

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "program_fixture.h"
#include "tests/whole/bytes.h"
#include "tests/whole/dem.h"

namespace cordillera::server {

/// Three rasters of one level, and one that is none; the first of them is posted.
class Updates : public testing::Test {
 protected:
  static constexpr int kLevel = 12;
  static constexpr std::int64_t kWest = 4096 * proto::kTileCells, kNorth = 3000 * proto::kTileCells;
  static constexpr const char* kOptions = "vertical_datum=ellipsoid&error=60&max_level=12&title=t";

  void SetUp() override {
    write("base.tif", 20, 20, 1100, 70);
    write("patch.tif", 300, 300, 60, 71);
    write("other.tif", 700, 700, 50, 72);
    std::ofstream(path("broken.tif")) << "II*";
  }
  void write(const std::string& name, int east, int north, int side, std::uint32_t seed) {
    whole::write(whole::points_of({kLevel, kWest + east, kNorth + north}, side, side, whole::rough(seed)), path(name));
  }
  std::string path(const std::string& name) const { return (folder_.path() / name).string(); }

  struct Said {
    int status = 0;
    Json body;
    std::string etag;
    std::string bytes;
  };
  Said ask(const std::string& method, const std::string& where, const std::string& raster = "",
           const httplib::Headers& headers = {}) {
    httplib::Client client(server_.base());
    client.set_read_timeout(400);
    httplib::Request request;
    request.method = method;
    request.path = where;
    request.headers = headers;
    if (!raster.empty()) request.body = file_text(path(raster));
    const auto answer = client.send(request);
    if (!answer) return {};
    return {answer->status, Json::parse(answer->body, nullptr, false), answer->get_header_value("ETag"), answer->body};
  }
  /// A change, waited for.
  Said change(const std::string& method, const std::string& where, const std::string& raster = "",
              httplib::Headers headers = {}) {
    headers.emplace("Prefer", "wait=300");
    return ask(method, base_ + where, raster, headers);
  }
  void post(const std::string& query = "&updates=1") {
    const Said posted =
        ask("POST", std::string("/v1/datasets?name=base.tif&") + kOptions + query, "base.tif", {{"Prefer", "wait=300"}});
    ASSERT_EQ(posted.status, 201) << posted.bytes << server_.log();
    id_ = posted.body["id"];
    base_ = "/v1/datasets/" + id_;
  }
  void begin(const std::vector<std::string>& options = {}) {
    server_.start(folder_.path(), options);
    post();
  }
  Json listed() { return ask("GET", base_ + "/sources").body; }
  std::string source(std::size_t position) { return listed()["sources"][position]["id"]; }
  std::filesystem::path dataset() const { return folder_.path() / "data" / "datasets" / id_; }
  whole::Bytes served() { return whole::published((dataset() / "dataset.sqlite").string()); }
  /// What the command line makes of the same rasters in the same order.
  whole::Bytes from_nothing(const std::string& list) {
    std::ofstream(path("list.txt")) << list;
    const std::string plan = path("plan"), store = path("scratch.sqlite");
    const Ended made =
        shell("cd " + folder_.path().string() + " && rm -rf plan && " + kProgram +
              " plan list.txt -o plan --vertical-datum ellipsoid --error 60 --max-level 12 --title t --block 1024 -q && " +
              kProgram + " work plan -q && " + kProgram + " publish plan -o scratch.sqlite --overwrite -q");
    EXPECT_EQ(made.code, 0) << made.output;
    return whole::published(store);
  }
  std::string slug(const Said& said) {
    const std::string type = said.body.is_object() ? said.body.value("type", "") : "";
    return type.substr(type.rfind(':') + 1);
  }

  TempFolder folder_;
  RealServer server_;
  std::string id_, base_;
};

}  // namespace cordillera::server
