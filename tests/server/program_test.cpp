// The program itself: exit codes, layers of options, and a served build in a real child process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <cmath>

#include "real_server.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

/// A zombie that nobody has collected yet is dead.
bool alive(int process) {
  const std::string stat = file_text("/proc/" + std::to_string(process) + "/stat");
  const auto state = stat.rfind(") ");
  return state != std::string::npos && stat[state + 2] != 'Z' && stat[state + 2] != 'X';
}

/// A cone of 64 x 64 samples of half an arc minute, as an Esri ASCII grid.
std::string cone() {
  std::ostringstream text;
  text << "ncols 64\nnrows 64\nxllcorner 10\nyllcorner 46\ncellsize 0.0083333333333333\nNODATA_value -9999\n";
  for (int row = 0; row < 64; ++row) {
    for (int column = 0; column < 64; ++column) text << 3000 - 40 * std::hypot(row - 31.5, column - 31.5) << ' ';
    text << '\n';
  }
  return text.str();
}

class Program : public testing::Test {
 protected:
  void SetUp() override {
    std::ofstream(folder_.path() / "cone.asc") << cone();
    raster_ = (folder_.path() / "cone.asc").string();
  }
  std::string build(const std::string& arguments) {
    return kProgram + " build " + raster_ + " --crs EPSG:4326 --vertical-datum ellipsoid " + arguments;
  }

  void start_server() { server_.start(folder_.path()); }
  Json curl(const std::string& arguments) { return Json::parse(shell("curl -s -m 120 " + arguments).output, nullptr, false); }
  std::string post_arguments(const std::string& query = "") {
    return "--data-binary @" + raster_ + " '" + server_.base() + "/v1/datasets?name=cone.asc&crs=EPSG:4326&vertical_datum=ellipsoid" +
           query + "'";
  }

  TempFolder folder_;
  std::string raster_;
  RealServer server_;
};

TEST_F(Program, ExitCodesTellUsageFromFailure) {
  const std::string out = " -o " + (folder_.path() / "out").string();
  EXPECT_EQ(shell(kProgram + " --version").code, 0);
  EXPECT_EQ(shell(kProgram).code, 2);
  EXPECT_EQ(shell(kProgram + " frobnicate").code, 2);
  EXPECT_EQ(shell(build("")).code, 2) << "no output";
  const Ended unknown = shell(build(out + " --eror 1"));
  EXPECT_EQ(unknown.code, 2);
  EXPECT_THAT(unknown.output, HasSubstr("did you mean --error?"));
  EXPECT_EQ(shell(build(out + " --error 1 --keep 0.5")).code, 2);
  EXPECT_EQ(shell(build(out + " --error 1 --error 2")).code, 2);
  EXPECT_EQ(shell("CORDILLERA_ERROR=x " + build(out)).code, 2);
  std::ofstream(folder_.path() / "bad.tif") << "no raster";
  EXPECT_EQ(shell(kProgram + " build " + (folder_.path() / "bad.tif").string() + out).code, 1);
  EXPECT_EQ(shell(kProgram + " build /no/such.tif" + out).code, 1);
  EXPECT_EQ(shell(kProgram + " info /no/such").code, 1);
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "out")) << "nothing half-made";
}

