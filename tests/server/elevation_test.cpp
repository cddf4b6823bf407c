// Elevation queries and raster faces over HTTP, on the shipped sample as it is really built.
#include <gdal_priv.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "built_sample.h"
#include "raster/place/geodesic.h"
#include "server/api/requests/elevation_query.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;
using testing::Not;

using Query = std::vector<std::pair<std::string, std::string>>;

Response get(const std::string& path, const Query& query = {}, const std::map<std::string, std::string>& headers = {}) {
  Request request;
  request.path = built().base() + "/" + path;
  request.query = query;
  request.headers = headers;
  return built().api().handle(request);
}
Response post(const std::string& body, const Query& query = {}, const std::string& type = "application/json") {
  Request request;
  request.method = "POST";
  request.path = built().base() + "/elevation";
  request.query = query;
  request.headers = {{"content-type", type}};
  request.read_body = [body](const Request::Sink& sink) {
    for (std::size_t i = 0; i < body.size(); i += 1000) {
      if (!sink(std::string_view(body).substr(i, 1000))) return false;
    }
    return true;
  };
  return built().api().handle(request);
}
Response options(const std::string& path) {
  Request request;
  request.method = "OPTIONS";
  request.path = built().base() + "/" + path;
  return built().api().handle(request);
}

/// The raster's own pixels, by GDAL.
struct Pixels {
  int columns = 0, rows = 0;
  double corner[6] = {};
  std::vector<double> height;

  std::size_t index(int row, int column) const {
    return static_cast<std::size_t>(row) * static_cast<std::size_t>(columns) + static_cast<std::size_t>(column);
  }
  double longitude_deg(int column) const { return corner[0] + (column + 0.5) * corner[1]; }
  double latitude_deg(int row) const { return corner[3] + (row + 0.5) * corner[5]; }

  Pixels() {
    GDALAllRegister();
    auto* file = GDALDataset::FromHandle(GDALOpen(kRaster.c_str(), GA_ReadOnly));
    columns = file->GetRasterXSize();
    rows = file->GetRasterYSize();
    file->GetGeoTransform(corner);
    height.resize(index(rows, 0));
    GDALRasterBand* band = file->GetRasterBand(1);
    EXPECT_EQ(band->RasterIO(GF_Read, 0, 0, columns, rows, height.data(), columns, rows, GDT_Float64, 0, 0), CE_None);
    GDALClose(GDALDataset::ToHandle(file));
  }
};

TEST(Elevation, HeightsAreTheRastersWithinTheStatedError) {
  const Pixels pixels;
  const double resampling = body_of(get("manifest.json"))["source"]["error_at_pixels"]["max"];
  Json body;
  std::vector<double> expected;
  for (int row = 5; row < pixels.rows - 5; row += 17) {
    for (int column = 5; column < pixels.columns - 5; column += 23) {
      body["points"].push_back({pixels.longitude_deg(column), pixels.latitude_deg(row)});
      expected.push_back(pixels.height[pixels.index(row, column)]);
    }
  }
  const Response response = post(body.dump());
  ASSERT_EQ(response.status, 200) << response.body;
  const Json json = body_of(response);
  EXPECT_EQ(json["geoid"], "EGM96");
  const double stated = json["stated_max_error"];
  EXPECT_LE(stated, 4);
  ASSERT_EQ(json["points"].size(), expected.size());
  ASSERT_GT(expected.size(), 1000u);
  for (std::size_t k = 0; k < expected.size(); ++k) {
    const Json& point = json["points"][k];
    EXPECT_EQ(point["lon"], body["points"][k][0]) << "in the order that was asked";
    const double orthometric = point["orthometric_height"], ellipsoidal = point["ellipsoidal_height"];
    EXPECT_NEAR(orthometric, expected[k], stated + 1.5 * resampling + 0.001) << k;
    EXPECT_NEAR(orthometric - ellipsoidal, 28, 2) << "the geoid lies 26 to 30 m below the ellipsoid here";
  }
}

