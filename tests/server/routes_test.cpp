#include "server/api/requests/routes.h"

#include <gtest/gtest.h>

#include "server/datasets/upload.h"
#include "server/http/json.h"
#include "server/http/problems.h"

namespace cordillera::server {
namespace {

TEST(Routes, WhatAFaceKnowsIsAFaces) {
  const Route drc = parse_route("/v1/datasets/alps-1/tiles/9/270/401.drc");
  EXPECT_EQ(drc.endpoint, Endpoint::face);
  EXPECT_EQ(drc.id, "alps-1");
  EXPECT_EQ(drc.path, "tiles/9/270/401.drc");
  EXPECT_EQ(drc.found.resource->path, "tiles/{z}/{x}/{y}.drc");
  EXPECT_EQ(drc.found.place.y, 401);
}

TEST(Routes, TheRestIsFound) {
  EXPECT_EQ(parse_route("/v1").endpoint, Endpoint::index);
  EXPECT_EQ(parse_route("/v1/datasets").endpoint, Endpoint::datasets);
  EXPECT_EQ(parse_route("/v1/datasets/a").endpoint, Endpoint::dataset);
  EXPECT_EQ(parse_route("/v1/datasets/a/events").endpoint, Endpoint::events);
  EXPECT_EQ(parse_route("/v1/datasets/a/manifest.json").endpoint, Endpoint::manifest);
  EXPECT_EQ(parse_route("/v1/datasets/a/demo/leaflet.html").endpoint, Endpoint::demo);
  EXPECT_EQ(parse_route("/v1/datasets/a/tileset.json").endpoint, Endpoint::face);
  EXPECT_EQ(parse_route("/healthz").endpoint, Endpoint::health);
  EXPECT_EQ(parse_route("/readyz").endpoint, Endpoint::readiness);
  EXPECT_EQ(parse_route("/").endpoint, Endpoint::page);
  EXPECT_EQ(parse_route("/assets/viewer.js").endpoint, Endpoint::page);
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
    EXPECT_EQ(parse_route(path).endpoint, Endpoint::none) << path;
  }
}

TEST(Problems, OneTableGivesStatusAndTitle) {
  EXPECT_EQ(problem_kind("dataset-unknown").status, 404);
  EXPECT_EQ(problem_kind("body-too-large").status, 413);
  const ProblemKind unknown = problem_kind("raster-not-georeferenced");
  EXPECT_EQ(unknown.status, 422);
  EXPECT_EQ(unknown.title, "Raster not georeferenced");
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
    EXPECT_EQ(parse_route("/v1/datasets/" + make_id(name)).endpoint, Endpoint::dataset) << name;
  }
  EXPECT_EQ(suffix_of("N44W072.HGT"), ".hgt");
  EXPECT_EQ(suffix_of("a/../x.t/f"), "");
  EXPECT_EQ(suffix_of("noext"), "");
}

}  // namespace
}  // namespace cordillera::server