TEST_F(Program, BuildsAFolderThatInfoReads) {
  const std::string out = (folder_.path() / "out").string();
  std::ofstream(folder_.path() / "conf") << "error = 50\ntitle = from the file\n";
  const std::string conf = " --config " + (folder_.path() / "conf").string();
  const Ended built = shell("CORDILLERA_TITLE='from the environment' " + build("-o " + out + "/ --error 20" + conf));
  ASSERT_EQ(built.code, 0) << built.output;
  EXPECT_THAT(built.output, HasSubstr("max error m"));
  const Json manifest = Json::parse(shell(kProgram + " info --json " + out).output);
  EXPECT_EQ(manifest["title"], "from the environment") << "the environment goes before the file";
  EXPECT_EQ(manifest["options"]["error"], 20.0) << "the command line goes before both";
  EXPECT_EQ(manifest["source"]["vertical_datum"], "ellipsoid");
  EXPECT_NE(manifest["device"], "") << "what built it is in the stored manifest";
  EXPECT_GT(manifest["tiles"], 0);
  EXPECT_THAT(shell(kProgram + " info " + out).output, HasSubstr("EPSG:4326"));
  EXPECT_TRUE(std::filesystem::exists(out + "/tileset.json"));
  EXPECT_FALSE(std::filesystem::exists(out + ".building"));
  const Ended dry = shell(build("--dry-run"));
  EXPECT_EQ(dry.code, 0) << dry.output;
  EXPECT_THAT(dry.output, HasSubstr("nothing was built"));
}

TEST_F(Program, ARasterWithoutDataIsSaidToBeOne) {
  std::ofstream(folder_.path() / "cone.asc") << "ncols 4\nnrows 4\nxllcorner 10\nyllcorner 46\ncellsize 1\nNODATA_value 0\n"
                                                "0 0 0 0\n0 0 0 0\n0 0 0 0\n0 0 0 0\n";
  const std::string out = (folder_.path() / "out").string();
  const Ended ended = shell(build("-o " + out));
  EXPECT_EQ(ended.code, 1);
  EXPECT_THAT(ended.output, HasSubstr("cone.asc has no data"));
  EXPECT_FALSE(std::filesystem::exists(out));
  EXPECT_FALSE(std::filesystem::exists(out + ".building"));
}

TEST_F(Program, MemoryIsALimitAndWhatWasBuiltIsKept) {
  // Blocks of many samples, which an even slope makes quick work of.
  std::ofstream grid(folder_.path() / "cone.asc");
  grid << "ncols 2400\nnrows 2400\nxllcorner 10\nyllcorner 46\ncellsize 0.0008333333333333\nNODATA_value -9999\n";
  for (int k = 0; k < 2400 * 2400; ++k) grid << k % 2400 << (k % 2400 == 2399 ? '\n' : ' ');
  grid.close();
  const std::string output = (folder_.path() / "out.sqlite").string();
  const Ended starved = shell(build("-o " + output + " --error 1000 --threads 2 --memory 64"));
  EXPECT_EQ(starved.code, 1) << starved.output;
  EXPECT_THAT(starved.output, HasSubstr("memory=64 MiB"));
  EXPECT_THAT(starved.output, HasSubstr("accepted: more memory"));
  EXPECT_EQ(shell(kProgram + " info " + output).code, 1) << "not finished, and says so";
  const Ended fed = shell(build("-o " + output + " --error 1000 --threads 2 --memory 2048"));
  EXPECT_EQ(fed.code, 0) << fed.output;
  EXPECT_EQ(shell(kProgram + " info " + output).code, 0);
}

TEST_F(Program, ATerminalShowsABarThatIsGoneAtTheEnd) {
  const std::string command = build("-o " + (folder_.path() / "out.sqlite").string() + " --max-level 10");
  const Ended ended = shell("script -qec '" + command + "' /dev/null");
  EXPECT_EQ(ended.code, 0) << ended.output;
  EXPECT_THAT(ended.output, HasSubstr("\r[..............................] open"));
  EXPECT_THAT(ended.output, testing::ContainsRegex("\r\\[#{15,}[.]*\\] build [0-9]+ %"));
  EXPECT_THAT(ended.output, HasSubstr("\r\033[Ksource")) << "the table begins where the bar was";
}

