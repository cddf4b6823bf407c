#include "server/api/requests/routes.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <sstream>

#include "fixture.h"
#include "server/datasets/upload.h"
#include "server/http/json.h"
#include "server/http/problems.h"

namespace cordillera::server {
namespace {

TEST(Routes, WhatAFaceKnowsIsAFaces) {
  const Route drc = parse_route("/v1/datasets/alps-1/tiles/9/270/401.drc");
  EXPECT_EQ(drc.row->path, "/v1/datasets/{id}/{resource}");
  EXPECT_EQ(route_name(drc), "drc");
  EXPECT_EQ(drc.id, "alps-1");
  EXPECT_EQ(drc.path, "tiles/9/270/401.drc");
  EXPECT_EQ(drc.found.resource->path, "tiles/{z}/{x}/{y}.drc");
  EXPECT_EQ(drc.found.place.y, 401);
}

TEST(Routes, TheRestIsFound) {
  const auto found = [](const char* path) { return parse_route(path).row->path; };
  EXPECT_EQ(found("/v1"), "/v1");
  EXPECT_EQ(found("/v1/datasets"), "/v1/datasets");
  EXPECT_EQ(found("/v1/datasets/a"), "/v1/datasets/{id}");
  EXPECT_EQ(found("/v1/datasets/a/events"), "/v1/datasets/{id}/events");
  EXPECT_EQ(found("/v1/datasets/a/manifest.json"), "/v1/datasets/{id}/manifest.json");
  EXPECT_EQ(found("/v1/datasets/a/demo/leaflet.html"), "/v1/datasets/{id}/demo/{client}.html");
  EXPECT_EQ(found("/v1/datasets/a/tileset.json"), "/v1/datasets/{id}/{resource}");
  EXPECT_EQ(found("/healthz"), "/healthz");
  EXPECT_EQ(found("/readyz"), "/readyz");
  EXPECT_EQ(found("/v1/datasets/a.pmtiles"), "/v1/datasets/{id}.pmtiles");
  EXPECT_EQ(found("/v1/datasets/a/versions/b/mesh.glb"), "/v1/datasets/{id}/mesh.{mesh_format}");
  EXPECT_EQ(found("/v1/live/tileset.json"), "/v1/live");
  EXPECT_EQ(found("/"), "/");
  EXPECT_EQ(found("/assets/viewer.js"), "/");
  EXPECT_EQ(parse_route("/v1/datasets/a/sources/b").item, "b");
  EXPECT_EQ(parse_route("/v1/datasets/a/versions/b/manifest.json").version, "b");
  for (const char* itself : {"/v1/datasets/a/versions/b", "/v1/datasets/a/versions/b/"}) {
    EXPECT_EQ(parse_route(itself).version, "b") << itself;
    EXPECT_EQ(found(itself), found("/v1/datasets/a/versions/b/manifest.json")) << itself;
  }
}

TEST(Routes, WrongSpellingsAreNothing) {
  for (const char* path : {"",
                           "v1",
                           "/v1/",
                           "/v1/other",
                           "/v1/datasets/",
                           "/v1/datasets/..",
                           "/v1/datasets/A",
                           "/v1/datasets/a b",
                           "/v1/datasets/a/",
                           "/v1/datasets/a/b",
                           "/v1/datasets/a/demo/",
                           "/v1/datasets/a/demo/.html",
                           "/v1/datasets/a/demo/../../x.html",
                           "/v1/datasets/a/versions/b/demo/leaflet.html",
                           "/v1/datasets/a/versions/b.pmtiles",
                           "/v1/datasets/a/versions/b/events",
                           "/v1/datasets/a.pmtiles/x",
                           "/v1/datasets/a.tif",
                           "/v1/live/sources",
                           "/v1/lives",
                           "/stac/other",
                           "/v1/datasets/a/tiles",
                           "/v1/datasets/a/tiles/1/2/3",
                           "/v1/datasets/a/tiles/1/2/3.png",
                           "/v1/datasets/a/tiles/1/2/.drc",
                           "/v1/datasets/a/tiles/01/2/3.drc",
                           "/v1/datasets/a/tiles/-1/2/3.drc",
                           "/v1/datasets/a/tiles/1/2/99999999999.drc",
                           "/v1/datasets/a/tiles/1/2/3/4.drc",
                           "/v1/datasets/a/tiles/1/2/3.drc/",
                           "/v1/datasets/a/tiles/N/1/2/3.drc",
                           "/v1/datasets/a/subtrees/1/2/3.subtree",
                           "/v1/datasets/a/subtrees/W/1/2/3.json"}) {
    EXPECT_EQ(parse_route(path).row, nullptr) << path;
  }
}

/// Rows of the page's table, without what they answer: "| `/v1/uploads` | `POST` (write) |".
std::vector<std::string> rows_of_the_page() {
  std::istringstream page(file_text(std::filesystem::path(CORDILLERA_SOURCE_DIR) / "docs" / "reference" / "api.md"));
  std::vector<std::string> rows;
  bool here = false;
  for (std::string line; std::getline(page, line);) {
    if (line.starts_with("## ")) here = line == "## Resources";
    if (here && line.starts_with("| `")) rows.push_back(line.substr(0, line.find('|', line.find('|', 1) + 1) + 1));
  }
  return rows;
}

TEST(Routes, ThePageListsThem) {
  std::vector<std::string> rows;
  for (const RouteRow& row : route_table()) {
    std::string methods;
    for (const RouteMethod& method : row.methods) {
      methods.append(methods.empty() ? "`" : ", `").append(method.name).append("`");
      if (method.needs != access::Role::none) methods.append(" (").append(access::to_string(method.needs)).append(")");
    }
    rows.push_back("| `" + std::string(row.path) + "` | " + methods + " |");
  }
  EXPECT_EQ(rows_of_the_page(), rows);
}

TEST(Routes, EveryRowIsReachedAndHasMethodsInOrder) {
  constexpr std::pair<std::string_view, std::string_view> kValues[] = {
      {"{id}", "a"}, {"{source}", "b"}, {"{client}", "c"}, {"{mesh_format}", "glb"}, {"{resource}", "tileset.json"}};
  const std::vector<std::string> order = {"GET", "POST", "PUT", "PATCH", "DELETE"};  // of Allow
  for (const RouteRow& row : route_table()) {
    ASSERT_FALSE(row.methods.empty()) << row.path;
    std::size_t last = 0;
    for (const RouteMethod& method : row.methods) {
      const auto at = static_cast<std::size_t>(std::find(order.begin(), order.end(), method.name) - order.begin());
      EXPECT_TRUE(at < order.size() && at >= last) << row.path;
      last = at + 1;
    }
    std::string path(row.path);
    for (const auto& [brace, value] : kValues) {
      if (const auto place = path.find(brace); place != path.npos) path.replace(place, brace.size(), value);
    }
    EXPECT_EQ(parse_route(path).row, &row) << path;
  }
}

TEST(Routes, TellRolesAndAllow) {
  const Route metrics = parse_route("/metrics"), heights = parse_route("/v1/datasets/a/elevation"),
              one = parse_route("/v1/datasets/a"), nothing = parse_route("/v1/nothing");
  EXPECT_EQ(role_needed("HEAD", metrics), access::Role::read);
  EXPECT_EQ(role_needed("OPTIONS", metrics), access::Role::none) << "a page that asks whether it may shows no token";
  EXPECT_EQ(role_needed("OPTIONS", one), access::Role::none);
  EXPECT_EQ(role_needed("POST", metrics), access::Role::write);
  EXPECT_EQ(role_needed("POST", heights), access::Role::none);
  EXPECT_EQ(role_needed("GET", one), access::Role::none);
  EXPECT_EQ(role_needed("DELETE", one), access::Role::write);
  EXPECT_EQ(role_needed("POST", nothing), access::Role::write);
  EXPECT_EQ(allowed_methods(one), "GET, HEAD, PATCH, DELETE, OPTIONS");
  EXPECT_EQ(allowed_methods(parse_route("/v1/uploads")), "POST, OPTIONS");
  EXPECT_EQ(allowed_methods(nothing), "GET, HEAD, OPTIONS");
}

TEST(Problems, OneTableGivesStatusAndTitle) {
  EXPECT_EQ(problem_kind("dataset-unknown").status, 404);
  EXPECT_EQ(problem_kind("body-too-large").status, 413);
  const ProblemKind unknown = problem_kind("raster-not-georeferenced");
  EXPECT_EQ(unknown.status, 422);
  EXPECT_EQ(unknown.title, "The raster does not say where it lies");
  EXPECT_EQ(problem_kind("usage").title, "That line is not understood") << "of a command alone";
  EXPECT_EQ(problem_kind("store-missing").title, "Store missing");
}

TEST(Problems, TheDocumentIsWhatRfc9457Says) {
  const Response response = problem_response({"option-invalid", "error='x': not a number", "metres", "error"});
  EXPECT_EQ(response.status, 400);
  EXPECT_EQ(response.header("Content-Type"), "application/problem+json");
  const Json json = Json::parse(response.body);
  EXPECT_EQ(json["type"], "urn:cordillera:problem:option-invalid");
  EXPECT_EQ(json["status"], 400);
  EXPECT_EQ(json["parameter"], "error");
  EXPECT_EQ(json["accepted"], "metres");
}

TEST(Ids, AreReadableAndSafe) {
  EXPECT_EQ(make_id("Mont Blanc (2020).TIF").substr(0, 16), "mont-blanc-2020-");
  EXPECT_NE(make_id("a.tif"), make_id("a.tif"));
  for (const char* name : {"", "../../etc/passwd", "名前", "/", "----", "x\"<>&"}) {
    const Route route = parse_route("/v1/datasets/" + make_id(name));
    ASSERT_NE(route.row, nullptr) << name;
    EXPECT_EQ(route.row->path, "/v1/datasets/{id}") << name;
  }
  EXPECT_EQ(suffix_of("N44W072.HGT"), ".hgt");
  EXPECT_EQ(suffix_of("a/../x.t/f"), "");
  EXPECT_EQ(suffix_of("noext"), "");
}

}  // namespace
}  // namespace cordillera::server
