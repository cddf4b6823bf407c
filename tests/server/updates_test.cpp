// Datasets whose rasters change, with the program itself: what clients see before, between and after, and what a kill leaves.
#include <gmock/gmock.h>
#include <httplib.h>

#include <array>
#include <iomanip>
#include <thread>

#include "pipeline/store/store_revise.h"
#include "updates_fixture.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;
using whole::Bytes;

TEST_F(Updates, APatchTouchesWhatItTouchesAndCanBeTakenBack) {
  begin();
  const Bytes first = served();
  whole::expect_same(from_nothing("base.tif\n"), first);
  const Json before = ask("GET", base_).body;
  const Said patched = change("POST", "/sources?name=patch.tif", "patch.tif");
  ASSERT_EQ(patched.status, 201) << patched.bytes;
  EXPECT_EQ(patched.body["state"], "done");
  EXPECT_EQ(patched.body["version"], 2);
  const Bytes second = served();
  whole::expect_same(from_nothing("patch.tif\nbase.tif\n"), second);

  // Who has an untouched tile has it still.
  int same = 0, other = 0;
  for (const auto& [key, bytes] : second) {
    const auto old = first.find(key);
    (old != first.end() && old->second == bytes ? same : other)++;
  }
  EXPECT_GT(same, 2 * other);
  EXPECT_GT(other, 10);
  const Json list = listed();
  ASSERT_EQ(list["sources"].size(), 2u);
  EXPECT_EQ(list["sources"][0]["name"], "patch.tif");
  EXPECT_EQ(list["sources"][0]["columns"], 60);
  EXPECT_EQ(list["sources"][1]["vertical_datum"], "ellipsoid");
  EXPECT_EQ(list["sources"][0]["extent"].size(), 4u);

  // The version before is kept, and whoever began below its address goes on there.
  const std::string old_address = base_ + "/versions/" + before["version"].get<std::string>() + "/tileset.json";
  EXPECT_EQ(ask("GET", old_address).status, 200);
  EXPECT_NE(ask("GET", base_).body["version"], before["version"]);
  const Json versions = ask("GET", base_ + "/versions").body["versions"];
  ASSERT_EQ(versions.size(), 2u);
  EXPECT_EQ(versions[0]["number"], 2);
  EXPECT_EQ(versions[0]["about"], "added patch.tif");
  EXPECT_EQ(versions[1]["version"], before["version"]);

  const Said back = ask("POST", base_ + "/rollback");
  ASSERT_EQ(back.status, 200) << back.bytes;
  EXPECT_EQ(served(), first);
  EXPECT_EQ(ask("GET", base_).body["version"], before["version"]);
  EXPECT_EQ(listed()["sources"].size(), 1u);
  EXPECT_EQ(slug(ask("POST", base_ + "/rollback")), "version-unknown");
  EXPECT_EQ(ask("POST", base_ + "/rollback?to=1").status, 200) << "asked twice for the same";
  // And on from there.
  EXPECT_EQ(change("POST", "/sources?name=patch.tif", "patch.tif").body["version"], 3);
  EXPECT_EQ(served(), second);
}

TEST_F(Updates, TheVersionBeforeIsTheOneThatWasServed) {
  begin({"--keep-versions", "2"});
  const Bytes first = served();
  ASSERT_EQ(change("POST", "/sources?name=patch.tif", "patch.tif").body["version"], 2);
  ASSERT_EQ(change("POST", "/sources?name=other.tif", "other.tif").body["version"], 3);
  ASSERT_EQ(ask("POST", base_ + "/rollback?to=1").status, 200);
  ASSERT_EQ(change("POST", "/sources?name=other.tif", "other.tif").body["version"], 4);
  std::vector<int> numbers;
  const Json kept = ask("GET", base_ + "/versions").body["versions"];
  for (const Json& version : kept) numbers.push_back(version["number"]);
  EXPECT_THAT(numbers, testing::ElementsAre(4, 1, 2));
  const Said back = ask("POST", base_ + "/rollback");
  ASSERT_EQ(back.status, 200) << back.bytes;
  EXPECT_EQ(back.body["versions"][0]["number"], 1) << "the second has the greater number, and was gone when the fourth was made";
  EXPECT_EQ(served(), first);
}

