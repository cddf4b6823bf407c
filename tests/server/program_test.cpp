// The program itself: exit codes, layers of options, and a served build in a real child process.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>

#include "program_fixture.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

/// A zombie that nobody has collected yet is dead.
bool alive(int process) {
  const std::string stat = file_text("/proc/" + std::to_string(process) + "/stat");
  const auto state = stat.rfind(") ");
  return state != std::string::npos && stat[state + 2] != 'Z' && stat[state + 2] != 'X';
}

TEST_F(Program, ExitCodesTellUsageFromFailure) {
  const std::string out = " -o " + (folder_.path() / "out").string();
  EXPECT_EQ(shell(kProgram + " --version").code, 0);
  EXPECT_EQ(shell(kProgram).code, 2);
  EXPECT_EQ(shell(kProgram + " frobnicate").code, 2);
  EXPECT_EQ(shell(kProgram + " build" + out).code, 2) << "no raster";
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

TEST_F(Program, WhatIsMisspeltIsToldItsNeighbour) {
  const std::pair<const char*, const char*> near[] = {{"buidl dem.tif", "unknown command 'buidl'; did you mean build?"},
                                                      {"inf out", "did you mean info?"},
                                                      {"--hlp", "unknown option '--hlp'; did you mean --help?"},
                                                      {"-x", "unknown option '-x'; see `cordillera help`"},
                                                      {"plan -o q", "plan needs sources"},
                                                      {"token", "token needs an action"},
                                                      {"decode", "decode needs a "},
                                                      {"build dem.tif --outptu out", "did you mean --output?"},
                                                      {"build --eror 5 dem.tif -o out", "did you mean --error?"},
                                                      {"build dem.tif -o out --overwrit", "did you mean --overwrite?"},
                                                      {"build --dry-rnu", "did you mean --dry-run?"},
                                                      {"info out --jsn", "did you mean --json?"},
                                                      {"serve --lisen 0.0.0.0:1", "did you mean --listen?"}};
  for (const auto& [line, words] : near) {
    const Ended ended = shell(kProgram + " " + line);
    EXPECT_EQ(ended.code, 2) << line;
    EXPECT_THAT(ended.output, HasSubstr(words)) << line;
    EXPECT_EQ(std::count(ended.output.begin(), ended.output.end(), '\n'), 1) << ended.output;
  }
}

TEST_F(Program, AnUnknownOptionIsOneSentence) {
  EXPECT_EQ(shell(kProgram + " build dem.tif --frobnicate 3 -o out").output,
            "cordillera: unknown option '--frobnicate'; see `cordillera help build`\n");
  EXPECT_EQ(shell(kProgram + " serve --frobnicate").output,
            "cordillera: unknown option '--frobnicate'; see `cordillera help serve`\n");
  EXPECT_THAT(shell(kProgram + " build dem.tif --eror 3").output, HasSubstr("did you mean --error?\n"));
  EXPECT_THAT(shell(kProgram + " build dem.tif --epsg 4326").output, HasSubstr("did you mean --crs?\n"))
      << "as other programs have it";
  EXPECT_THAT(shell(kProgram + " build dem.tif -o dem.ply --frame crs").output,
              HasSubstr("--frame is an option of `cordillera export`"));
  for (const char* command : {"post", "view"}) {
    EXPECT_THAT(shell(kProgram + " " + command + " dem.tif --water-mask sea.tif").output,
                HasSubstr("unknown option '--water-mask'"))
        << "a service reads no file that a request names";
  }
  EXPECT_THAT(shell(kProgram + " " + raster_).output,
              HasSubstr("is no command but a file; accepted: cordillera view " + raster_));
  EXPECT_THAT(shell(kProgram + " serve " + raster_).output, HasSubstr("accepted: cordillera view " + raster_));
  EXPECT_THAT(shell(kProgram + " build " + raster_ + " out").output, HasSubstr("accepted: -o out, "));
  EXPECT_THAT(shell(kProgram + " build " + raster_ + " " + raster_ + " --crs EPSG:4326 --dry-run").output, HasSubstr("2 rasters"))
      << "a dry run needs no -o";
}

TEST_F(Program, HelpHasOptionsInGroups) {
  const std::string help = shell(kProgram + " help build").output;
  const char* const before[][2] = {{"\nOutput:", "\n  -o,--output"},
                                   {"\nRaster:", "\n  --crs "},
                                   {"\nHeights and voids:", "\n  --vertical-datum "},
                                   {"\nLevels and errors:", "\n  --error "}};
  for (const auto& [group, option] : before) {
    const std::size_t heading = help.find(group), line = help.find(option);
    ASSERT_NE(heading, help.npos) << group;
    ASSERT_NE(line, help.npos) << option;
    EXPECT_LT(heading, line) << option;
    std::size_t last = line;  // heading before the option
    while (std::isupper(static_cast<unsigned char>(help[last + 1])) == 0) last = help.rfind('\n', last - 1);
    EXPECT_EQ(last, heading) << option << " is not under " << group;
  }
  EXPECT_THAT(help, HasSubstr("\nMachine: --device --threads ")) << "a screen has no room for what they are";
  EXPECT_EQ(help.find("\nOutput:"), help.rfind("\nOutput:")) << "one heading, wherever its options come from";
  EXPECT_THAT(shell(kProgram + " help serve").output, HasSubstr("\nLimits:"));
}

TEST_F(Program, HelpIsOneScreenACommand) {
  const std::string all = shell(kProgram + " help").output;
  std::istringstream lines(all.substr(all.find("\nCommands:\n") + 11));
  std::vector<std::string> commands{""};
  for (std::string line; std::getline(lines, line) && line.starts_with("  ");) {
    if (line[2] != ' ') commands.push_back(line.substr(2, line.find(' ', 2) - 2));
  }
  EXPECT_GT(commands.size(), 20u);
  for (const std::string& command : commands) {
    const Ended help = shell(kProgram + " help " + command);
    EXPECT_EQ(help.code, 0) << command;
    EXPECT_LE(std::count(help.output.begin(), help.output.end(), '\n'), 50) << command;
    std::istringstream page(help.output);
    for (std::string line; std::getline(page, line);) EXPECT_LE(line.size(), 102u) << command << ": " << line;
    EXPECT_THAT(help.output, HasSubstr("Usage: cordillera ")) << command;
  }
  // What a screen has no room for stands elsewhere, and the page says where.
  EXPECT_THAT(shell(kProgram + " serve --help").output, HasSubstr("cordillera serve --help-all"));
  EXPECT_THAT(shell(kProgram + " serve --help").output, HasSubstr("--max-uploads"));
  const std::string full = shell(kProgram + " help serve --all").output;
  EXPECT_THAT(full, HasSubstr("greatest raster that may be posted, MiB [1 to"));
}

TEST_F(Program, QuietSaysNothingButProblems) {
  const std::string out = (folder_.path() / "out").string();
  const Ended quiet = shell(build("--quiet --max-level 10 -o " + out));
  EXPECT_EQ(quiet.code, 0);
  EXPECT_EQ(quiet.output, "");
  EXPECT_THAT(shell(build("-q --max-level 10 -o " + out)).output, HasSubstr("earlier build"));
  EXPECT_THAT(shell(build("-q --dry-run --max-level 10")).output, HasSubstr("nothing was built"));
}

TEST_F(Program, WhatNeverReachedStdoutIsNoSuccess) {
  const std::string built = (folder_.path() / "a.sqlite").string();
  ASSERT_EQ(shell(build("-q --max-level 6 -o " + built)).code, 0);
  const std::string of_built[] = {"info ", "info --json ", "check ", "check --json "};
  std::vector<std::string> commands = {"--version", "help", "help build", "man", "completion bash", "doctor"};
  for (const std::string& command : of_built) commands.push_back(command + built);
  for (const std::string& command : commands) {
    const Ended lost = shell(kProgram + " " + command + " >/dev/full");
    EXPECT_EQ(lost.code, 1) << command;
    EXPECT_THAT(lost.output, HasSubstr("cordillera: not all of the output could be written to stdout")) << command;
    const Ended closed = shell(kProgram + " " + command + " >&-");
    EXPECT_EQ(closed.code, 1) << command << closed.output;
  }
  EXPECT_EQ(shell(build("-q --max-level 6 --overwrite -o " + built) + " >&-").code, 0) << "nothing was to be said";
}

TEST_F(Program, WhoKeepsADataFolderMayBeQuiet) {
  const std::string data = (folder_.path() / "data").string(), store = (folder_.path() / "a.sqlite").string();
  start_server();
  ASSERT_EQ(curl("-H 'Prefer: wait=400' " + post_arguments("&max_level=6"))["state"], "ready");
  const auto silent = [&](const std::string& line) {
    const Ended ended = shell(kProgram + " " + line);
    EXPECT_EQ(ended.code, 0) << line << ended.output;
    EXPECT_EQ(ended.output, "") << line;
  };
  silent("backup -q " + data + " -o " + data + ".copy");
  silent("check --quiet " + data);
  server_.end(SIGTERM);
  silent("vacuum -q " + data);
  silent("restore -q " + data + ".copy --data " + data + ".restored");
  // Problems are said.
  ASSERT_EQ(shell(build("-q --max-level 6 -o " + store)).code, 0);
  silent("check -q " + store);
  std::filesystem::resize_file(store, std::filesystem::file_size(store) / 2);
  const Ended damaged = shell(kProgram + " check -q " + store);
  EXPECT_EQ(damaged.code, 1);
  EXPECT_THAT(damaged.output, HasSubstr("a.sqlite")) << "quiet is not silent";
}

TEST_F(Program, TwoDashesEndTheOptions) {
  std::filesystem::copy(raster_, folder_.path() / "-dash.asc");
  const Ended built = shell("cd " + folder_.path().string() + " && " + kProgram +
                            " build --crs EPSG:4326 --vertical-datum ellipsoid --dry-run --max-level 6 cone.asc -- -dash.asc");
  EXPECT_EQ(built.code, 0) << built.output;
  EXPECT_THAT(built.output, HasSubstr("2 rasters"));
  EXPECT_EQ(shell(kProgram + " --version --").code, 0);
}

TEST_F(Program, CheckSaysWhatItTakesOfAFileThatIsNoDataset) {
  const Ended refused = shell(kProgram + " check " + raster_);
  EXPECT_EQ(refused.code, 1) << refused.output;
  EXPECT_THAT(refused.output, HasSubstr("is no dataset; accepted: the .sqlite file of a dataset"));
}

TEST_F(Program, AHangupChangesNothingAndAFileWithoutTokensIsTold) {
  std::ofstream(folder_.path() / "tokens") << "# none yet\n";
  server_.start(folder_.path(), {"--tokens", (folder_.path() / "tokens").string()});
  EXPECT_THAT(server_.log(), HasSubstr("tokens has 0 tokens: nobody can write"));
  server_.tell(SIGHUP);
  EXPECT_TRUE(eventually([&] { return server_.log().find("SIGHUP changes nothing") != std::string::npos; })) << server_.log();
  EXPECT_EQ(shell("curl -q -s -f " + server_.base() + "/healthz").code, 0);
  EXPECT_EQ(server_.end(SIGTERM), 0);
}

TEST_F(Program, AFolderThatMayNotBeEnteredIsToldSo) {
  if (geteuid() == 0) GTEST_SKIP() << "root may enter every folder";
  const std::filesystem::path place = folder_.path() / "closed";
  ASSERT_EQ(shell(build("-q --max-level 6 -o " + (folder_.path() / "a.sqlite").string())).code, 0);
  std::filesystem::create_directory(place);
  std::filesystem::rename(folder_.path() / "a.sqlite", place / "dataset.sqlite");
  std::filesystem::permissions(place, std::filesystem::perms::none);
  for (const std::string& name : {place.string(), (place / "dataset.sqlite").string()}) {
    for (const std::string command : {" check ", " info ", " export -o a.glb "})
      EXPECT_THAT(shell(kProgram + command + name).output, HasSubstr("may not be read: Permission denied")) << command;
  }
  std::filesystem::permissions(place, std::filesystem::perms::owner_all);
}

/// What a path says is no field of the line.
TEST_F(Program, ALineOfTheLogHasNoFieldsThatAClientWrote) {
  server_.start(folder_.path());
  curl("-X DELETE '" + server_.base() + "/v1/x%20status=200%20who=%22admin%22'");
  EXPECT_TRUE(eventually([&] { return server_.log().find("method=DELETE") != std::string::npos; }));
  EXPECT_THAT(server_.log(), HasSubstr(R"( path="/v1/x status=200 who=\"admin\"" )"));
}

TEST_F(Program, ASecondServerIsRefusedThePortAndTheFolder) {
  start_server();
  const std::string address = server_.base().substr(7), data = (folder_.path() / "data").string();
  const Ended port =
      shell("timeout 200 " + kProgram + " serve --listen " + address + " --data " + (folder_.path() / "other").string());
  EXPECT_EQ(port.code, 1);
  EXPECT_THAT(port.output, HasSubstr("another program listens there"));
  const Ended folder = shell("timeout 200 " + kProgram + " serve --listen 127.0.0.1:0 --data " + data);
  EXPECT_EQ(folder.code, 1);
  EXPECT_THAT(folder.output, HasSubstr("another server uses it"));
}

/// Where the index of the registry's log cannot be made, SQLite speaks of input and output.
TEST_F(Program, AFullDiskIsToldAtTheStart) {
  start_server();
  curl(post_arguments("&max_level=9"));
  server_.end(SIGKILL);
  const std::string disk = (folder_.path() / "disk").string(), data = (folder_.path() / "data").string();
  const Ended full =
      shell("mkdir " + disk + " && unshare -rm sh -c 'mount -t tmpfs -o size=8m none " + disk + " || exit 77; cp -r " + data +
            " " + disk + "/data; rm -f " + disk + "/data/registry.sqlite-shm; cat /dev/zero > " + disk +
            "/more 2> /dev/null; exec timeout 100 " + kProgram + " serve --listen 127.0.0.1:0 --data " + disk + "/data'");
  if (full.code == 77 || full.output.starts_with("unshare: ")) GTEST_SKIP() << "no disk of its own may be mounted here";
  EXPECT_EQ(full.code, 1) << full.output;
  EXPECT_THAT(full.output, HasSubstr("registry.sqlite: the disk is full ("));
  EXPECT_THAT(full.output, HasSubstr("accepted: a few MiB free on its disk"));
}

TEST_F(Program, WhatIsRefusedBeforeItIsARequestIsCounted) {
  start_server();
  const auto ask = [&](const std::string& arguments) { shell("curl -q -s -m 100 -o /dev/null " + server_.base() + arguments); };
  ask("/" + std::string(9000, 'a'));
  ask("/v1/datasets -H 'Content-Encoding: compress' -d x");
  const std::string text = shell("curl -q -s -m 100 " + server_.base() + "/metrics").output;
  for (const char* labels :
       {"{route=\"unknown\",method=\"other\",status=\"414\"}", "{route=\"datasets\",method=\"POST\",status=\"415\"}"})
    EXPECT_THAT(text, HasSubstr("cordillera_http_requests_total" + std::string(labels) + " 1\n"));
  for (const char* type : {"uri-too-long", "coding-unknown"})
    EXPECT_THAT(text, HasSubstr("cordillera_problems_total{type=\"" + std::string(type) + "\"} 1\n"));
}

TEST_F(Program, ATerminalShowsABarThatIsGoneAtTheEnd) {
  const std::string command = build("-o " + (folder_.path() / "out.sqlite").string() + " --max-level 10");
  const Ended ended = shell("script -qec '" + command + "' /dev/null");
  EXPECT_EQ(ended.code, 0) << ended.output;
  EXPECT_THAT(ended.output, HasSubstr("\r[..............................] open"));
  EXPECT_THAT(ended.output, HasSubstr("\r[##############################] build 100 %")) << "however fast the machine";
  EXPECT_THAT(ended.output, HasSubstr("\r\033[Ksource")) << "the table begins where the bar was";
}

TEST_F(Program, ServesARealBuild) {
  start_server();
  Json posted = curl("-H 'Prefer: wait=400' " + post_arguments("&error=20"));
  ASSERT_EQ(posted["state"], "ready") << posted.dump() << server_.log();
  const std::string base = server_.base() + "/v1/datasets/" + std::string(posted["id"]);
  Json manifest = curl(base + "/manifest.json");
  EXPECT_EQ(manifest["tiles"], posted["manifest"]["tiles"]);
  EXPECT_NE(manifest["device"], "");
  EXPECT_EQ(curl(base + "/tileset.json")["asset"]["version"], "1.1");
  std::ofstream(folder_.path() / "bad.tif") << "no raster";
  const Json bad = curl("-H 'Prefer: wait=400' --data-binary @" + (folder_.path() / "bad.tif").string() + " " + server_.base() +
                        "/v1/datasets");
  EXPECT_GE(bad["status"], 400) << bad.dump();
  EXPECT_LT(bad["status"], 500) << bad.dump();
  Json dry = curl(post_arguments("&dry_run=1"));
  EXPECT_EQ(dry["dry_run"], true) << dry.dump();
  EXPECT_EQ(server_.end(SIGTERM), 0) << "a graceful end";
  EXPECT_THAT(server_.log(), HasSubstr("stopped"));
}

TEST_F(Program, EventsTellStageShareAndTimeUntilItIsReady) {
  start_server();
  // It queues behind another build until the stream is open, so that there is something left to be told.
  Json before = curl(post_arguments("&error=0.01&max_level=16&threads=1"));
  Json posted = curl(post_arguments("&error=1&max_level=11"));
  ASSERT_TRUE(before.contains("id") && posted.contains("id")) << before.dump() << posted.dump();
  const std::string address = server_.base() + "/v1/datasets/" + std::string(posted["id"]) + "/events";
  const auto heard = folder_.path() / "events";
  std::thread listener([&] { shell("curl -q -sN -m 500 -o " + heard.string() + " " + address); });
  EXPECT_TRUE(eventually([&] { return file_text(heard).find("\n\n") != std::string::npos; }));
  shell("curl -q -s -m 500 -X DELETE " + server_.base() + "/v1/datasets/" + std::string(before["id"]));
  listener.join();
  const std::string stream = file_text(heard);
  std::istringstream lines(stream);
  std::string event;
  std::vector<std::string> stages;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("event: ", 0) == 0) event = line.substr(7);
    if (line.rfind("data: ", 0) != 0 || event != "progress") continue;
    Json data = Json::parse(line.substr(6));
    const std::string stage = data["stage"];  // as a string: json 3.11.3 does not compare the two
    if (stages.empty() || stages.back() != stage) stages.push_back(stage);
    EXPECT_GE(data["done"], 0) << line;
    EXPECT_LE(data["done"], data["total"]) << line;
    EXPECT_GE(data["share"], 0) << line;
    EXPECT_LE(data["share"], 1) << line;
    EXPECT_TRUE(data["seconds_left"].is_null() || data["seconds_left"] >= 0) << line;
    EXPECT_TRUE(data["state"] == "queued" || data["state"] == "running") << line;
  }
  EXPECT_EQ(event, "ready") << stream;
  EXPECT_THAT(stages, testing::IsSupersetOf({"queued", "build"})) << stream;
}

