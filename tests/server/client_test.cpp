// post, watch and fetch against a real server: what breaks on the way, and what comes through all the same.
#include <gmock/gmock.h>

#include <fstream>

#include "cutting_proxy.h"
#include "program_fixture.h"
#include "server/client/events.h"
#include "server/client/service_address.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;

/// The program beside the test; killed with its owner.
class Background {
 public:
  Background(const std::vector<std::string>& words, const fs::path& output) {
    std::vector<std::string> all = {kProgram};
    all.insert(all.end(), words.begin(), words.end());
    std::vector<char*> arguments;
    for (std::string& word : all) arguments.push_back(word.data());
    arguments.push_back(nullptr);
    process_ = fork();
    if (process_ != 0) return;
    end_with_owner();
    (void)freopen(output.c_str(), "w", stdout);
    (void)freopen(output.c_str(), "a", stderr);
    execv(kProgram.c_str(), arguments.data());
    _exit(127);
  }
  ~Background() { end(SIGKILL); }
  Background(const Background&) = delete;
  Background& operator=(const Background&) = delete;
  int end(int signal) {
    if (process_ > 0) kill(process_, signal);
    return wait();
  }
  /// The exit code, -1 after a signal.
  int wait() {
    int status = 0;
    if (process_ > 0) waitpid(std::exchange(process_, -1), &status, 0);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  }

 private:
  pid_t process_ = -1;
};

/// Bytes of the one upload in the folder that the service has noted; 0: none.
std::uint64_t kept_of_upload(const fs::path& uploads) {
  for (const auto& entry : fs::directory_iterator(uploads)) {
    const Json note = Json::parse(file_text(entry.path() / "upload.json"), nullptr, false);
    if (note.is_object()) return note.value("offset", std::uint64_t{0});
  }
  return 0;
}

class Client : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    setenv("XDG_STATE_HOME", (folder_.path() / "state").c_str(), 1);
    // Larger than what sockets hold, so that a cut has a middle; numbers of many digits take little to build.
    large_ = (folder_.path() / "groß.asc").string();
    std::ofstream grid(large_);
    grid << "ncols 300\nnrows 300\nxllcorner 10\nyllcorner 46\ncellsize 0.0033333333333333\nNODATA_value -9999\n";
    for (int k = 0; k < 300 * 300; ++k)
      grid << 100 + k % 300 << ".0000000000000000000000000000000000000000000000000000000001" << (k % 300 == 299 ? '\n' : ' ');
  }
  void TearDown() override {
    for (const char* name : {"XDG_STATE_HOME", "CORDILLERA_SERVER", "CORDILLERA_TOKEN"}) unsetenv(name);
  }
  Ended client(const std::string& words, const std::string& server = "") {
    return shell(kProgram + " " + words + " --server " + (server.empty() ? server_.base() : server));
  }
  /// The last line of what was said.
  static Json json(const Ended& ended) {
    const std::string text = ended.output.substr(0, ended.output.find_last_not_of('\n') + 1);
    return Json::parse(text.substr(text.rfind('\n') + 1), nullptr, false);
  }
  std::string post(const std::string& words) {
    const Ended ended = client("post -q --json --wait " + words);
    EXPECT_EQ(ended.code, 0) << ended.output;
    return json(ended).value("id", "");
  }
  std::vector<std::string> parts(const CuttingProxy& proxy) const {
    return {"post",    large_, "--resume", "--updates", "--json",           "-q",        "--max-level", "8",
            "--error", "50",   "--crs",    "EPSG:4326", "--vertical-datum", "ellipsoid", "--server",    proxy.base()};
  }
  /// What came of a raster that was posted with --updates.
  std::string raster_of(const std::string& id) const {
    std::string text;
    for (const auto& entry : fs::directory_iterator(folder_.path() / "data" / "datasets" / id / "sources"))
      text += file_text(entry.path());
    return text;
  }
  std::size_t files_in(const fs::path& folder) const {
    std::size_t count = 0;
    if (fs::exists(folder)) {
      for (const auto& entry : fs::recursive_directory_iterator(folder)) count += entry.is_regular_file() ? 1 : 0;
    }
    return count;
  }
  static constexpr const char* kFlat = " --crs EPSG:4326 --vertical-datum ellipsoid --max-level 9 ";

  std::string large_;
};