TEST_F(Updates, ARasterWithoutDataIsNamed) {
  begin();
  const Bytes before = served();
  const proto::Lattice lattice{kLevel};
  std::ofstream out(path("void.asc"));
  out << std::setprecision(17) << "ncols 20\nnrows 20\nxllcorner " << lattice.longitude_deg(kWest + 100) << "\nyllcorner "
      << lattice.latitude_deg(kNorth - 100) << "\ncellsize " << lattice.cell_deg() << "\nNODATA_value -9999\n";
  for (int k = 0; k < 400; ++k) out << "-9999 ";
  out.close();
  ASSERT_EQ(change("POST", "/sources?name=void.asc&crs=EPSG:4326", "void.asc").status, 201);
  whole::expect_same(served(), before);
  const Json sources = listed()["sources"];
  EXPECT_EQ(sources[0]["all_void"], true);
  EXPECT_FALSE(sources[1].contains("all_void"));
  EXPECT_THAT(ask("GET", base_).body["notes"].dump(),
              HasSubstr("1 of 2 rasters has no data, which is no height within 16384 m of zero: void.asc"));
  ASSERT_EQ(change("PUT", "/sources/" + source(0) + "?name=patch.tif", "patch.tif").status, 200);
  EXPECT_THAT(ask("GET", base_).body["notes"].dump(), testing::Not(HasSubstr("no data")));
}

TEST_F(Updates, ABoxPassesOverWhatItDoesNotTouch) {
  const proto::Lattice lattice{kLevel};
  char box[160];
  std::snprintf(box, sizeof box, "&updates=1&bbox=%.7f,%.7f,%.7f,%.7f", lattice.longitude_deg(kWest + 200),
                lattice.latitude_deg(kNorth - 500), lattice.longitude_deg(kWest + 500), lattice.latitude_deg(kNorth - 200));
  server_.start(folder_.path(), {});
  post(box);
  const Bytes before = served();
  ASSERT_EQ(change("POST", "/sources?name=other.tif", "other.tif").status, 201);
  whole::expect_same(served(), before);
  const Json sources = listed()["sources"];
  EXPECT_EQ(sources[0]["beside_bbox"], true);
  EXPECT_FALSE(sources[1].contains("beside_bbox"));
  EXPECT_EQ(sources[1]["columns"], 1100);
  const Said none = change("DELETE", "/sources/" + source(1));
  EXPECT_EQ(slug(none), "bbox-outside-raster") << none.bytes;
  EXPECT_THAT(none.bytes, HasSubstr("other.tif")) << "the one that would be left";
}

TEST_F(Updates, DatumsThatDifferAreNoted) {
  begin();
  EXPECT_THAT(ask("GET", base_).body["notes"].dump(), testing::Not(HasSubstr("apart")));
  ASSERT_EQ(change("POST", "/sources?name=again.tif&vertical_datum=EGM96", "base.tif").status, 201);
  const Json status = ask("GET", base_).body, manifest = ask("GET", base_ + "/manifest.json").body;
  EXPECT_THAT(status["notes"].dump(), testing::ContainsRegex("again.tif counts from EGM96 .*base.tif from ellipsoid .* m apart"));
  EXPECT_EQ(manifest["notes"], status["notes"]);
}

