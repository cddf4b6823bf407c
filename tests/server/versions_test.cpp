// Addresses that never change, the list of faces, and headers that every answer carries.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "fixture.h"
#include "pipeline/faces/face.h"
#include "server/datasets/ledger.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

class Versions : public testing::Test {
 protected:
  void SetUp() override {
    id_ = body_of(test_.post("GOOD", {}, {{"prefer", "wait=200"}}))["id"];
    base_ = "/v1/datasets/" + id_;
    version_ = body_of(test_.get(base_)).value("version", "");
  }
  TestService test_;
  std::string id_, base_, version_;
};

TEST_F(Versions, TheSameBytesForEver) {
  ASSERT_EQ(version_.size(), 16u);
  EXPECT_EQ(body_of(test_.get(base_))["links"]["version"], base_ + "/versions/" + version_);
  EXPECT_EQ(test_.get(base_ + "/versions/" + version_).body, test_.get(base_ + "/manifest.json").body);
  for (const std::string& path : {std::string("/tiles/1/1/1.drc"), std::string("/tiles/W/1/1/1.glb"),
                                  std::string("/tileset.json"), std::string("/manifest.json")}) {
    const Response plain = test_.get(base_ + path), kept = test_.get(base_ + "/versions/" + version_ + path);
    ASSERT_EQ(kept.status, 200) << path;
    EXPECT_EQ(kept.body, plain.body) << path;
    EXPECT_EQ(kept.header("ETag"), plain.header("ETag")) << path;
    EXPECT_EQ(kept.header("Cache-Control"), "public, max-age=31536000, immutable") << path;
    EXPECT_EQ(plain.header("Cache-Control"), "public, no-cache") << path;
  }
}

/// A cache may forget Vary, and the address may be another tomorrow.
TEST_F(Versions, ADocumentThatHoldsTheServicesAddressIsNotKeptForEver) {
  for (const std::string& version : {std::string(), "/versions/" + version_}) {
    const Response named = test_.get(base_ + version + "/terrain-rgb.json", {{"host", "a"}, {"x-forwarded-host", "b"}});
    ASSERT_EQ(named.status, 200) << named.body;
    EXPECT_THAT(named.body, HasSubstr("http://b/"));
    EXPECT_EQ(named.header("Cache-Control"), "public, no-cache") << version;
    EXPECT_THAT(named.header("Vary"), HasSubstr("X-Forwarded-Host"));
  }
}

TEST_F(Versions, AnotherVersionIsNotThere) {
  const Response answer = test_.get(base_ + "/versions/0123456789abcdef/tileset.json");
  EXPECT_EQ(answer.status, 404);
  EXPECT_EQ(slug_of(answer), "version-unknown");
  EXPECT_EQ(body_of(answer)["accepted"], version_);
  EXPECT_THAT(answer.header("Cache-Control"), HasSubstr("no-store"));
  EXPECT_EQ(slug_of(test_.get(base_ + "/versions/" + version_ + "/events")), "not-found");
  EXPECT_EQ(slug_of(test_.get(base_ + "/versions/0123456789abcdef")), "version-unknown");
  const Response none = test_.get(base_ + "/versions/" + version_ + "/tiles/1/3/1.drc");
  EXPECT_EQ(slug_of(none), "tile-unknown");
  EXPECT_THAT(none.header("Cache-Control"), HasSubstr("no-store")) << "an absence may end with a repaired service";
}

TEST_F(Versions, FacesAreListedWithLinksThatAreRoutes) {
  const Json faces = body_of(test_.get(base_))["faces"];
  ASSERT_EQ(faces.size(), pipeline::faces::all_faces().size());
  for (std::size_t k = 0; k < faces.size(); ++k) {
    const pipeline::faces::Face& face = *pipeline::faces::all_faces()[k];
    EXPECT_EQ(faces[k]["name"], face.name);
    EXPECT_EQ(faces[k]["about"], face.about);
    EXPECT_EQ(faces[k]["href"], base_ + "/" + std::string(face.entry));
    const Response entry = test_.get(faces[k]["href"].get<std::string>());
    EXPECT_NE(entry.status, 404) << face.entry;
    if (entry.status == 200) { EXPECT_EQ(faces[k]["type"], entry.header("Content-Type")); }
    ASSERT_EQ(faces[k]["links"].size(), face.resources.size());
    for (const Json& link : faces[k]["links"]) {
      EXPECT_EQ(link["href"].get<std::string>().rfind(base_ + "/", 0), 0u);
      EXPECT_EQ(link.contains("templated"), link["href"].get<std::string>().find('{') != std::string::npos);
    }
  }
  EXPECT_FALSE(body_of(test_.get("/v1/datasets"))["datasets"][0].contains("faces")) << "a list of datasets stays short";
}