TEST(Elevation, PointsOfAQuery) {
  const Json json = body_of(get("elevation", {{"points", "-71.3033,44.2706;-71.5,44.3;10,50"}}));
  ASSERT_EQ(json["points"].size(), 3u);
  EXPECT_NEAR(json["points"][0]["orthometric_height"].get<double>(), 1900, 30) << "Mount Washington: 1917 m, its pixel less";
  EXPECT_TRUE(json["points"][2]["ellipsoidal_height"].is_null() && json["points"][2]["orthometric_height"].is_null());
  EXPECT_FALSE(json["points"][0].contains("distance"));
  const Json manifest = body_of(get("manifest.json"));
  EXPECT_EQ(json["level"], manifest["max_level"]);
  const Json coarse = body_of(get("elevation", {{"points", "-71.3033,44.2706"}, {"level", "5"}}));
  EXPECT_EQ(coarse["level"], 5);
  EXPECT_GT(coarse["stated_max_error"], 10 * json["stated_max_error"].get<double>());
  const double far = coarse["points"][0]["ellipsoidal_height"], near = json["points"][0]["ellipsoidal_height"];
  EXPECT_NE(far, near);
  EXPECT_NEAR(far, near, coarse["stated_max_error"].get<double>() + 2);
}

TEST(Elevation, ALineIsSampledAlongItsGeodesics) {
  const Json json = body_of(get("elevation", {{"line", "-71.5,44.2;-71.3,44.2;-71.3,44.4"}, {"samples", "51"}}));
  ASSERT_EQ(json["points"].size(), 51u);
  // 0.2 degrees of the parallel of 44.2 degrees, and of a meridian there; textbook radii.
  EXPECT_NEAR(json["length"].get<double>(), 15990.7 + 22221, 10);
  for (std::size_t k = 0; k < 51; ++k) {
    EXPECT_NEAR(json["points"][k]["distance"].get<double>(), json["length"].get<double>() * static_cast<double>(k) / 50, 0.002);
    EXPECT_TRUE(json["points"][k]["orthometric_height"].is_number());
  }
  EXPECT_EQ(json["points"][0]["lon"], -71.5);
  EXPECT_EQ(json["points"][50]["lat"], 44.4);
  const Json own = body_of(get("elevation", {{"line", "-71.5,44.2;-71.3,44.2;-71.3,44.4"}}));
  ASSERT_EQ(own["points"].size(), 3u) << "without samples: the line's own points";
  EXPECT_EQ(own["length"], json["length"]);
}

TEST(Elevation, GeodesicsCrossTheAntimeridian) {
  const std::vector<raster::LinePoint> line = {{179.5, 0}, {-179.5, 0}};
  const auto places = raster::along_geodesics(line, 5);
  ASSERT_EQ(places.size(), 5u);
  EXPECT_NEAR(places[4].distance_m, 111319.4908, 1e-3) << "a degree of the equator";
  EXPECT_NEAR(std::abs(places[2].longitude_deg), 180, 1e-9);
  EXPECT_NEAR(places[3].longitude_deg, -179.75, 1e-9);
  const auto still = raster::along_geodesics(std::vector<raster::LinePoint>{{7, 46}, {7, 46}}, 3);
  EXPECT_NEAR(still[1].latitude_deg, 46, 1e-12);
}

TEST(Elevation, BodiesMayBeGeoJson) {
  const std::string pair = "[[-71.5,44.3],[-71.4,44.3,999]]";
  const Json points = body_of(post(R"({"points":)" + pair + "}"));
  EXPECT_EQ(points["points"].size(), 2u);
  const std::string several = R"({"type":"MultiPoint","coordinates":)" + pair + "}";
  for (const std::string& body : {several, R"({"type":"Feature","properties":{},"geometry":)" + several + "}"}) {
    EXPECT_EQ(body_of(post(body)), points) << body;
  }
  for (const std::string& body : {R"({"type":"LineString","coordinates":)" + pair + "}", R"({"line":)" + pair + "}"}) {
    const Json line = body_of(post(body));
    EXPECT_EQ(line["points"][1]["ellipsoidal_height"], points["points"][1]["ellipsoidal_height"]) << body;
    EXPECT_GT(line["points"][1]["distance"], 7000);
    EXPECT_EQ(body_of(post(body, {{"samples", "9"}}))["points"].size(), 9u);
  }
  EXPECT_EQ(body_of(post(R"({"type":"Point","coordinates":[-71.5,44.3]})"))["points"][0], points["points"][0]);
  const Json from_curl = body_of(post(R"({"points":)" + pair + "}", {{"level", "5"}}, "application/x-www-form-urlencoded"));
  EXPECT_EQ(from_curl["level"], 5) << "curl -d says that it is a form";
  for (const char* level : {"+5", " 5"})
    EXPECT_EQ(body_of(post(R"({"points":)" + pair + "}", {{"level", level}}))["level"], 5) << "as mesh.glb reads it";
}