TEST_F(Updates, OrderOptionsAndEnds) {
  begin({"--keep-versions", "0"});
  ASSERT_EQ(change("POST", "/sources?name=patch.tif&position=1", "patch.tif").status, 201);
  EXPECT_EQ(listed()["sources"][1]["name"], "patch.tif");
  const std::string patch = source(1);
  EXPECT_EQ(ask("GET", base_ + "/sources/" + patch).body["name"], "patch.tif");
  ASSERT_EQ(change("PUT", "/sources/" + patch + "?position=0&z_offset=25").status, 200);
  whole::expect_same(from_nothing("patch.tif z_offset=25\nbase.tif\n"), served());
  EXPECT_EQ(listed()["sources"][0]["options"]["z_offset"], 25);
  const Said replaced = change("PUT", "/sources/" + patch + "?name=other.tif", "other.tif");
  ASSERT_EQ(replaced.status, 200) << replaced.bytes;
  whole::expect_same(from_nothing("other.tif z_offset=25\nbase.tif\n"), served());
  EXPECT_EQ(ask("GET", base_ + "/versions").body["versions"].size(), 1u) << "none before is kept";
  ASSERT_EQ(change("DELETE", "/sources/" + patch).status, 200);
  whole::expect_same(from_nothing("base.tif\n"), served());
  const Said last = change("DELETE", "/sources/" + source(0));
  EXPECT_EQ(last.status, 409);
  EXPECT_EQ(slug(last), "source-last");
  // What no version names is gone.
  std::size_t rasters = 0;
  for (const auto& entry : std::filesystem::directory_iterator(dataset() / "sources")) rasters += entry.is_regular_file() ? 1 : 0;
  EXPECT_EQ(rasters, 1u);
  EXPECT_FALSE(std::filesystem::exists(dataset() / "next.sqlite"));
}

TEST_F(Updates, AddressesBelowAVersionOutliveATitleAndARaster) {
  begin();
  const std::string first = ask("GET", base_).body["version"];
  ASSERT_EQ(ask("PATCH", base_ + "?title=Hills").status, 200);
  const std::string second = ask("GET", base_).body["version"];
  const auto titled = [&](const std::string& version) {
    return ask("GET", base_ + "/versions/" + version + "/manifest.json").body.value("title", "");
  };
  EXPECT_EQ(titled(first), "t");
  ASSERT_EQ(change("POST", "/sources?name=patch.tif", "patch.tif").status, 201);
  EXPECT_EQ(titled(ask("GET", base_).body["version"]), "Hills");
  EXPECT_EQ(titled(second), "Hills") << "its build did not know of that title";
  EXPECT_EQ(titled(first), "t");
}

TEST_F(Updates, WhatIsWrongChangesNothing) {
  begin();
  const Bytes first = served();
  const Said broken = change("POST", "/sources?name=broken.tif", "broken.tif");
  EXPECT_EQ(broken.status, 422) << broken.bytes;
  EXPECT_THAT(broken.bytes, HasSubstr("broken.tif"));
  EXPECT_EQ(served(), first);
  EXPECT_EQ(ask("GET", base_).body["state"], "ready");
  EXPECT_EQ(listed()["changes"].back()["state"], "failed");
  EXPECT_EQ(slug(change("POST", "/sources?name=patch.tif")), "body-empty");
  EXPECT_EQ(slug(change("POST", "/sources?name=patch.tif&position=first", "patch.tif")), "option-invalid");
  EXPECT_EQ(slug(change("POST", "/sources?error=3", "patch.tif")), "option-unknown");
  EXPECT_EQ(slug(change("POST", "/sources?crs=/etc/passwd", "patch.tif")), "option-forbidden");
  EXPECT_EQ(slug(change("POST", "/sources?source=http://127.0.0.1/dem.tif")), "option-forbidden") << "nobody allowed it";
  std::ofstream(path("words")) << R"({"source": "https://example.org/dem.tif"})";
  for (const char* type : {"application/json", "application/x-www-form-urlencoded"}) {
    const Said words = change("POST", "/sources?name=patch.tif", "words", {{"Content-Type", type}});
    EXPECT_EQ(words.status, 415) << words.bytes;
    EXPECT_THAT(words.bytes, HasSubstr("source=ADDRESS or upload=ID in the query")) << type;
  }
  EXPECT_EQ(slug(change("PUT", "/sources/nobody", "patch.tif")), "source-unknown");
  const Said nothing = change("PUT", "/sources/" + source(0));
  EXPECT_EQ(nothing.status, 400) << nothing.bytes;
  EXPECT_THAT(nothing.bytes, HasSubstr("nothing is to change"));
  EXPECT_EQ(slug(change("DELETE", "/sources/nobody")), "source-unknown");
  EXPECT_EQ(ask("POST", base_ + "/rollback?to=7").status, 404);
  EXPECT_EQ(slug(ask("POST", base_ + "/rollback?to=1&to=2")), "option-repeated");
  EXPECT_EQ(slug(ask("POST", base_ + "/rollback?from=1")), "option-unknown");
  // A key is for one request.
  const httplib::Headers key = {{"Idempotency-Key", "k1"}};
  const Said once = change("POST", "/sources?name=patch.tif", "patch.tif", key),
             again = change("POST", "/sources?name=patch.tif", "patch.tif", key);
  ASSERT_EQ(once.status, 201) << once.bytes;
  EXPECT_EQ(again.body["id"], once.body["id"]);
  EXPECT_EQ(listed()["sources"].size(), 2u);
  EXPECT_EQ(slug(change("POST", "/sources?name=patch.tif", "other.tif", key)), "idempotency-key-reused");
  EXPECT_EQ(slug(change("POST", "/sources?name=other.tif", "other.tif", key)), "idempotency-key-reused");
  post("");
  EXPECT_EQ(slug(change("POST", "/sources?name=patch.tif", "patch.tif")), "dataset-fixed");
  EXPECT_EQ(listed()["sources"].size(), 1u);
}

