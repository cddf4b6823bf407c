// Requests that change a dataset's rasters: those that race, that come twice, and that are taken back.
#include <gmock/gmock.h>
#include <httplib.h>

#include <array>
#include <atomic>
#include <thread>

#include "updates_fixture.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;
using whole::Bytes;

/// Gives patch.tif once it is told to.
class SlowHost {
 public:
  explicit SlowHost(const std::string& raster) {
    files_.Get("/patch.tif", [this, raster](const httplib::Request&, httplib::Response& answer) {
      eventually([&] { return given_.load(); });
      answer.set_content(file_text(raster), "image/tiff");
    });
    address_ = "http://127.0.0.1:" + std::to_string(files_.bind_to_any_port("127.0.0.1")) + "/patch.tif";
    serving_ = std::thread([this] { files_.listen_after_bind(); });
  }
  ~SlowHost() {
    give();
    files_.stop();
    serving_.join();
  }
  const std::string& address() const { return address_; }
  void give() { given_ = true; }

 private:
  httplib::Server files_;
  std::atomic<bool> given_{false};
  std::string address_;
  std::thread serving_;
};

TEST_F(Updates, TwoWhoReadTheSameRasterDoNotBothChangeIt) {
  SlowHost host(path("patch.tif"));
  begin({"--source-allow", host.address()});
  const std::string one = base_ + "/sources/" + source(0);
  const Said read = ask("GET", one);
  EXPECT_EQ(read.body.value("changes", Json()), Json::array());
  const httplib::Headers as_read = {{"If-Match", read.etag}};
  const std::string first = one + "?z_offset=1&source=" + host.address();
  httplib::Headers keyed = as_read;
  keyed.emplace("Idempotency-Key", "first");
  const Said accepted = ask("PUT", first, "", keyed);
  ASSERT_EQ(accepted.status, 202) << accepted.bytes;
  const Said waiting = ask("GET", one);
  EXPECT_NE(waiting.etag, read.etag) << "it waits to be changed";
  EXPECT_THAT(waiting.body.value("changes", Json()).dump(), HasSubstr(accepted.body["id"].get<std::string>()));
  EXPECT_EQ(slug(ask("PUT", one + "?z_offset=2", "", as_read)), "precondition-failed");
  EXPECT_EQ(slug(ask("DELETE", one, "", as_read)), "precondition-failed");
  EXPECT_EQ(ask("PUT", first, "", keyed).body["id"], accepted.body["id"]) << "whoever was cut off is told what came of it";
  const Said second = ask("PUT", one + "?z_offset=2", "", {{"If-Match", waiting.etag}});
  EXPECT_EQ(second.status, 202) << second.bytes;
  host.give();
  EXPECT_TRUE(eventually([&] { return ask("GET", base_).body["updates"]["pending"] == 0; }));
  EXPECT_EQ(ask("GET", one).body["options"]["z_offset"], 2);
  EXPECT_EQ(ask("GET", base_ + "/versions").body["versions"][0]["number"], 3);
}

TEST_F(Updates, WhoComesWithTheSameTagAtTheSameTimeIsTold) {
  begin();
  const httplib::Headers as_read = {{"If-Match", ask("GET", base_ + "/sources").etag}};
  std::vector<std::thread> senders;
  std::array<int, 6> statuses{};
  for (int& status : statuses)
    senders.emplace_back([&] { status = ask("POST", base_ + "/sources?name=patch.tif", "patch.tif", as_read).status; });
  for (std::thread& sender : senders) sender.join();
  EXPECT_THAT(statuses, testing::Contains(202).Times(1));
  EXPECT_THAT(statuses, testing::Contains(412).Times(static_cast<int>(statuses.size()) - 1));
}

TEST_F(Updates, WhoGoesBackWithTheSameTagAtTheSameTimeIsTold) {
  begin({"--keep-versions", "5"});
  for (const char* name : {"patch.tif", "other.tif"})
    ASSERT_EQ(change("POST", std::string("/sources?name=") + name, name).status, 201);
  const httplib::Headers as_read = {{"If-Match", ask("GET", base_ + "/versions").etag}};
  std::vector<std::thread> senders;
  std::array<int, 6> statuses{};
  for (int& status : statuses) senders.emplace_back([&] { status = ask("POST", base_ + "/rollback", "", as_read).status; });
  for (std::thread& sender : senders) sender.join();
  EXPECT_THAT(statuses, testing::Contains(200).Times(1));
  EXPECT_THAT(statuses, testing::Contains(412).Times(static_cast<int>(statuses.size()) - 1));
  EXPECT_EQ(ask("GET", base_ + "/versions").body["versions"][0]["number"], 2);
}

