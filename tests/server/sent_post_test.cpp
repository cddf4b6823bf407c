// Every format, posted as people send it to the real program: the job reads it inside its sandbox, and the heights are the
// raster's.
#include <httplib.h>

#include <algorithm>
#include <cmath>

#include "../raster/sent.h"
#include "real_server.h"

namespace cordillera::server {
namespace {

using raster_test::SentRow;
using raster_test::Spec;
using raster_test::zip_files;

class SentPosts : public raster_test::RasterTest {
 protected:
  void SetUp() override {
    server_.start(path(""), {"--threads", "1"});
    client_ = std::make_unique<httplib::Client>("127.0.0.1", server_.port());
    client_->set_read_timeout(300);
  }
  void TearDown() override {
    client_.reset();
    EXPECT_EQ(server_.end(SIGTERM), 0) << server_.log();
  }

  /// The answer to a POST that waits for the build's end.
  httplib::Result post(const std::string& file, const std::string& name, const std::string& query) {
    const httplib::Headers headers{{"Prefer", "wait=250"}};
    return client_->Post("/v1/datasets?vertical_datum=ellipsoid&error=0.5&name=" + name + query, headers, file_text(file),
                         "application/octet-stream");
  }
  /// The same of several files, the last one first.
  httplib::Result post_form(const std::vector<std::pair<std::string, std::string>>& files, const std::string& query) {
    httplib::MultipartFormDataItems items;
    for (auto file = files.rbegin(); file != files.rend(); ++file)
      items.push_back({"file", file_text(file->second), file->first, "application/octet-stream"});
    return client_->Post("/v1/datasets?vertical_datum=ellipsoid&error=0.5" + query, {{"Prefer", "wait=250"}}, items);
  }
  /// Heights of a ready dataset along a line over the hills.
  std::vector<double> heights(const httplib::Result& posted) {
    std::vector<double> found;
    if (!posted || posted->status != 201) {
      ADD_FAILURE() << (posted ? posted->body : server_.log());
      return found;
    }
    const std::string place = posted->get_header_value("Location");
    const auto answer =
        client_->Get("/v1/datasets/" + place.substr(place.rfind('/') + 1) + "/elevation?line=10.03,44.95;10.57,44.57&samples=40");
    if (!answer || answer->status != 200) {
      ADD_FAILURE() << (answer ? answer->body : "no answer");
      return found;
    }
    const Json said = Json::parse(answer->body, nullptr, false);
    for (const Json& point : said["points"])
      found.push_back(point["ellipsoidal_height"].is_null() ? -1e9 : point["ellipsoidal_height"].get<double>());
    return found;
  }

  RealServer server_;
  std::unique_ptr<httplib::Client> client_;
};

TEST_F(SentPosts, HeightsAreThoseOfTheGeoTiff) {
  const httplib::Result tiff = post(write(raster_test::hills(), "good.tif"), "good.tif", "");
  const std::vector<double> good = heights(tiff);
  ASSERT_EQ(good.size(), 40u);
  const Json notes = Json::parse(tiff->body)["notes"];  // its one void
  ASSERT_EQ(notes.size(), 1u) << notes.dump();
  EXPECT_NE(std::string(notes[0]).find("of the data were voids and are filled; voids=hole keeps them"), std::string::npos)
      << notes.dump();
  std::vector<std::string> done;
  for (const SentRow& row : raster_test::sent_rows()) {
    if (std::find(done.begin(), done.end(), row.driver) != done.end() && std::string(row.name) != "netCDF-4, deflated")
      continue;  // one of each library
    done.emplace_back(row.driver);
    SCOPED_TRACE(row.name);
    Spec spec = raster_test::hills();
    spec.driver = row.driver, spec.type = row.type, spec.create = row.create;
    const auto files = files_of(row, write(spec, row.file));
    const bool zipped = !row.beside.empty();
    if (zipped) zip_files(path("dem.zip"), files);
    const std::string query = std::string(row.says_crs ? "" : "&crs=EPSG:4326") + (row.says_nodata() ? "" : "&nodata=-9999");
    const std::vector<double> found =
        heights(post(zipped ? path("dem.zip") : files.front().second, zipped ? "dem.zip" : row.file, query));
    ASSERT_EQ(found.size(), good.size());
    for (std::size_t k = 0; k < good.size(); ++k) EXPECT_NEAR(found[k], good[k], 1.0) << "place " << k;
    std::filesystem::remove(path("dem.zip"));
    if (zipped) { EXPECT_EQ(heights(post_form(files, query)), found) << "each in a part of a form"; }
  }
  EXPECT_EQ(done.size(), 10u);
}

TEST_F(SentPosts, BrokenOnesAreNamed) {
  const std::string tiff = write(raster_test::hills(), "good.tif");
  zip_files(path("two.zip"), {{"a.tif", tiff}, {"b.tif", tiff}});
  Spec spec = raster_test::hills();
  spec.driver = "netCDF";
  const std::string whole = file_text(write(spec, "dem.nc"));
  write_text(whole.substr(0, whole.size() / 2), "half.nc");
  const struct {
    const char* name;
    const char* slug;
    const char* words;
  } rows[] = {{"two.zip", "archive-rasters", "two.zip holds 2 rasters: a.tif, b.tif"},
              {"half.nc", "raster-truncated", "half.nc has"}};
  for (const auto& row : rows) {
    const auto answer = post(path(row.name), row.name, "");
    ASSERT_TRUE(answer);
    EXPECT_EQ(answer->status, 422);
    const Json said = Json::parse(answer->body);
    EXPECT_EQ(said["type"], std::string("urn:cordillera:problem:") + row.slug);
    EXPECT_EQ(std::string(said["detail"]).rfind(row.words, 0), 0u) << answer->body;
    EXPECT_FALSE(std::string(said["accepted"]).empty());
  }
}

}  // namespace
}  // namespace cordillera::server