TEST(ServiceAddress, ATokenInClearTextIsWarnedOfUnlessItStaysOnThisMachine) {
  const auto warned = [](const std::string& server) {
    testing::internal::CaptureStderr();
    EXPECT_TRUE(client::find_service({server, "cdl_token", ""}).ok()) << server;
    return testing::internal::GetCapturedStderr().find("unencrypted") != std::string::npos;
  };
  for (const char* here : {"http://127.0.0.1", "http://127.8.9.10:8080/terrain", "http://localhost:8080", "http://LocalHost",
                           "http://terrain.localhost:8080", "http://[::1]:8080", "http://[::1]"})
    EXPECT_FALSE(warned(here)) << here;
  for (const char* away : {"http://127.evil.org", "http://127.0.0.1.evil.org:8080", "http://localhost.evil.org",
                           "http://notlocalhost", "http://[::1].evil.org", "http://[::2]:8080", "http://10.0.0.1/127.0.0.1",
                           "http://evil.org//127.0.0.1", "http://evil.org//localhost", "http://1127.0.0.1", "http://127.0.0.256"})
    EXPECT_TRUE(warned(away)) << away;
  EXPECT_FALSE(warned("https://evil.org"));
  EXPECT_FALSE(client::find_service({"http://127.0.0.1@evil.org", "cdl_token", ""}).ok());
}

TEST_F(Client, PostsWatchesAndFetches) {
  start_server();
  fs::copy_file(raster_, folder_.path() / "Höhe & Straße.asc");
  const Ended posted = client("post '" + (folder_.path() / "Höhe & Straße.asc").string() + "' --wait --title 'a=b&c'" + kFlat);
  ASSERT_EQ(posted.code, 0) << posted.output;
  const auto at = posted.output.find("id        ");
  const std::string id = posted.output.substr(at + 10, posted.output.find('\n', at) - at - 10);
  EXPECT_THAT(posted.output, HasSubstr(server_.base() + "/v1/datasets/" + id));
  EXPECT_EQ(client("watch " + id).code, 0);
  const Json manifest = Json::parse(client("fetch " + id + " manifest").output, nullptr, false);
  EXPECT_EQ(manifest["name"], "Höhe & Straße.asc");
  EXPECT_EQ(manifest["title"], "a=b&c");

  const std::string out = (folder_.path() / "out").string();
  const Ended named = client("fetch " + id + " -o " + out + ".zip");
  EXPECT_EQ(named.code, 2);
  EXPECT_THAT(named.output, HasSubstr(out + ".zip/ is one"));
  EXPECT_FALSE(fs::exists(out + ".zip"));
  const Json all = json(client("fetch " + id + " --json -o " + out));
  EXPECT_EQ(all["fetched"], manifest["tiles"]) << all.dump();
  const Ended middle = client("fetch " + id + " --middle -o " + out + "/middle/");
  EXPECT_EQ(middle.code, 0) << middle.output;
  const std::string address = middle.output.substr(0, middle.output.find('\n'));
  EXPECT_EQ(shell(kProgram + " decode " + out + "/middle/" + address).code, 0);
  EXPECT_EQ(file_text(out + "/" + address), file_text(out + "/middle/" + address));
  EXPECT_EQ(json(client("fetch " + id + " --json --level 0 --format glb -o " + out))["fetched"], 1);
  EXPECT_EQ(client("fetch " + id + " --format terrain -q -o " + out).code, 0);
  const Json layer = Json::parse(client("fetch " + id + " layer.json").output, nullptr, false);
  for (std::size_t z = 0; z < layer["available"].size(); ++z) {
    for (const Json& range : layer["available"][z]) {
      for (long x = range["startX"]; x <= range["endX"]; ++x) {
        for (long y = range["startY"]; y <= range["endY"]; ++y)
          EXPECT_TRUE(
              fs::exists(out + "/terrain/" + std::to_string(z) + "/" + std::to_string(x) + "/" + std::to_string(y) + ".terrain"));
      }
    }
  }
  const Ended missing = client("fetch " + id + " 9/0/0.drc -o " + out + "/no.drc");
  EXPECT_EQ(missing.code, 1);
  EXPECT_THAT(missing.output, HasSubstr("No such tile"));
  EXPECT_FALSE(fs::exists(out + "/no.drc")) << "nothing that was not there";
}