TEST(Elevation, BadInputIsNamed) {
  struct Case {
    Query query;
    std::string slug, parameter;
  };
  for (const Case& c : std::vector<Case>{
           {{}, "option-invalid", "points"},
           {{{"points", ""}}, "option-invalid", "points"},
           {{{"points", "7,46;"}}, "option-invalid", "points"},
           {{{"points", "7;46"}}, "option-invalid", "points"},
           {{{"points", "181,46"}}, "option-invalid", "points"},
           {{{"points", "7,-90.1"}}, "option-invalid", "points"},
           {{{"points", "7,nan"}}, "option-invalid", "points"},
           {{{"points", "inf,7"}}, "option-invalid", "points"},
           {{{"points", "7,46x"}}, "option-invalid", "points"},
           {{{"points", "7,46,500"}}, "option-invalid", "points"},
           {{{"line", "7,46;8"}}, "option-invalid", "line"},
           {{{"points", "7,46"}, {"line", "7,46;8,46"}}, "options-conflict", "points"},
           {{{"points", "7,46"}, {"points", "8,46"}}, "option-repeated", "points"},
           {{{"points", "7,46"}, {"samples", "5"}}, "options-conflict", "samples"},
           {{{"line", "7,46"}, {"samples", "5"}}, "options-conflict", "samples"},
           {{{"line", "7,46;8,46"}, {"samples", "1"}}, "option-invalid", "samples"},
           {{{"line", "7,46;8,46"}, {"samples", "5001"}}, "option-invalid", "samples"},
           {{{"line", "7,46;8,46"}, {"samples", "-3"}}, "option-invalid", "samples"},
           {{{"points", "7,46"}, {"level", "40"}}, "option-invalid", "level"},
           {{{"points", "7,46"}, {"level", "fine"}}, "option-invalid", "level"},
           {{{"points", "7,46"}, {"level", "-1"}}, "option-invalid", "level"},
           {{{"points", "7,46"}, {"level", "5"}, {"level", "5"}}, "option-repeated", "level"},
           {{{"points", "7,46"}, {"format", "csv"}}, "option-unknown", "format"},
       }) {
    const Response response = get("elevation", c.query);
    EXPECT_EQ(response.status, 400) << response.body;
    EXPECT_EQ(slug_of(response), c.slug) << response.body;
    EXPECT_EQ(body_of(response)["parameter"], c.parameter) << response.body;
    EXPECT_FALSE(body_of(response)["accepted"].get<std::string>().empty());
    EXPECT_EQ(response.header("Access-Control-Allow-Origin"), "*");
  }
  std::string many = "7,46";
  for (int k = 0; k < 5000; ++k) many += ";7,46";
  EXPECT_EQ(slug_of(get("elevation", {{"points", many}})), "option-invalid");
}

TEST(Elevation, BadBodiesAreNamed) {
  for (const char* body :
       {"", "[]", "{}", "points", R"({"points":[]})", R"({"points":[[1]]})", R"({"points":[["7","46"]]})",
        R"({"points":[[7,91]]})", R"({"points":{"a":1}})", R"({"points":[[7,46]],"level":5})",
        R"({"type":"Polygon","coordinates":[]})", R"({"type":"Point"})", R"({"type":7})", R"({"type":"Feature","geometry":null})",
        R"({"type":"Feature","geometry":{"type":"Feature"}})", R"({"type":"MultiPoint","coordinates":[[7,1e999]]})"}) {
    const Response response = post(body);
    EXPECT_EQ(response.status, 400) << body;
    EXPECT_EQ(slug_of(response), "json-invalid") << body;
  }
  EXPECT_EQ(slug_of(post(R"({"points":[[7,46]]})", {{"points", "7,46"}})), "options-conflict");
  EXPECT_EQ(slug_of(post("--x", {}, "multipart/form-data; boundary=x")), "json-invalid");
  EXPECT_EQ(post(std::string(kMostQueryBytes + 1, ' ')).status, 413);
}