TEST_F(Program, ServesARealBuild) {
  start_server();
  const Json posted = curl("-H 'Prefer: wait=100' " + post_arguments("&error=20"));
  ASSERT_EQ(posted["state"], "ready") << posted.dump() << server_.log();
  const std::string base = server_.base() + "/v1/datasets/" + std::string(posted["id"]);
  const Json manifest = curl(base + "/manifest.json");
  EXPECT_EQ(manifest["tiles"], posted["manifest"]["tiles"]);
  EXPECT_NE(manifest["device"], "");
  EXPECT_EQ(curl(base + "/tileset.json")["asset"]["version"], "1.1");
  std::ofstream(folder_.path() / "bad.tif") << "no raster";
  const Json bad =
      curl("-H 'Prefer: wait=100' --data-binary @" + (folder_.path() / "bad.tif").string() + " " + server_.base() + "/v1/datasets");
  EXPECT_GE(bad["status"], 400) << bad.dump();
  EXPECT_LT(bad["status"], 500) << bad.dump();
  const Json dry = curl(post_arguments("&dry_run=1"));
  EXPECT_EQ(dry["dry_run"], true) << dry.dump();
  EXPECT_EQ(server_.end(SIGTERM), 0) << "a graceful end";
  EXPECT_THAT(server_.log(), HasSubstr("stopped"));
}

TEST_F(Program, EventsTellStageShareAndTimeUntilItIsReady) {
  start_server();
  const Json posted = curl(post_arguments("&error=1&max_level=11"));
  const std::string stream = shell("curl -sN -m 120 " + server_.base() + "/v1/datasets/" + std::string(posted["id"]) + "/events").output;
  std::istringstream lines(stream);
  std::string event;
  std::vector<std::string> stages;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("event: ", 0) == 0) event = line.substr(7);
    if (line.rfind("data: ", 0) != 0 || event != "progress") continue;
    const Json data = Json::parse(line.substr(6));
    if (stages.empty() || stages.back() != data["stage"]) stages.push_back(data["stage"]);
    EXPECT_GE(data["done"], 0) << line;
    EXPECT_LE(data["done"], data["total"]) << line;
    EXPECT_GE(data["share"], 0) << line;
    EXPECT_LE(data["share"], 1) << line;
    EXPECT_TRUE(data["seconds_left"].is_null() || data["seconds_left"] >= 0) << line;
    EXPECT_TRUE(data["state"] == "queued" || data["state"] == "running") << line;
  }
  EXPECT_EQ(event, "ready") << stream;
  EXPECT_THAT(stages, testing::Contains("build")) << stream;
}

TEST_F(Program, AChildThatIsKilledIsAProblemAndTheServiceGoesOn) {
  start_server();
  const Json posted = curl(post_arguments("&error=0.001&max_level=16&threads=1"));
  ASSERT_TRUE(posted.contains("id")) << posted.dump();
  const int child = server_.child_process();
  ASSERT_GT(child, 0) << server_.log();
  kill(child, SIGKILL);
  const std::string status = server_.base() + "/v1/datasets/" + std::string(posted["id"]);
  Json seen;
  for (int i = 0; i < 500; ++i) {
    seen = curl(status);
    if (seen["state"] == "failed") break;
    usleep(10000);
  }
  EXPECT_THAT(std::string(seen["error"]["detail"]), HasSubstr("SIGKILL")) << seen.dump();
  EXPECT_EQ(curl(server_.base() + "/healthz")["status"], "ok");
}

TEST_F(Program, AKilledServerTakesItsChildrenAlongAndTheNextOneGoesOn) {
  start_server();
  const Json posted = curl(post_arguments("&error=20"));
  const std::string id = posted["id"];
  const int child = server_.child_process();
  ASSERT_GT(child, 0) << server_.log();
  server_.end(SIGKILL);
  for (int i = 0; i < 200 && alive(child); ++i) usleep(10000);
  EXPECT_FALSE(alive(child)) << "an orphan builds on";
  start_server();
  Json seen;
  for (int i = 0; i < 1500; ++i) {
    seen = curl(server_.base() + "/v1/datasets/" + id);
    if (seen["state"] == "ready" || seen["state"] == "failed") break;
    usleep(20000);
  }
  EXPECT_EQ(seen["state"], "ready") << seen.dump();
}

}  // namespace
}  // namespace cordillera::server