TEST_F(Client, WhatHasNotChangedDoesNotComeAgain) {
  start_server();
  const std::string id = post(raster_ + kFlat), out = (folder_.path() / "out").string(),
                    line = "fetch " + id + " --json -o " + out;
  const Json first = json(client(line)), second = json(client(line));
  ASSERT_GT(first["fetched"], 3) << first.dump();
  EXPECT_EQ(second["unchanged"], first["fetched"]);
  EXPECT_EQ(second["bytes"], 0);
  EXPECT_THAT(server_.log(), HasSubstr("status=304")) << "the server was asked with the tag";
  // What somebody wrote to is fetched again, and so is what is gone.
  std::vector<fs::path> tiles;
  for (const auto& entry : fs::recursive_directory_iterator(out + "/tiles")) {
    if (entry.is_regular_file()) tiles.push_back(entry.path());
  }
  const std::string before = file_text(tiles[0]);
  std::ofstream(tiles[0], std::ios::app) << "x";
  fs::remove(tiles[1]);
  const Json third = json(client(line));
  EXPECT_EQ(third["fetched"], 2) << third.dump();
  EXPECT_EQ(file_text(tiles[0]), before);
  // Another dataset in the same place is not taken for this one.
  const std::string other = post(raster_ + kFlat + "--error 77");
  EXPECT_EQ(json(client("fetch " + other + " --json -o " + out))["unchanged"], 0);
}

TEST_F(Client, AFetchThatBreaksLeavesNothingHalf) {
  start_server();
  const std::string id = post(raster_ + kFlat), out = (folder_.path() / "out").string();
  CuttingProxy proxy(server_.port());
  proxy.after(300, CuttingProxy::After::cut);  // in a request
  const Ended cut = client("fetch " + id + " --json -q --connections 1 -o " + out, proxy.base());
  EXPECT_EQ(cut.code, 0) << cut.output;
  EXPECT_EQ(proxy.cuts(), 1) << "the test cuts nothing";
  server_.end(SIGKILL);
  const Ended gone = client("fetch " + id + " --middle -o " + out + "/new/", "http://127.0.0.1:1");
  EXPECT_EQ(gone.code, 75) << gone.output;
  EXPECT_THAT(gone.output, HasSubstr("no service answers"));
  for (const auto& entry : fs::recursive_directory_iterator(out)) EXPECT_NE(entry.path().extension(), ".part") << entry.path();
  EXPECT_EQ(files_in(out + "/new/tiles"), 0u);
}

TEST_F(Client, AnUploadThatIsCutGoesOnWhereItWas) {
  start_server();
  CuttingProxy proxy(server_.port());
  const auto size = static_cast<long>(fs::file_size(large_));
  proxy.after(size / 2, CuttingProxy::After::cut);
  const fs::path said = folder_.path() / "said";
  Background posting(parts(proxy), said);
  EXPECT_EQ(posting.wait(), 0) << file_text(said);
  EXPECT_EQ(proxy.cuts(), 1);
  EXPECT_LT(proxy.handed_on(), size * 3 / 2) << "all of it was sent again";
  const std::string id = Json::parse(file_text(said), nullptr, false).value("id", "");
  EXPECT_EQ(client("watch -q " + id).code, 0);
  EXPECT_EQ(raster_of(id), file_text(large_));
  EXPECT_EQ(files_in(folder_.path() / "state"), 0u) << "a note that nobody needs";
}

TEST_F(Client, AKilledClientsUploadGoesOnWithTheSameLine) {
  start_server();
  CuttingProxy proxy(server_.port());
  const auto size = static_cast<long>(fs::file_size(large_));
  proxy.after(size / 2, CuttingProxy::After::hold);
  const fs::path said = folder_.path() / "said";
  {
    Background posting(parts(proxy), said);
    ASSERT_TRUE(eventually([&] { return proxy.reached(); })) << file_text(said);
    const Ended second = client("post -q --resume " + large_ + kFlat, proxy.base());
    EXPECT_EQ(second.code, 75) << second.output;
    EXPECT_THAT(second.output, HasSubstr("another process is sending"));
    posting.end(SIGKILL);
  }
  EXPECT_EQ(files_in(folder_.path() / "state"), 1u);
  proxy.without_end();
  EXPECT_TRUE(eventually([&] { return kept_of_upload(folder_.path() / "data" / "uploads") > 0; })) << "the service sees the end";
  Background again(parts(proxy), said);
  EXPECT_EQ(again.wait(), 0) << file_text(said);
  EXPECT_LT(proxy.handed_on(), size * 3 / 2) << "all of it was sent again";
  const std::string id = Json::parse(file_text(said), nullptr, false).value("id", "");
  EXPECT_EQ(client("watch -q " + id).code, 0);
  EXPECT_EQ(raster_of(id), file_text(large_));
  EXPECT_EQ(files_in(folder_.path() / "data" / "uploads"), 0u) << "one upload, and it became the dataset";
}