TEST_F(Updates, ARequestWithAKeyIsDoneOnce) {
  begin({"--keep-versions", "5"});
  for (const char* name : {"patch.tif", "other.tif"})
    ASSERT_EQ(change("POST", std::string("/sources?name=") + name, name).status, 201);
  const httplib::Headers key = {{"Idempotency-Key", "back"}}, removing = {{"Idempotency-Key", "removing"}};
  const auto names = [&] {
    const Json rasters = listed()["sources"];
    std::vector<std::string> all;
    for (const Json& one : rasters) all.push_back(one["name"]);
    return all;
  };
  for (int sent = 0; sent < 2; ++sent) {
    EXPECT_EQ(ask("POST", base_ + "/rollback", "", key).status, 200) << sent;
    EXPECT_THAT(names(), testing::ElementsAre("patch.tif", "base.tif")) << sent;
  }
  EXPECT_EQ(slug(ask("POST", base_ + "/rollback?to=1", "", key)), "idempotency-key-reused");
  EXPECT_EQ(slug(change("PUT", "/sources/" + source(0) + "?z_offset=1", "", key)), "idempotency-key-reused");
  const std::string gone = source(0);
  const Said removed = change("DELETE", "/sources/" + gone, "", removing);
  ASSERT_EQ(removed.status, 200) << removed.bytes;
  EXPECT_EQ(change("DELETE", "/sources/" + gone, "", removing).body, removed.body);
  EXPECT_EQ(slug(change("DELETE", "/sources/" + gone)), "source-unknown");
  EXPECT_EQ(slug(ask("POST", base_ + "/rollback", "", removing)), "idempotency-key-reused");
  EXPECT_EQ(ask("POST", base_ + "/rollback", "", key).status, 200);
  EXPECT_THAT(names(), testing::ElementsAre("base.tif")) << "that was done before the raster was removed";
}

TEST_F(Updates, AnUploadHasTheNameThatItWasBegunWith) {
  begin();
  const std::string raster = file_text(path("patch.tif"));
  const auto upload = [&] {
    httplib::Client client(server_.base());
    const auto begun =
        client.Post("/v1/uploads",
                    {{"Upload-Length", std::to_string(raster.size())}, {"Upload-Metadata", "filename dG9sZC50aWY="}},  // told.tif
                    "", "");
    const std::string place = begun->get_header_value("Location"), id = place.substr(place.rfind('/') + 1);
    EXPECT_EQ(client.Patch("/v1/uploads/" + id, {{"Upload-Offset", "0"}}, raster, "application/offset+octet-stream")->status,
              204);
    return id;
  };
  ASSERT_EQ(change("POST", "/sources?upload=" + upload()).status, 201);
  EXPECT_EQ(listed()["sources"][0]["name"], "told.tif");
  ASSERT_EQ(change("PUT", "/sources/" + source(1) + "?upload=" + upload()).status, 200);
  EXPECT_EQ(listed()["sources"][1]["name"], "told.tif");
  ASSERT_EQ(change("POST", "/sources?name=called.tif&upload=" + upload()).status, 201);
  EXPECT_EQ(listed()["sources"][0]["name"], "called.tif");
}

TEST_F(Updates, ARasterThatDoesNotFitCanBeTakenBack) {
  SlowHost host(path("patch.tif"));
  begin({"--source-allow", host.address()});
  const Bytes first = served();
  ASSERT_EQ(ask("POST", base_ + "/sources?source=" + host.address()).status, 202);
  // From here on no clearing up after the first version takes away what lies there.
  const std::filesystem::path store = dataset() / "next.sqlite";
  std::filesystem::create_directories(store / "in the way");
  host.give();
  EXPECT_TRUE(eventually([&] { return listed()["changes"].back()["error"].is_object(); }));
  const Json added = listed()["changes"].back();
  EXPECT_EQ(added["state"], "pending") << added;
  const Said removed = change("DELETE", "/sources/" + added["source"].get<std::string>());
  EXPECT_EQ(removed.status, 200) << removed.bytes;
  EXPECT_EQ(removed.body.value("version", 0), 1) << "which stays";
  EXPECT_EQ(served(), first);
  const Json changes = listed()["changes"];
  EXPECT_EQ(changes[1]["state"], "done") << changes;
  EXPECT_EQ(changes[2]["state"], "failed") << changes;
  EXPECT_EQ(changes[2]["error"], added["error"]);
  EXPECT_TRUE(eventually([&] { return !std::filesystem::exists(store); })) << "the clearing up takes it away";
  // What comes behind it is done as ever.
  ASSERT_EQ(change("POST", "/sources?name=other.tif", "other.tif").status, 201);
  whole::expect_same(from_nothing("other.tif\nbase.tif\n"), served());
}

}  // namespace
}  // namespace cordillera::server
