// What a stranger may send: the real program, real HTTP, a row an input. Whatever comes, the answer is a problem that says what
// is wrong with what, the service goes on, and nothing half-made can be listed or fetched.
#include <arpa/inet.h>
#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <httplib.h>
#include <netinet/in.h>
#include <sys/socket.h>

#include <chrono>
#include <cmath>

#include "../raster/fixture.h"
#include "real_server.h"
#include "tests/sanitized.h"

namespace cordillera::server {
namespace {

using raster_test::huge_sparse;
using raster_test::Spec;
using testing::AnyOf;
using testing::HasSubstr;
using namespace std::string_literals;

/// A POST and the answer that it deserves.
struct Row {
  std::string name;  ///< of the raster, as the query gives it
  std::string body;
  std::string query;  ///< further options: "&error=5"
  int status = 422;
  std::string slug;   ///< several, separated by blanks: any of them; empty: the tiles
  std::string words;  ///< in the detail; empty: the raster's name
};

class BadPosts : public raster_test::RasterTest {
 protected:
  void SetUp() override {
    std::filesystem::create_directories(path("grids"));
    Spec grid;  // 100..140 E, the data lies elsewhere
    grid.columns = grid.rows = 40, grid.geotransform = {100, 1, 0, 40, 0, -1}, grid.value = [](int, int) { return 20.0; };
    write(grid, "grids/elsewhere.tif");
    server_.start(path(""), {"--geoids", path("grids"), "--body-limit", "8", "--threads", "2"});
    client_ = std::make_unique<httplib::Client>("127.0.0.1", server_.port());
    client_->set_read_timeout(550);
  }
  void TearDown() override {
    client_.reset();
    EXPECT_EQ(server_.end(SIGTERM), 0) << "the service did not come to the end of the test: " << server_.log();
  }

  std::string bytes(const Spec& spec) const { return file_text(write(spec, "made.tif")); }
  /// A raster whose only place are four ground control points in EPSG:32632.
  std::string with_gcps() const {
    Spec spec;
    spec.crs = "", spec.georeferenced = false;
    const std::string file = write(spec, "gcps.tif");
    GDALDatasetUniquePtr dataset(GDALDataset::Open(file.c_str(), GDAL_OF_RASTER | GDAL_OF_UPDATE));
    GDAL_GCP gcps[4] = {};
    GDALInitGCPs(4, gcps);
    for (int k = 0; k < 4; ++k) {
      gcps[k].dfGCPPixel = k % 2 * 8, gcps[k].dfGCPLine = k / 2 * 8;
      gcps[k].dfGCPX = 5e5 + k % 2 * 80 + k / 2 * 5, gcps[k].dfGCPY = 5e6 - k / 2 * 80;
    }
    OGRSpatialReference utm;
    utm.importFromEPSG(32632);
    EXPECT_EQ(dataset->SetGCPs(4, gcps, &utm), CE_None);
    GDALDeinitGCPs(4, gcps);
    dataset.reset();
    return file_text(file);
  }
  std::string data(const std::string& below) const { return path("data/" + below); }

  Json get(const std::string& from) {
    const auto answer = client_->Get(from);
    return answer ? Json::parse(answer->body, nullptr, false) : Json();
  }
  httplib::Result send(const Row& row) {
    httplib::Headers headers = {{"Prefer", "wait=500"}};
    return client_->Post("/v1/datasets?name=" + row.name + row.query, headers, row.body, "application/octet-stream");
  }
  void post(const Row& row) {
    SCOPED_TRACE(row.name + " " + row.query);
    const auto answer = send(row);
    ASSERT_TRUE(answer) << "no answer: " << server_.log();
    const Json said = Json::parse(answer->body, nullptr, false);
    EXPECT_EQ(answer->status, row.slug.empty() ? 201 : row.status) << answer->body;
    std::string id = answer->get_header_value("Location");
    id = id.substr(id.rfind('/') + 1);
    if (row.slug.empty()) {
      ready_.insert(id);
    } else {
      check_problem(row, said);
      if (!id.empty()) nothing_to_fetch(id, said["type"]);
    }
    nothing_half_made();
  }

