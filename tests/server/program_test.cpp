// The program itself: exit codes, layers of options, and a served build in a real child process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>

#include "fixture.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

struct Ended {
  int code = -1;
  std::string output;  ///< stdout and stderr
};

Ended shell(const std::string& command) {
  FILE* pipe = popen(("{ " + command + "; } 2>&1").c_str(), "r");
  Ended ended;
  char bytes[4096];
  for (std::size_t count = 0; (count = fread(bytes, 1, sizeof bytes, pipe)) > 0;) ended.output.append(bytes, count);
  const int status = pclose(pipe);
  ended.code = WIFEXITED(status) ? WEXITSTATUS(status) : -1;
  return ended;
}

/// A zombie that nobody has collected yet is dead.
bool alive(int process) {
  const std::string stat = file_text("/proc/" + std::to_string(process) + "/stat");
  const auto state = stat.rfind(") ");
  return state != std::string::npos && stat[state + 2] != 'Z' && stat[state + 2] != 'X';
}

const std::string kProgram = CORDILLERA_PROGRAM;

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
  void TearDown() override {
    if (server_ > 0) end_server(SIGKILL);
  }
  std::string build(const std::string& arguments) {
    return kProgram + " build " + raster_ + " --crs EPSG:4326 --vertical-datum ellipsoid " + arguments;
  }

  /// Starts `cordillera serve` on any free port and waits until it says which.
  void start_server() {
    log_ = folder_.path() / "log";
    std::filesystem::remove(log_);
    server_ = fork();
    if (server_ == 0) {
      (void)freopen(log_.c_str(), "w", stderr);
      const std::string data = (folder_.path() / "data").string();
      execl(kProgram.c_str(), kProgram.c_str(), "serve", "--listen", "127.0.0.1:0", "--data", data.c_str(), "--log-level",
            "debug", nullptr);
      _exit(127);
    }
    for (int i = 0; i < 1000; ++i) {
      const std::string log = file_text(log_);
      const auto start = log.find("http://");
      if (start != std::string::npos && log.find('/', start + 7) != std::string::npos) {
        base_ = log.substr(start, log.find('/', start + 7) - start);
        return;
      }
      usleep(10000);
    }
    FAIL() << "the server did not start: " << file_text(log_);
  }
  int end_server(int signal) {
    kill(server_, signal);
    int status = 0;
    waitpid(server_, &status, 0);
    server_ = -1;
    return status;
  }
  /// The process that builds, as the log names it.
  int child_process() {
    const std::string words = "runs as process ";
    for (int i = 0; i < 500; ++i) {
      const std::string log = file_text(log_);
      const auto start = log.find(words);
      if (start != std::string::npos && log.find('\n', start) != std::string::npos)
        return std::atoi(&log[start + words.size()]);
      usleep(10000);
    }
    return -1;
  }
  Json curl(const std::string& arguments) { return Json::parse(shell("curl -s -m 120 " + arguments).output, nullptr, false); }
  std::string post_arguments(const std::string& query = "") {
    return "--data-binary @" + raster_ + " '" + base_ + "/v1/datasets?name=cone.asc&crs=EPSG:4326&vertical_datum=ellipsoid" +
           query + "'";
  }

  TempFolder folder_;
  std::string raster_, base_;
  std::filesystem::path log_;
  pid_t server_ = -1;
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
  EXPECT_GT(manifest["tiles"], 0);
  EXPECT_THAT(shell(kProgram + " info " + out).output, HasSubstr("EPSG:4326"));
  EXPECT_TRUE(std::filesystem::exists(out + "/tileset.json"));
  EXPECT_FALSE(std::filesystem::exists(out + ".building"));
  const Ended dry = shell(build("--dry-run"));
  EXPECT_EQ(dry.code, 0) << dry.output;
  EXPECT_THAT(dry.output, HasSubstr("nothing was built"));
}

TEST_F(Program, ServesARealBuild) {
  start_server();
  const Json posted = curl("-H 'Prefer: wait=100' " + post_arguments("&error=20"));
  ASSERT_EQ(posted["state"], "ready") << posted.dump() << file_text(log_);
  const std::string base = base_ + "/v1/datasets/" + std::string(posted["id"]);
  const Json manifest = curl(base + "/manifest.json");
  EXPECT_EQ(manifest["tiles"], posted["manifest"]["tiles"]);
  EXPECT_EQ(curl(base + "/tileset.json")["asset"]["version"], "1.1");
  std::ofstream(folder_.path() / "bad.tif") << "no raster";
  const Json bad =
      curl("-H 'Prefer: wait=100' --data-binary @" + (folder_.path() / "bad.tif").string() + " " + base_ + "/v1/datasets");
  EXPECT_GE(bad["status"], 400) << bad.dump();
  EXPECT_LT(bad["status"], 500) << bad.dump();
  const Json dry = curl(post_arguments("&dry_run=1"));
  EXPECT_EQ(dry["dry_run"], true) << dry.dump();
  EXPECT_EQ(end_server(SIGTERM), 0) << "a graceful end";
  EXPECT_THAT(file_text(log_), HasSubstr("stopped"));
}

TEST_F(Program, AChildThatIsKilledIsAProblemAndTheServiceGoesOn) {
  start_server();
  const Json posted = curl(post_arguments("&error=0.001&max_level=16&threads=1"));
  ASSERT_TRUE(posted.contains("id")) << posted.dump();
  const int child = child_process();
  ASSERT_GT(child, 0) << file_text(log_);
  kill(child, SIGKILL);
  const std::string status = base_ + "/v1/datasets/" + std::string(posted["id"]);
  Json seen;
  for (int i = 0; i < 500; ++i) {
    seen = curl(status);
    if (seen["state"] == "failed") break;
    usleep(10000);
  }
  EXPECT_THAT(std::string(seen["error"]["detail"]), HasSubstr("SIGKILL")) << seen.dump();
  EXPECT_EQ(curl(base_ + "/healthz")["status"], "ok");
}

TEST_F(Program, AKilledServerTakesItsChildrenAlongAndTheNextOneGoesOn) {
  start_server();
  const Json posted = curl(post_arguments("&error=20"));
  const std::string id = posted["id"];
  const int child = child_process();
  ASSERT_GT(child, 0) << file_text(log_);
  end_server(SIGKILL);
  for (int i = 0; i < 200 && alive(child); ++i) usleep(10000);
  EXPECT_FALSE(alive(child)) << "an orphan builds on";
  start_server();
  Json seen;
  for (int i = 0; i < 1500; ++i) {
    seen = curl(base_ + "/v1/datasets/" + id);
    if (seen["state"] == "ready" || seen["state"] == "failed") break;
    usleep(20000);
  }
  EXPECT_EQ(seen["state"], "ready") << seen.dump();
}

}  // namespace
}  // namespace cordillera::server