TEST(Elevation, ABodyMayNestAsDeepAsGeoJsonDoesAndNoDeeper) {
  const auto nested = [](std::size_t levels) { return std::string(levels, '[') + std::string(levels, ']'); };
  const std::string place = R"("geometry":{"type":"Point","coordinates":[-71.3,44.27]}})";
  EXPECT_EQ(post(R"({"type":"Feature","properties":{"a":)" + nested(32) + "}," + place).status, 200);
  const std::size_t many = kMostQueryBytes / 2 - 100;  // as many as a body has room for
  for (const std::string& body :
       {R"({"points":[)" + nested(many) + "]}", R"({"type":"Feature","properties":{"a":)" + nested(many) + "}," + place,
        R"({"points":)" + std::string(2 * many, '['), R"({"type":)" + nested(kMostNested + 1) + "}"}) {
    EXPECT_EQ(slug_of(post(body)), "json-invalid") << body.substr(0, 40);
  }
}

/// An object looks through its members for each one that is added: a body has room for 100,000 of them.
TEST(Elevation, ABodyMayHaveMembersOfWhichFewAreCompared) {
  const auto with = [](int members) {
    std::string body = R"({"type":"Feature","geometry":{"type":"Point","coordinates":[-71.3,44.27]},"properties":{)";
    for (int k = 0; k < members; ++k) body += (k == 0 ? "\"" : ",\"") + std::to_string(k) + "\":1";
    return body + "}}";
  };
  EXPECT_EQ(post(with(9900)).status, 200);
  const Response refused = post(with(10100));
  EXPECT_EQ(refused.status, 400);
  EXPECT_EQ(slug_of(refused), "json-invalid");
  EXPECT_THAT(refused.body, HasSubstr("10,000 members"));
  EXPECT_EQ(slug_of(post(with(90000))), "json-invalid");
}

TEST(Elevation, AForeignPageMayAskByPostAndNothingElse) {
  const Response preflight = options("elevation");
  EXPECT_EQ(preflight.status, 204);
  EXPECT_EQ(preflight.header("Allow"), "GET, HEAD, POST, OPTIONS");
  EXPECT_THAT(preflight.header("Access-Control-Allow-Methods"), HasSubstr("POST"));
  EXPECT_THAT(preflight.header("Access-Control-Allow-Headers"), HasSubstr("Content-Type"));
  Request request;
  request.method = "OPTIONS";
  request.path = "/v1/datasets";
  EXPECT_THAT(built().api().handle(request).header("Access-Control-Allow-Methods"), Not(HasSubstr("POST")));
  EXPECT_THAT(options("manifest.json").header("Access-Control-Allow-Headers"), Not(HasSubstr("Content-Type")));
  request.method = "PUT";
  request.path = built().base() + "/elevation";
  const Response refused = built().api().handle(request);
  EXPECT_EQ(refused.status, 405);
  EXPECT_EQ(refused.header("Allow"), "GET, HEAD, POST, OPTIONS");
}

TEST(Elevation, AnUnchangedAnswerCostsA304AndAPostIsNotKept) {
  const Query query = {{"points", "-71.3,44.3"}};
  const std::string etag = get("elevation", query).header("ETag");
  EXPECT_EQ(get("elevation", query, {{"if-none-match", etag}}).status, 304);
  const Response posted = post(R"({"points":[[-71.3,44.3]]})");
  EXPECT_EQ(posted.header("ETag"), "");
  EXPECT_EQ(posted.header("Cache-Control"), "no-store");
  Request unknown;
  unknown.path = "/v1/datasets/none/elevation";
  EXPECT_EQ(slug_of(built().api().handle(unknown)), "dataset-unknown");
}