TEST(Ledger, CountsTheChangesThatWaitBehindTheBeginningOfADataset) {
  const TempFolder folder;
  const Layout layout{folder.path()};
  std::filesystem::create_directories(layout.dataset("a"));
  const auto change = [](const std::string& name) {
    proto::SourceChange made;
    made.set_id(name);
    made.set_kind("add");
    made.mutable_source()->set_id(name);
    return made;
  };
  ASSERT_TRUE(updates::begin(layout.dataset("a"), change("first")));
  updates::Ledger ledger(layout);
  const auto add = [&](const std::string& name) {
    return ledger.add("a", change(name), 10, [] { return proto::Result<void>(); }).ok();
  };
  ASSERT_TRUE(ledger.first("a"));
  EXPECT_EQ(ledger.waiting(), 0u);
  ASSERT_TRUE(add("second") && add("third"));
  EXPECT_EQ(ledger.waiting(), 2u);
  updates::Ledger after_a_start(layout);
  ASSERT_TRUE(after_a_start.first("a"));
  EXPECT_EQ(after_a_start.waiting(), 2u);
  for (const char* name : {"first", "second"}) ASSERT_TRUE(ledger.end("a", name, std::nullopt));
  EXPECT_EQ(ledger.waiting(), 1u);
  std::filesystem::remove_all(layout.dataset("a"));
  EXPECT_EQ(ledger.waiting(), 0u);
}

TEST_F(Versions, NothingIsDeletedWhileItsDiskIsAway) {
  const std::filesystem::path away = test_.folder() / "away";
  std::filesystem::rename(test_.data(), away);
  const Response refused = test_.send("DELETE", base_);
  EXPECT_EQ(refused.status, 507);
  EXPECT_EQ(slug_of(refused), "storage-full");
  EXPECT_FALSE(std::filesystem::exists(test_.data()));
  std::filesystem::rename(away, test_.data());
  EXPECT_EQ(test_.get(base_).status, 200);
  EXPECT_EQ(test_.send("DELETE", base_).status, 204);
  EXPECT_EQ(test_.get(base_).status, 404);
}

TEST_F(Versions, TilesSayHowLongTheyTook) {
  const Response tile = test_.get(base_ + "/tiles/1/1/1.drc");
  EXPECT_THAT(tile.header("Server-Timing"), testing::MatchesRegex("make;dur=[0-9]+\\.[0-9]+"));
  EXPECT_EQ(tile.header("Timing-Allow-Origin"), "*");
}

TEST_F(Versions, ErrorsCanBeReadByForeignPages) {
  for (const std::string& path : {std::string("/v1/nothing"), std::string("/v1/datasets/nobody"), base_ + "/tiles/1/3/1.drc",
                                  base_ + "/versions/0/tileset.json", base_ + "/mesh.stl?", std::string("/assets/none.js")}) {
    const Response answer = test_.get(path);
    EXPECT_GE(answer.status, 400) << path;
    EXPECT_EQ(answer.header("Access-Control-Allow-Origin"), "*") << path;
  }
  EXPECT_EQ(test_.send("PATCH", base_).header("Access-Control-Allow-Origin"), "*");
}

TEST_F(Versions, AMeshIsRefusedBeforeItIsMade) {
  const auto refused = [&](const std::string& path, const Given& query) {
    Request request;
    request.path = base_ + path;
    request.query = query;
    return slug_of(test_.api().handle(request));
  };
  EXPECT_EQ(refused("/mesh.glb", {{"levle", "1"}}), "option-unknown");
  EXPECT_EQ(refused("/mesh.glb", {{"level", "x"}}), "option-invalid");
  EXPECT_EQ(refused("/mesh.glb", {{"level", "9"}}), "option-invalid");
  EXPECT_EQ(refused("/mesh.glb", {{"bbox", "1,2,3"}}), "option-invalid");
  EXPECT_EQ(refused("/mesh.glb", {{"tile", "1/9/9"}}), "option-invalid");
  EXPECT_EQ(refused("/mesh.glb", {{"tile", "1/3/1"}}), "tile-unknown");
  EXPECT_EQ(refused("/mesh.glb", {{"tile", "1/1/1"}, {"level", "1"}}), "options-conflict");
  EXPECT_EQ(refused("/mesh.glb", {{"level", "1"}, {"level", "0"}}), "option-repeated");
  EXPECT_EQ(refused("/mesh.stl", {{"frame", "ecef"}}), "options-conflict");
  EXPECT_EQ(refused("/mesh.ply", {{"bbox", "100,1,101,2"}}), "bbox-outside-raster");
  EXPECT_EQ(refused("/mesh.off", {}), "not-found");
  EXPECT_EQ(refused("/mesh.GLB", {}), "not-found");
}

}  // namespace
}  // namespace cordillera::server