TEST_F(Client, ARasterThatWasWrittenToMeanwhileIsSentAnew) {
  start_server();
  CuttingProxy proxy(server_.port());
  proxy.after(static_cast<long>(fs::file_size(large_)) / 2, CuttingProxy::After::hold);
  const fs::path said = folder_.path() / "said";
  {
    Background posting(parts(proxy), said);
    ASSERT_TRUE(eventually([&] { return proxy.reached(); })) << file_text(said);
    posting.end(SIGKILL);
  }
  // The same size and the same time of writing.
  const auto written = fs::last_write_time(large_);
  std::fstream(large_, std::ios::in | std::ios::out) << "ncols 300\nnrows 300\nxllcorner 11";
  fs::last_write_time(large_, written);
  proxy.without_end();
  Background again(parts(proxy), said);
  EXPECT_EQ(again.wait(), 0) << file_text(said);
  const std::string id = Json::parse(file_text(said), nullptr, false).value("id", "");
  EXPECT_EQ(client("watch -q " + id).code, 0);
  EXPECT_EQ(raster_of(id), file_text(large_));
  EXPECT_EQ(files_in(folder_.path() / "data" / "uploads"), 0u) << "the upload of the old bytes stays";
}

TEST_F(Client, AServerMayBeKilledAndStartedAgainMeanwhile) {
  start_server();
  CuttingProxy proxy(server_.port());
  proxy.after(static_cast<long>(fs::file_size(large_)) / 2, CuttingProxy::After::hold);
  const fs::path said = folder_.path() / "said";
  Background posting(parts(proxy), said);
  ASSERT_TRUE(eventually([&] { return proxy.reached(); })) << file_text(said);
  server_.end(SIGKILL);
  start_server();
  proxy.lead_to(server_.port());
  proxy.without_end();
  EXPECT_EQ(posting.wait(), 0) << file_text(said);
  const std::string text = file_text(said);
  const std::string id =
      Json::parse(text.substr(text.rfind('{') == text.npos ? 0 : text.find('{')), nullptr, false).value("id", "");
  EXPECT_EQ(client("watch -q " + id).code, 0) << text;
  EXPECT_EQ(raster_of(id), file_text(large_));
}

TEST_F(Client, ASmallPostWhoseAnswerIsLostMakesOneDataset) {
  start_server();
  CuttingProxy proxy(server_.port());
  proxy.after(static_cast<long>(fs::file_size(raster_)),
              CuttingProxy::After::cut);  // the head is before it, so the end of the body is missing
  const Ended ended = client("post -q --json " + raster_ + kFlat, proxy.base());
  EXPECT_EQ(ended.code, 0) << ended.output;
  EXPECT_EQ(proxy.cuts(), 1);
  EXPECT_EQ(curl(server_.base() + "/v1/datasets")["datasets"].size(), 1u);
}

TEST_F(Client, SeveralRastersBecomeOneDataset) {
  start_server();
  fs::copy_file(raster_, folder_.path() / "second.asc");
  const std::string id = post(raster_ + " " + (folder_.path() / "second.asc").string() + kFlat);
  const Json sources = curl(server_.base() + "/v1/datasets/" + id + "/sources")["sources"];
  ASSERT_EQ(sources.size(), 2u) << sources.dump();
  EXPECT_EQ(sources[0]["name"], "cone.asc") << "the one that wins is first";
  EXPECT_EQ(sources[1]["name"], "second.asc");
}

TEST_F(Client, OfSeveralRastersTheFinestDecidesTheLevels) {
  start_server();
  const auto grid = [&](const char* name, double west, double cell) {
    const std::string path = (folder_.path() / name).string();
    std::ofstream text(path);
    text << "ncols 24\nnrows 24\nxllcorner " << west << "\nyllcorner 46\ncellsize " << cell << "\n";
    for (int k = 0; k < 24 * 24; ++k) text << 100 + k % 24 << (k % 24 == 23 ? '\n' : ' ');
    return path;
  };
  const std::string rasters =
                        grid("coarse.asc", 10, 0.04) + " " + grid("finest.asc", 11, 0.01) + " " + grid("last.asc", 12, 0.02),
                    plain = " --crs EPSG:4326 --vertical-datum ellipsoid ";
  const std::string id = post(rasters + plain);
  const Json sources = curl(server_.base() + "/v1/datasets/" + id + "/sources")["sources"];
  ASSERT_EQ(sources.size(), 3u) << sources.dump();
  for (const auto& [k, name] : {std::pair{0, "coarse.asc"}, {1, "finest.asc"}, {2, "last.asc"}})
    EXPECT_EQ(sources[static_cast<std::size_t>(k)]["name"], name);
  const std::string built = (folder_.path() / "built.sqlite").string();
  const Ended ended =
      shell(kProgram + " build -q " + rasters + plain + " -o " + built + " && " + kProgram + " info --json " + built);
  ASSERT_EQ(ended.code, 0) << ended.output;
  const Json manifest = Json::parse(ended.output, nullptr, false);
  EXPECT_EQ(curl(server_.base() + "/v1/datasets/" + id + "/manifest.json")["max_level"], manifest["max_level"]);
}