TEST(RasterFaces, TileTemplatesAreAbsoluteWhereTheClientNamedAHost) {
  const std::string path = built().base() + "/terrain-rgb/{z}/{x}/{y}.png";
  const auto tiles = [](const std::map<std::string, std::string>& headers) {
    return body_of(get("terrain-rgb.json", {}, headers))["tiles"][0].get<std::string>();
  };
  EXPECT_EQ(tiles({}), "terrain-rgb/{z}/{x}/{y}.png");
  EXPECT_EQ(tiles({{"host", "127.0.0.1:8080"}}), "http://127.0.0.1:8080" + path);
  EXPECT_EQ(tiles({{"host", "[::1]:80"}}), "http://[::1]:80" + path);
  EXPECT_EQ(tiles({{"host", "inside"},
                   {"x-forwarded-host", "maps.example.org, inside"},
                   {"x-forwarded-proto", "https"},
                   {"x-forwarded-prefix", "/terrain/"}}),
            "https://maps.example.org/terrain" + path);
  EXPECT_EQ(tiles({{"host", "inside"},
                   {"x-forwarded-host", "<script>"},
                   {"x-forwarded-proto", "javascript"},
                   {"x-forwarded-prefix", "\"'/x"}}),
            "http://inside" + path);
  const Response a = get("terrain-rgb.json", {}, {{"host", "a"}}), b = get("terrain-rgb.json", {}, {{"host", "b"}});
  EXPECT_NE(a.header("ETag"), b.header("ETag"));
  EXPECT_EQ(get("terrain-rgb.json", {}, {{"host", "a"}, {"if-none-match", a.header("ETag")}}).status, 304);
  EXPECT_EQ(get("terrain-rgb.json", {}, {{"host", "b"}, {"if-none-match", a.header("ETag")}}).status, 200);
  const Response unchanged = get("terrain-rgb.json", {}, {{"host", "a"}, {"if-none-match", a.header("ETag")}});
  std::string vary;
  for (const auto& [name, value] : unchanged.headers) vary += name == "Vary" ? value + ", " : "";
  EXPECT_EQ(vary, "X-Forwarded-Proto, X-Forwarded-Host, X-Forwarded-Prefix, Accept-Encoding, ")
      << "a 304 names what the 200 does";
}

// A document that nobody has made has such a tag only here: who has it gets a 304, so nothing was made for the answer.
TEST(RasterFaces, WhatAClientHasIsNotMadeAgain) {
  for (const char* path : {"terrain-rgb/0/0/0.png", "hillshade/0/0/0.png", "terrain/0/0/0.terrain"}) {
    const std::string etag = get(path).header("ETag");
    ASSERT_GT(etag.size(), 10u) << path;
    const Response unchanged = get(path, {}, {{"if-none-match", etag}});
    EXPECT_EQ(unchanged.status, 304) << path;
    EXPECT_EQ(unchanged.header("ETag"), etag) << path;
    EXPECT_EQ(get(path, {}, {{"if-none-match", "\"other\""}}).status, 200) << path;
  }
  const std::string id = built().base().substr(built().base().rfind('/') + 1);
  const auto terrain = built().service().library().open(id);
  ASSERT_TRUE(terrain.ok());
  (*terrain)->note_tag("terrarium/1/0/0.png???", "0123456789abcdef");
  EXPECT_EQ(get("terrarium/1/0/0.png", {}, {{"if-none-match", "\"0123456789abcdef\""}}).status, 304);
  EXPECT_EQ(get("terrarium/1/0/0.png", {{"ramp", "x"}}, {{"if-none-match", "\"0123456789abcdef\""}}).status, 304)
      << "a picture of heights has no ramp";
  EXPECT_EQ(get("terrarium/1/1/0.png", {}, {{"if-none-match", "\"0123456789abcdef\""}}).status, 404) << "another tile";
}

TEST(RasterFaces, OutsideTheDataHeightsAreRefusedAndPicturesAreEmpty) {
  const Response heights = get("terrain-rgb/5/0/0.png"), picture = get("hillshade/5/0/0.png");
  EXPECT_EQ(heights.status, 404);
  EXPECT_EQ(slug_of(heights), "tile-unknown");
  EXPECT_THAT(std::string(body_of(heights)["accepted"]), HasSubstr("zooms 0 to"));
  EXPECT_EQ(picture.status, 204);
  EXPECT_EQ(picture.bytes(), "");
  EXPECT_EQ(picture.header("Access-Control-Allow-Origin"), "*");
  EXPECT_EQ(get("hillshade/30/0/0.png").status, 204);
  EXPECT_EQ(get("terrain-rgb/0/0/0.png").header("Content-Type"), "image/png");
  EXPECT_EQ(get("terrarium/0/0/0.webp").header("Content-Type"), "image/webp");
}

}  // namespace
}  // namespace cordillera::server