  /// It names the thing, says what is wrong with it, and what would do.
  void check_problem(const Row& row, const Json& said) {
    ASSERT_TRUE(said.contains("type")) << said.dump();
    const std::string slug = std::string(said["type"]).substr(std::string("urn:cordillera:problem:").size());
    EXPECT_THAT(" " + row.slug + " ", HasSubstr(" " + slug + " ")) << said.dump();
    EXPECT_THAT(std::string(said["detail"]), HasSubstr(row.words.empty() ? row.name : row.words));
    EXPECT_FALSE(said.value("accepted", "").empty()) << said.dump();
    EXPECT_EQ(said["status"], row.status);
    for (const std::string& ours : {path("data"), "datasets/"s, "source.tif"s, "incoming"s}) {
      EXPECT_EQ(said.dump().find(ours), std::string::npos) << "a path of the server: " << said.dump();
    }
  }
  void nothing_to_fetch(const std::string& id, const Json& type) {
    const std::string base = "/v1/datasets/" + id;
    const Json status = get(base);
    EXPECT_EQ(status["state"], "failed") << status.dump();
    EXPECT_EQ(status["error"]["type"], type) << "the status tells what the answer told";
    for (const char* below :
         {"/manifest.json", "/tileset.json", "/tiles/0/0/0.drc", "/tiles/W/0/0/0.glb", "/subtrees/W/0/0/0.subtree"}) {
      const auto fetched = client_->Get(base + below);
      ASSERT_TRUE(fetched);
      EXPECT_EQ(fetched->status, 409) << below << fetched->body;
      EXPECT_THAT(fetched->body, HasSubstr("dataset-failed"));
    }
    EXPECT_TRUE(eventually([&] { return !std::filesystem::exists(data("datasets/" + id)); }))
        << "bytes of a failed dataset are left";
  }
  void nothing_half_made() {
    const Json list = get("/v1/datasets");
    ASSERT_TRUE(list.contains("datasets")) << "the service does not answer";
    for (const Json& dataset : list["datasets"]) {
      const bool ready = ready_.count(dataset["id"]) != 0;
      EXPECT_EQ(dataset["state"], ready ? "ready" : "failed") << dataset.dump();
      EXPECT_EQ(dataset["manifest"].is_null(), !ready) << dataset.dump();
      EXPECT_EQ(dataset["links"].contains("tileset"), ready) << dataset.dump();
    }
    EXPECT_TRUE(eventually([&] { return std::filesystem::is_empty(data("incoming")); }));
  }