TEST_F(Updates, ADatasetThatFailedSaysWhyItCannotBeChanged) {
  server_.start(folder_.path(), {});
  const Said posted = ask("POST", "/v1/datasets?name=broken.tif&updates=1", "broken.tif", {{"Prefer", "wait=300"}});
  ASSERT_EQ(posted.status, 422) << posted.bytes;
  base_ = "/v1/datasets/" + std::string(ask("GET", "/v1/datasets").body["datasets"][0]["id"]);
  ASSERT_EQ(ask("GET", base_).body["state"], "failed");
  const Said said = change("POST", "/sources?name=patch.tif", "patch.tif");
  EXPECT_EQ(said.status, 409);
  EXPECT_EQ(slug(said), "dataset-failed");
  EXPECT_THAT(said.bytes, HasSubstr("broken.tif"));
}

TEST_F(Updates, AnAddressIsFetchedWithinTheOperatorsList) {
  httplib::Server files;
  files.Get("/dems/patch.tif", [&](const httplib::Request&, httplib::Response& answer) {
    answer.set_content(file_text(path("patch.tif")), "image/tiff");
  });
  files.Get("/dems/near.tif", [](const httplib::Request&, httplib::Response& answer) { answer.set_redirect("/dems/patch.tif"); });
  files.Get("/dems/far.tif",
            [](const httplib::Request&, httplib::Response& answer) { answer.set_redirect("/private/patch.tif"); });
  files.Get("/dems/deep/beside.tif",
            [](const httplib::Request&, httplib::Response& answer) { answer.set_redirect("./../deep/ok.tif"); });
  files.Get("/dems/deep/ok.tif", [&](const httplib::Request&, httplib::Response& answer) {
    answer.set_content(file_text(path("patch.tif")), "image/tiff");
  });
  files.Get("/dems/deep/dots.tif",
            [](const httplib::Request&, httplib::Response& answer) { answer.set_redirect("../../private/patch.tif?x"); });
  const int port = files.bind_to_any_port("127.0.0.1");
  std::thread serving([&] { files.listen_after_bind(); });
  const std::string host = "http://127.0.0.1:" + std::to_string(port);
  begin({"--source-allow", host + "/dems/"});
  const Said near = change("POST", "/sources?source=" + host + "/dems/near.tif");
  EXPECT_EQ(near.status, 201) << near.bytes;
  whole::expect_same(from_nothing("patch.tif\nbase.tif\n"), served());
  EXPECT_EQ(listed()["sources"][0]["name"], "near.tif");
  EXPECT_EQ(slug(change("POST", "/sources?source=" + host + "/dems/far.tif")), "option-forbidden");
  EXPECT_EQ(slug(change("POST", "/sources?source=" + host + "/dems/none.tif")), "source-unreachable");
  EXPECT_EQ(slug(change("POST", "/sources?source=" + host + "/dems/../private/patch.tif")), "option-forbidden");
  EXPECT_EQ(slug(change("POST", "/sources?source=" + host + "/private/patch.tif")), "option-forbidden");
  EXPECT_EQ(slug(change("POST", "/sources?source=file:///etc/passwd")), "option-forbidden");
  EXPECT_EQ(slug(change("POST", "/sources?source=" + host + "/dems/pat%FFch.tif")),
            "option-forbidden");  // no text: not to be read as patch.tif
  EXPECT_EQ(slug(change("POST", "/sources?source=" + host + "/dems/deep/dots.tif")), "option-forbidden");
  EXPECT_EQ(listed()["sources"].size(), 2u);
  const Said beside = change("PUT", "/sources/" + source(0) + "?source=" + host + "/dems/deep/beside.tif%3Fa%3Db");
  EXPECT_EQ(beside.status, 200) << beside.bytes;
  EXPECT_EQ(listed()["sources"][0]["source"], host + "/dems/deep/beside.tif");
  files.stop();
  serving.join();
}