TEST_F(Program, AChildThatIsKilledIsAProblemAndTheServiceGoesOn) {
  start_server();
  Json posted = curl(post_arguments("&error=0.01&max_level=16&threads=1"));
  ASSERT_TRUE(posted.contains("id")) << posted.dump();
  const int child = server_.child_process();
  ASSERT_GT(child, 0) << server_.log();
  kill(child, SIGKILL);
  int second = 0;  // the machine may have killed the first for reasons of its own: it gets one more try
  EXPECT_TRUE(eventually([&] { return (second = server_.child_process()) > 0 && second != child; })) << server_.log();
  if (second > 0) kill(second, SIGKILL);
  const std::string status = server_.base() + "/v1/datasets/" + std::string(posted["id"]);
  Json seen;
  EXPECT_TRUE(eventually([&] { return (seen = curl(status))["state"] == "failed"; })) << seen.dump();
  EXPECT_THAT(std::string(seen["error"]["detail"]), HasSubstr("SIGKILL")) << seen.dump();
  EXPECT_EQ(curl(server_.base() + "/healthz")["status"], "ok");
}

TEST_F(Program, AKilledServerTakesItsChildrenAlongAndTheNextOneGoesOn) {
  start_server();
  Json posted = curl(post_arguments("&error=1&max_level=11"));
  const std::string id = posted["id"];
  const int child = server_.child_process();
  ASSERT_GT(child, 0) << server_.log();
  kill(child, SIGSTOP);  // or a fast one is over before its server is
  EXPECT_TRUE(alive(child));
  server_.end(SIGKILL);
  kill(child, SIGCONT);  // it may have been held before it asked to be told of the server's end; then it looks for itself
  EXPECT_TRUE(eventually([&] { return !alive(child); })) << "an orphan builds on";
  start_server();
  Json seen;
  EXPECT_TRUE(eventually([&] {
    seen = curl(server_.base() + "/v1/datasets/" + id);
    return seen["state"] == "ready" || seen["state"] == "failed";
  }));
  EXPECT_EQ(seen["state"], "ready") << seen.dump();
}

}  // namespace
}  // namespace cordillera::server