  RealServer server_;
  std::unique_ptr<httplib::Client> client_;
  std::set<std::string> ready_;
};

Spec dem() {
  Spec spec;
  spec.columns = spec.rows = 200, spec.type = "Int16", spec.nodata = -9999;
  spec.value = [](int c, int r) { return (c * 7919 + r * 104729) % 300; };
  return spec;
}

TEST_F(BadPosts, WhatIsNoElevationModel) {
  Spec photo;
  photo.columns = photo.rows = 64, photo.bands = 3, photo.type = "Byte", photo.driver = "PNG", photo.crs = "",
  photo.georeferenced = false;
  photo.value = [](int c, int r) { return (c * r) % 256; };
  const std::string png = file_text(write(photo, "photo.png"));
  ASSERT_EQ(png.substr(1, 3), "PNG");
  const std::string good = bytes(dem());
  const std::string zip = "/vsizip/" + path("dem.zip") + "/dem.tif", gzip = "/vsigzip/" + path("dem.tif.gz");
  for (const std::string& packed : {zip, gzip}) {
    VSILFILE* file = VSIFOpenL(packed.c_str(), "wb");
    ASSERT_TRUE(file) << packed;
    ASSERT_EQ(VSIFWriteL(good.data(), 1, good.size(), file), good.size());
    VSIFCloseL(file);
  }
  const std::string vrt =
      "<VRTDataset rasterXSize=\"200\" rasterYSize=\"200\"><SRS>EPSG:4326</SRS><GeoTransform>10, 0.01, 0, 45, 0, -0.01"
      "</GeoTransform><VRTRasterBand dataType=\"Int16\" band=\"1\"><SimpleSource><SourceFilename>" +
      path("made.tif") + "</SourceFilename></SimpleSource></VRTRasterBand></VRTDataset>";
  const auto half = [&](const char* name) {
    const std::string whole = file_text(path(name));
    return whole.substr(0, whole.size() / 2);
  };
  ASSERT_EQ(raster_test::problem_type(write_text(vrt, "good.vrt")), "") << "a good VRT from the command line";
  const Row rows[] = {
      {"empty.tif", "", "", 400, "body-empty", "no body"},
      {"photo.png", png, "", 422, "raster-format-unsupported", "photo.png is a PNG picture"},
      {"photo.tif", png, "", 422, "raster-format-unsupported", "photo.tif is a PNG picture"},
      {"dem.zip", half("dem.zip"), "", 422, "archive-unreadable", "dem.zip cannot be unpacked"},
      {"dem.tif.gz", half("dem.tif.gz"), "", 422, "archive-unreadable", "dem.tif.gz cannot be unpacked"},
      {"dem.vrt", vrt, "", 422, "raster-format-unsupported", "dem.vrt is a VRT"},
      {"dem.tif", "   " + vrt, "", 422, "raster-format-unsupported", "dem.tif is a VRT"},
      {"page.tif", "<!DOCTYPE html><title>404</title>", "", 422, "raster-format-unsupported", "page.tif is an HTML page"},
      {"lfs.tif", "version https://git-lfs.github.com/spec/v1\noid sha256:0\nsize 5\n", "", 422, "raster-format-unsupported",
       "Git LFS"},
      {"garbage.tif", "II*\0garbage"s, "", 422, "raster-format-unsupported", ""},
      {"text.txt", "12 13 14", "", 422, "raster-format-unsupported", ""},
      {"short.asc", "ncols 100000\nnrows 100000\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 2 3", "", 422, "raster-truncated",
       "short.asc claims"},
      {"nowhere.hgt", std::string(2 * 1201 * 1201, '\0'), "", 422, "hgt-name", ""},
      {"N44W072.hgt", std::string(2 * 1201 * 1200, '\0'), "", 422, "hgt-name", ""},
      {"raster", std::string(2 * 1201 * 1201, '\0'), "", 422, "hgt-name",
       "raster cannot be opened as a raster; it has the size of an .hgt"},
  };
  for (const Row& row : rows) post(row);
}

TEST_F(BadPosts, RastersThatAreNoHeightsOnEarth) {
  const auto with = [](const auto& change) {
    Spec spec = dem();
    change(spec);
    return spec;
  };
  const char* local = R"(LOCAL_CS["building site",LOCAL_DATUM["here",0],UNIT["metre",1],AXIS["x",EAST],AXIS["y",NORTH]])";
  std::string damaged = bytes(with([](Spec& s) { s.create = {"COMPRESS=DEFLATE", "TILED=YES"}; }));
  for (std::size_t at = damaged.size() / 3; at < damaged.size() * 2 / 3; ++at) damaged[at] = static_cast<char>(at * 31);
  const std::string good = bytes(dem());
  const Row rows[] = {
      {"rgb.tif", bytes(with([](Spec& s) { s.bands = 3; })), "", 422, "raster-bands", "rgb.tif has 3 bands"},
      {"complex.tif", bytes(with([](Spec& s) { s.type = "CFloat32"; })), "", 422, "raster-type", ""},
      {"flat.tif", bytes(with([](Spec& s) { s.scale = 0; })), "", 422, "raster-scale", ""},
      {"furlong.tif", bytes(with([](Spec& s) { s.unit = "furlong"; })), "", 422, "unit-unknown",
       "furlong.tif are in \"furlong\""},
      {"void.tif", bytes(with([](Spec& s) { s.value = [](int, int) { return -9999; }; })), "", 422, "raster-all-nodata",
       "void.tif has no data"},
      {"far.tif", bytes(with([](Spec& s) { s.value = [](int, int) { return 30000; }; })), "", 422, "raster-heights-out-of-range",
       "they are 30000 to 30000 m"},
      {"far.tif", bytes(with([](Spec& s) { s.value = [](int, int) { return 30000; }; })), "&nodata=30000", 422,
       "raster-all-nodata", "far.tif has no data"},
      {"nan.tif", bytes(with([](Spec& s) {
         s.type = "Float32";
         s.value = [](int, int) { return NAN; };
       })),
       "", 422, "raster-all-nodata", ""},
      {"damaged.tif", damaged, "", 422, "raster-unreadable", ""},
      {"dem.tif", bytes(with([](Spec& s) { s.crs = ""; })), "", 422, "raster-without-crs", "dem.tif names no coordinate"},
      {"dem.tif", bytes(with([](Spec& s) { s.crs = ""; })), "&crs=EPSG:999999", 422, "crs-unknown", "EPSG:999999"},
      {"dem.tif", bytes(with([](Spec& s) { s.georeferenced = false; })), "", 422, "raster-not-georeferenced", ""},
      {"dem.tif", bytes(with([](Spec& s) {
         s.georeferenced = false;
         s.crs = "";
       })),
       "", 422, "raster-not-georeferenced", "dem.tif does not say where"},
      {"gcps.tif", with_gcps(), "", 422, "raster-not-georeferenced", "gcps.tif is placed by ground control points only"},
      {"site.tif", bytes(with([&](Spec& s) { s.crs = local; })), "", 422, "crs-unsupported",
       "site.tif, building site, is a local"},
      {"metres.tif", bytes(with([](Spec& s) { s.geotransform = {376000, 30, 0, 3808000, 0, -30}; })), "", 422, "crs-mismatch",
       ""},
      {"dem.tif", good, "&crs=EPSG:32632", 422, "crs-conflict", ""},
      {"dem.tif", good, "&vertical_datum=elsewhere.tif", 422, "geoid-does-not-cover", "elsewhere.tif does not cover"},
      {"dem.tif", good, "&vertical_datum=unheard-of.gtx", 422, "geoid-not-found", "unheard-of.gtx"},
      {"dem.tif", good, "&bbox=20,50,21,51", 422, "bbox-outside-raster", ""},
      {"dem.tif", good, "&bbox=10.5,44.5,10.5000001,44.5000001", 422, "raster-all-nodata", "the data of dem.tif inside the bbox"},
      {"dem.tif", good, "&min_level=19", 400, "option-invalid", "min_level 19"},
      {"dem.tif", good, "", 201, "", ""},
  };
  for (const Row& row : rows) post(row);
  if (!kSanitized) post({"dem.tif", good, "&memory=96&error=0.01&max_level=13", 422, "memory-limit", ""});
}

TEST_F(BadPosts, QueriesAndBodies) {
  const std::string good = bytes(dem());
  const Row rows[] = {
      {"dem.tif", good, "&eror=5", 400, "option-unknown", "did you mean error?"},
      {"dem.tif", good, "&error=5&error=6", 400, "option-repeated", "error is given twice"},
      {"dem.tif", good, "&error=5&keep=0.5", 400, "options-conflict", "error and keep"},
      {"dem.tif", good, "&strategy=magic", 400, "option-invalid", "strategy='magic'"},
      {"dem.tif", good, "&strategy=sequential&device=cuda", 400, "options-conflict",
       "sequential collapses one edge after the other"},
      {"dem.tif", good, "&error=-1", 400, "option-invalid", "error='-1': outside 0.01 to 1000000"},
      {"dem.tif", good, "&voids=99999", 400, "option-invalid", "voids='99999'"},
      {"dem.tif", good, "&voids=-9999", 400, "option-invalid", "nodata=-9999 says that this value means no data"},
      {"dem.tif", good, "&device=abacus", 400, "option-invalid", "device='abacus'"},
      {"dem.tif", good, "&vertical_datum=/etc/passwd", 403, "option-forbidden", "names a path"},
      {"dem.tif", good, "&crs=/etc/passwd", 403, "option-forbidden", "files or addresses"},
      {"big.tif", std::string(std::size_t{9} << 20, 'x'), "", 413, "body-too-large", "9437184 bytes"},
  };
  for (const Row& row : rows) post(row);
  const auto form = client_->Post(
      "/v1/datasets", httplib::MultipartFormDataItems{{"file", good, "dem.tif", "image/tiff"}, {"error", "x", "", ""}});
  ASSERT_TRUE(form);
  EXPECT_EQ(form->status, 400);
  EXPECT_THAT(form->body, HasSubstr("error='x'"));
  nothing_half_made();
  EXPECT_TRUE(get("/v1/datasets")["datasets"].empty()) << "a refused request makes no dataset";
}

TEST_F(BadPosts, EveryTenthOfAGoodFile) {
  for (const char* compress : {"NONE", "DEFLATE"}) {
    for (const char* tiled : {"YES", "NO"}) {
      Spec spec = dem();
      spec.create = {"COMPRESS="s + compress, "TILED="s + tiled};
      const std::string good = bytes(spec);
      for (std::size_t tenth = 0; tenth < 10; ++tenth) {
        const std::string cut = good.substr(0, good.size() * tenth / 10);
        post(tenth == 0 ? Row{"cut.tif", cut, "", 400, "body-empty", "no body"}
                        : Row{"cut.tif", cut, "", 422, "raster-truncated raster-format-unsupported", ""});
      }
      post({"whole.tif", good, "&max_level=5", 201, "", ""});
    }
  }
}

TEST_F(BadPosts, AnUploadThatIsCutOff) {
  const std::string good = bytes(dem());
  const std::string length = "Content-Length: " + std::to_string(good.size()) + "\r\n\r\n";
  char chunk[40];
  std::snprintf(chunk, sizeof chunk, "%zx\r\n", good.size());
  for (const std::string& head : {length, "Transfer-Encoding: chunked\r\n\r\n"s + chunk}) {
    const int descriptor = socket(AF_INET, SOCK_STREAM, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(server_.port()));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    ASSERT_EQ(connect(descriptor, reinterpret_cast<sockaddr*>(&address), sizeof address), 0);
    const std::string sent =
        "POST /v1/datasets?name=half.tif HTTP/1.1\r\nHost: 127.0.0.1\r\n" + head + good.substr(0, good.size() / 2);
    ASSERT_EQ(::write(descriptor, sent.data(), sent.size()), static_cast<ssize_t>(sent.size()));
    EXPECT_TRUE(eventually([&] { return !std::filesystem::is_empty(data("incoming")); })) << "the upload should be under way";
    EXPECT_TRUE(get("/v1/datasets")["datasets"].empty());
    close(descriptor);
    nothing_half_made();
  }
  EXPECT_TRUE(get("/v1/datasets")["datasets"].empty());
  EXPECT_TRUE(std::filesystem::is_empty(data("datasets")));
}

/// 40 GB of pixels, of which one block is stored. memory= bounds what the build may take.
TEST_F(BadPosts, AHugeSparseRaster) {
  const Spec spec = huge_sparse(50176);
  const std::string sparse = bytes(spec);
  ASSERT_LT(sparse.size(), std::size_t{4} << 20);
  const auto start = std::chrono::steady_clock::now();
  post({"sparse.tif", sparse, "&memory=768&vertical_datum=ellipsoid", 201, "", ""});
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(400)) << "all 40 GB would take hours";
  // Zeros everywhere, as the request wants it, take hours; but a DELETE ends them.
  const auto posted = client_->Post("/v1/datasets?name=sea.tif&voids=0&memory=768", httplib::Headers{}, sparse, "image/tiff");
  ASSERT_TRUE(posted);
  ASSERT_EQ(posted->status, 202) << posted->body;
  const std::string address = "/v1/datasets/" + std::string(Json::parse(posted->body)["id"]);
  EXPECT_TRUE(eventually([&] { return get(address)["state"] != "queued"; }));
  EXPECT_EQ(get(address)["state"], "running") << get(address).dump();
  const auto deleting = std::chrono::steady_clock::now();
  const auto deleted = client_->Delete(address);
  ASSERT_TRUE(deleted);
  EXPECT_EQ(deleted->status, 204);
  EXPECT_LT(std::chrono::steady_clock::now() - deleting, std::chrono::seconds(150));
  nothing_half_made();
}

TEST_F(BadPosts, TheCollection) {
  const std::string folder = raster_test::real_dems() + "/bad";
  const bool there = !raster_test::real_dems().empty() && std::filesystem::is_directory(folder);
  if (!there) GTEST_SKIP() << "no collection of bad files: set CORDILLERA_TEST_DATA";
  const Row rows[] = {
      {"bigtujunga_cut_900000.tif", "", "", 422, "raster-truncated", ""},
      {"gdal_corrupted_deflate_singlestrip.tif", "", "", 422, "raster-type", "has a colour table"},
      {"gdal_corrupted_deflate_singlestrip.tif", "", "&crs=EPSG:4326", 422, "raster-type", "has a colour table"},
      {"gdal_huge-number-strips.tif", "", "", 422, "raster-too-large", ""},
      {"gdal_huge4GB.tif", "", "", 422, "raster-truncated", ""},
      {"geotools_1x1_neginf_nodata.tif", "", "", 201, "", ""},
      {"geotools_smalldem_no_georef.tif", "", "", 422, "raster-not-georeferenced", ""},
      {"geotools_smalldem_no_georef.tif", "", "&crs=EPSG:4326", 422, "raster-not-georeferenced", ""},
      {"git_lfs_pointer.tif", "", "", 422, "raster-format-unsupported", "Git LFS pointer"},
      {"imagetiff_divide_by_zero_12.tif", "", "", 422, "raster-format-unsupported", ""},
      {"pillow_hopper_photo.tif", "", "", 422, "raster-bands", ""},
      {"rasterio_all-nodata.tif", "", "", 422, "raster-bands", ""},
      {"rasterio_corrupt.tif", "", "", 422, "raster-bands", ""},
      {"sparse_100000x100000_f32.tif", "", "", 422, "raster-all-nodata", ""},
      {"utm_metres_labelled_4326.tif", "", "", 422, "crs-mismatch", ""},
  };
  std::set<std::string> known;
  for (Row row : rows) {
    known.insert(row.name);
    if (!std::filesystem::exists(folder + "/" + row.name)) continue;
    row.body = file_text(folder + "/" + row.name);
    post(row);
  }
  // Files that joined the collection later: a problem of theirs, or tiles, and the service goes on.
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename();
    if (entry.path().extension() != ".tif" || known.count(name) != 0) continue;
    const auto answer = send({name, file_text(entry.path()), "", 0, "", ""});
    ASSERT_TRUE(answer) << name;
    EXPECT_THAT(answer->status, AnyOf(201, 400, 413, 422)) << name << answer->body;
    if (answer->status == 201) ready_.insert(Json::parse(answer->body)["id"]);
    nothing_half_made();
  }
}

}  // namespace
}  // namespace cordillera::server