TEST_F(Client, WhatFailsIsTold) {
  start_server();
  std::ofstream(folder_.path() / "bad.tif") << "no raster";
  const Ended posted = client("post -q --json " + (folder_.path() / "bad.tif").string());
  ASSERT_EQ(posted.code, 0) << posted.output;
  const std::string id = json(posted)["id"];
  const Ended watched = client("watch " + id);
  EXPECT_EQ(watched.code, 1);
  EXPECT_THAT(watched.output,
              HasSubstr("The raster's format is not read\n  bad.tif is text, not a raster; it begins \"no raster\"\n"
                        "  accepted: "));
  const Json told = json(client("watch -q --json " + id));
  EXPECT_EQ(told["type"], "urn:cordillera:problem:raster-format-unsupported");
  EXPECT_EQ(told["status"], 422);
  EXPECT_FALSE(json(client("post -q --json /no/such.tif")).contains("status")) << "no service was asked";
  const Ended waited = client("post -q --json --wait " + (folder_.path() / "bad.tif").string());
  EXPECT_EQ(waited.code, 1);
  EXPECT_EQ(json(waited)["state"], "failed") << "and the id is told: " << waited.output;
  EXPECT_EQ(client("watch nosuch-dataset").code, 1);
  EXPECT_EQ(client("post /no/such.tif").code, 1);
  EXPECT_EQ(client("post --error x " + raster_).code, 2);
  EXPECT_EQ(client("post " + raster_, "ftp://127.0.0.1").code, 2);
  EXPECT_EQ(client("fetch " + id + " ../../healthz.x").code, 2);
  EXPECT_EQ(client("fetch " + id + " --bbox 1,2,3 -o " + folder_.path().string()).code, 1) << "its manifest is not there";
  EXPECT_EQ(client("post " + raster_, "http://127.0.0.1:1").code, 75);
}

TEST_F(Client, TokensComeFromTheEnvironmentOrAFile) {
  const std::string tokens = (folder_.path() / "tokens").string(), own = (folder_.path() / "own").string();
  ASSERT_EQ(shell(kProgram + " token new --name me --role write --file " + tokens + " >" + own + " 2>/dev/null").code, 0);
  server_.start(folder_.path(), {"--tokens", tokens});
  const std::string line = "post -q --json " + raster_ + kFlat, token = file_text(own).substr(7, file_text(own).find('\n') - 7);
  const Ended without = client(line);
  EXPECT_EQ(without.code, 1);
  EXPECT_EQ(json(without)["type"], "urn:cordillera:problem:token-missing");
  setenv("CORDILLERA_TOKEN", "cdl_wrong", 1);
  EXPECT_EQ(json(client(line))["type"], "urn:cordillera:problem:token-invalid");
  EXPECT_EQ(json(client("post -q --json --resume " + large_))["type"], "urn:cordillera:problem:token-invalid");
  setenv("CORDILLERA_TOKEN", token.c_str(), 1);
  const Ended right = client(line);
  EXPECT_EQ(right.code, 0) << right.output;
  EXPECT_THAT(right.output, testing::Not(HasSubstr("warning")));
  unsetenv("CORDILLERA_TOKEN");
  EXPECT_EQ(client(line + "--token-file " + own).code, 0);
  const Ended shown = client(line + "--token " + token);
  EXPECT_EQ(shown.code, 0);
  EXPECT_THAT(shown.output, HasSubstr("warning: others on this machine can see --token"));
  EXPECT_EQ(client(line + "--token-file " + folder_.path().string() + "/none").code, 1);
}

TEST(ClientEvents, ArePutTogetherWhereverTheyAreCut) {
  const std::string stream =
      ": waiting\n\nevent: progress\ndata: {\"a\":1}\n\nevent: ready\r\ndata: one\r\ndata: two\r\n\r\ndata:last\n\n";
  for (std::size_t size = 1; size < stream.size(); ++size) {
    client::EventReader reader;
    std::vector<std::string> seen;
    for (std::size_t at = 0; at < stream.size(); at += size) {
      reader.feed(std::string_view(stream).substr(at, size), [&](const client::Event& event) {
        seen.push_back(event.name + "=" + event.data);
        return true;
      });
    }
    EXPECT_THAT(seen, testing::ElementsAre("progress={\"a\":1}", "ready=one\ntwo", "message=last")) << size;
  }
}

}  // namespace
}  // namespace cordillera::server