TEST_F(Updates, ASeaThatComesLaterStaysLandAndIsNoted) {
  whole::write(whole::points_of({kLevel, kWest + 200, kNorth - 200}, 700, 700, [](int, int) { return 0.0; }), path("sea.tif"));
  server_.start(folder_.path(), {});
  const Said posted =
      ask("POST", "/v1/datasets?name=base.tif&updates=1&error=60&max_level=12", "base.tif", {{"Prefer", "wait=300"}});
  ASSERT_EQ(posted.status, 201) << posted.bytes;
  base_ = "/v1/datasets/" + posted.body["id"].get<std::string>();
  const auto notes = [&] { return ask("GET", base_).body["notes"].dump(); };
  EXPECT_THAT(notes(), testing::Not(HasSubstr("still water")));
  ASSERT_EQ(change("POST", "/sources?name=sea.tif", "sea.tif").status, 201);
  EXPECT_THAT(notes(), HasSubstr("still water of exactly 0 m is land here"));
  EXPECT_EQ(ask("GET", base_ + "/manifest.json").body["options"].value("water", Json()), Json());
  ASSERT_EQ(change("DELETE", "/sources/" + source(0)).status, 200);
  EXPECT_THAT(notes(), testing::Not(HasSubstr("still water")));
}

TEST_F(Updates, KilledAtAnyInstantTheOldOrTheNewVersionIsServed) {
  begin();
  const Bytes first = served(), second = from_nothing("patch.tif\nbase.tif\n");
  const std::string version = ask("GET", base_).body["version"];
  const auto ended = [&] { return ask("GET", base_).body["updates"]["pending"] == 0; };
  // How long it takes where nothing is in the way: the instants lie within that.
  ASSERT_EQ(ask("POST", base_ + "/sources?name=patch.tif", "patch.tif").status, 202);
  const auto start = std::chrono::steady_clock::now();
  ASSERT_TRUE(eventually(ended));
  const auto whole = std::chrono::steady_clock::now() - start;
  ASSERT_EQ(ask("POST", base_ + "/rollback").status, 200);
  for (const int percent : {0, 10, 25, 50, 75, 95}) {
    SCOPED_TRACE(percent);
    ASSERT_EQ(ask("POST", base_ + "/sources?name=patch.tif", "patch.tif").status, 202);
    std::this_thread::sleep_for(whole * percent / 100);
    server_.end(SIGKILL);
    const Bytes left = served();
    EXPECT_TRUE(left == first || left == second);
    server_.start(folder_.path());
    // What was answered with 202 goes on by itself.
    EXPECT_TRUE(eventually(ended));
    EXPECT_EQ(served(), second);
    ASSERT_EQ(ask("POST", base_ + "/rollback").status, 200);
    EXPECT_EQ(ask("GET", base_).body["version"], version);
    EXPECT_EQ(served(), first);
  }
}

}  // namespace
}  // namespace cordillera::server
