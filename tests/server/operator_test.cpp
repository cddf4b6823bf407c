// What an operator sees and sets, with the real program: logs, ids, tokens, limits of builds, doctor.
#include <gmock/gmock.h>

#include <functional>
#include <set>

#include "pipeline/store/sqlite.h"
#include "program_fixture.h"
#include "prometheus_text.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

class Operator : public Program {
 protected:
  std::string token_line(const std::string& name, const std::string& role, std::string* token) {
    const std::string output = shell(kProgram + " token new --name " + name + " --role " + role + " 2>/dev/null").output;
    const auto at = output.find("token: "), line = output.find("line:  ");
    EXPECT_NE(at, output.npos) << output;
    EXPECT_NE(line, output.npos) << output;
    *token = output.substr(at + 7, output.find('\n', at) - at - 7);
    return output.substr(line + 7, output.find('\n', line) - line - 7);
  }
  std::vector<Json> log_lines() {
    std::vector<Json> lines;
    std::istringstream text(server_.log());
    for (std::string line; std::getline(text, line);) {
      lines.push_back(Json::parse(line, nullptr, false));
      EXPECT_TRUE(lines.back().is_object()) << "no JSON: " << line;
    }
    return lines;
  }
  /// A raster whose build takes longer than the limit below on any machine: rough, and 1.5 million samples.
  void write_large(const std::string& path) {
    std::ofstream file(path);
    file << "ncols 1200\nnrows 1200\nxllcorner 10\nyllcorner 46\ncellsize 0.000833333333333333\nNODATA_value -9999\n";
    std::uint32_t noise = 1;
    for (int row = 0; row < 1200; ++row) {
      for (int column = 0; column < 1200; ++column) {
        noise = noise * 1664525u + 1013904223u;
        file << 1000 + (noise >> 24) << ' ';
      }
      file << '\n';
    }
  }
  Json post_and_wait(const std::string& file, const std::string& query = "") {
    return curl("-H 'Prefer: wait=300' --data-binary @" + file + " '" + server_.base() +
                "/v1/datasets?name=a.asc&crs=EPSG:4326&vertical_datum=ellipsoid" + query + "'");
  }
};

TEST_F(Operator, LogsAreJsonAndNameRequestAndJob) {
  server_.start(folder_.path(), {"--log-format", "json"});
  const Json posted = curl("-H 'X-Request-Id: from-me-1' -H 'Prefer: wait=300' " + post_arguments());
  const std::string id = posted["id"];
  EXPECT_EQ(posted["state"], "ready") << posted.dump();
  server_.end(SIGTERM);
  std::set<std::string> of_request, stages;
  for (const Json& line : log_lines()) {
    EXPECT_EQ(std::string(line["time"]).size(), 24u);
    EXPECT_THAT(std::string(line["level"]), testing::AnyOf("debug", "info", "warning"));
    if (line.value("request", "") != "from-me-1") continue;
    of_request.insert(std::string(line["message"]));
    if (line.contains("stage")) stages.insert(std::string(line["stage"]));
    if (line.value("message", "") == "build ended") {
      EXPECT_EQ(line["job"], id);
      EXPECT_EQ(line["outcome"], "ready");
      EXPECT_EQ(line["blocks"], 1);
      EXPECT_GT(double(line["seconds"]), 0);
    }
    if (line.value("message", "") == "request") {
      EXPECT_EQ(line["status"], 201);
      EXPECT_EQ(line["client"], "127.0.0.1");
    }
  }
  EXPECT_THAT(of_request,
              testing::IsSupersetOf({std::string("request"), "dataset " + id + ": queued", "dataset " + id + ": build started",
                                     std::string("build ended"), "dataset " + id + ": ready"}));
  EXPECT_THAT(stages, testing::IsSupersetOf({std::string("open"), std::string("build"), std::string("publish")}));
}

TEST_F(Operator, SeesWhomATrustedProxyNames) {
  const auto log = [&] {
    const std::string answer = shell("curl -q -s -m 500 -H 'X-Forwarded-For: 192.0.2.1' " + server_.base() + "/v1/x").output;
    EXPECT_THAT(answer, HasSubstr("not-found"));
    server_.end(SIGTERM);
    return server_.log();
  };
  server_.start(folder_.path(), {"--trusted-proxies", "127.0.0.1"});
  EXPECT_THAT(log(), HasSubstr("client=192.0.2.1"));
  server_.start(folder_.path());
  EXPECT_THAT(log(), testing::AllOf(HasSubstr("client=127.0.0.1"), testing::Not(HasSubstr("192.0.2.1"))))
      << "anybody can write that line";
}

TEST_F(Operator, TokensAreMadeAndUsed) {
  std::string writer, reader;
  const std::string file = (folder_.path() / "tokens").string();
  std::ofstream(file) << token_line("ci", "write", &writer) << "\n# readers\n"
                      << token_line("map", "read", &reader);  // without a last newline
  EXPECT_EQ(shell(kProgram + " token new --name later --role admin --file " + file + " >/dev/null 2>&1").code, 0);
  EXPECT_THAT(file_text(file), HasSubstr("\nlater admin sha256:"));
  server_.start(folder_.path(), {"--tokens", file});
  EXPECT_EQ(curl(post_arguments())["status"], 401);
  EXPECT_EQ(curl("-H 'Authorization: Bearer " + reader + "' " + post_arguments())["status"], 403);
  const Json posted = curl("-H 'Authorization: Bearer " + writer + "' " + post_arguments("&private=1"));
  const std::string id = posted["id"];
  EXPECT_EQ(curl(server_.base() + "/v1/datasets/" + id)["status"], 404);
  EXPECT_EQ(curl("-H 'Authorization: Bearer " + reader + "' " + server_.base() + "/v1/datasets/" + id)["id"], id);
  EXPECT_THAT(server_.log(), testing::Not(HasSubstr(writer))) << "a token is in the log";
  EXPECT_THAT(file_text(folder_.path() / "data" / "audit.jsonl"),
              HasSubstr("\"who\":\"ci\",\"client\":\"127.0.0.1\",\"method\":\"POST\""));
}

TEST_F(Operator, TokenTellsWhatItNeeds) {
  for (const std::string arguments : {"", "new", "new --name a", "new --role write", "new --name a/b --role write",
                                      "new --name a --role owner", "old --name a --role read"}) {
    const Ended ended = shell(kProgram + " token " + arguments);
    EXPECT_EQ(ended.code, 2) << arguments << ended.output;
    EXPECT_THAT(ended.output, testing::Not(HasSubstr("cdl_")));
  }
  EXPECT_EQ(shell(kProgram + " token new --name a --role read --file /nowhere/at/all").code, 1);
}

TEST_F(Operator, ATokenThatNobodyHasSeenIsNotValid) {
  const std::string file = (folder_.path() / "tokens").string();
  for (const std::string lost : {" >/dev/full", " >&-"}) {
    const Ended ended = shell(kProgram + " token new --name a --role admin --file " + file + lost);
    EXPECT_EQ(ended.code, 1) << lost;
    EXPECT_THAT(ended.output, testing::StartsWith("cordillera: not all of the output could be written to stdout")) << lost;
    EXPECT_EQ(file_text(file), "") << lost;
  }
}

TEST_F(Operator, AnOpenPortTakesTokens) {
  const Ended refused = shell(kProgram + " serve --listen 0.0.0.0:0 --data " + (folder_.path() / "open").string());
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.output, HasSubstr("--tokens"));
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "open"));
  const Ended bad = shell(kProgram + " serve --token-lines 'a write sha256:0:0' --data " + (folder_.path() / "open").string());
  EXPECT_EQ(bad.code, 1);
  EXPECT_THAT(bad.output, HasSubstr("line 1"));
}

TEST_F(Operator, ABuildIsEndedInTime) {
  const std::string large = (folder_.path() / "large.asc").string();
  write_large(large);
  server_.start(folder_.path(), {"--max-build-time", "8"});
  const Json answer = post_and_wait(large, "&quality=best&threads=1&error=0.5");
  EXPECT_EQ(answer["type"], "urn:cordillera:problem:build-time-limit") << answer.dump();
  EXPECT_EQ(answer["status"], 422);
  EXPECT_EQ(post_and_wait(raster_)["state"], "ready");
  const PrometheusText text = read_prometheus(shell("curl -q -s " + server_.base() + "/metrics").output);
  EXPECT_THAT(text.wrong, testing::IsEmpty());
  EXPECT_EQ(text.sum("cordillera_problems_total", {{"type", "build-time-limit"}}), 1);
  EXPECT_EQ(text.sum("cordillera_build_blocks_total"), 1);
  EXPECT_GT(text.sum("cordillera_build_samples_total"), 4096);
  EXPECT_GE(text.sum("cordillera_http_connections"), 1);
  EXPECT_GT(text.sum("cordillera_http_sent_bytes_total"), 100);
}

TEST_F(Operator, RastersBeyondTheLimitsAreNotBuilt) {
  const std::string large = (folder_.path() / "large.asc").string();
  write_large(large);
  server_.start(folder_.path(), {"--max-megapixels", "1", "--max-side", "1300"});
  const Json pixels = post_and_wait(large);
  EXPECT_EQ(pixels["type"], "urn:cordillera:problem:raster-too-large") << pixels.dump();
  EXPECT_EQ(pixels["accepted"], "at most 1 million pixels");
  EXPECT_EQ(curl(server_.base() + "/v1/limits")["limits"]["max_side"]["value"], 1300);
  server_.end(SIGTERM);
  server_.start(folder_.path(), {"--max-side", "63"});
  const Json side = post_and_wait(raster_);
  EXPECT_EQ(side["accepted"], "at most 63 along a side") << side.dump();
  EXPECT_EQ(post_and_wait(raster_, "&dry_run=1")["accepted"], "at most 63 along a side");
}

TEST_F(Operator, DoctorFindsAFitMachineFit) {
  const std::string data = " --data " + (folder_.path() / "data").string();
  const Ended plain = shell(kProgram + " doctor --listen 127.0.0.1:0" + data);
  EXPECT_EQ(plain.code, 0) << plain.output;
  EXPECT_THAT(plain.output, HasSubstr("fit to serve"));
  const Json report = Json::parse(shell(kProgram + " doctor --json --listen 127.0.0.1:0" + data).output, nullptr, false);
  EXPECT_EQ(report["fit"], true) << report.dump(1);
  std::map<std::string, std::string> health;
  for (const Json& check : report["checks"]) health[check["name"]] = check["health"];
  for (const char* name : {"disk", "data", "port", "access", "GDAL", "PROJ", "EGM96", "build"})
    EXPECT_EQ(health[name], "good") << report.dump(1);
  EXPECT_TRUE(health.contains("sandbox")) << report.dump(1);  // good or a warning: the kernel's
  EXPECT_FALSE(std::filesystem::exists(folder_.path() / "data"));
}

TEST_F(Operator, DoctorFindsWhatIsWrong) {
  start_server();
  std::ofstream(folder_.path() / "file") << "no folder";
  struct Row {
    std::string arguments, check;
  };
  const std::string fine = " --listen 127.0.0.1:0 --data " + (folder_.path() / "new").string();
  const std::vector<Row> rows = {{"--listen 127.0.0.1:" + std::to_string(server_.port()), "port"},
                                 {"--listen 192.0.2.1:0", "port"},
                                 {"--listen 0.0.0.0:0", "access"},
                                 {"--listen 127.0.0.1:0 --tokens /nowhere", "access"},
                                 {"--listen 127.0.0.1:0 --data " + (folder_.path() / "file").string(), "data"},
                                 {"--listen 127.0.0.1:0 --data " + folder_.path().string(), "data"},
                                 {"--listen 127.0.0.1:0 --data " + (folder_.path() / "data").string(), "data"},
                                 {"--mount a=/nowhere.sqlite" + fine, "mounts"},
                                 {"--live /nowhere" + fine, "live"},
                                 {"--audit-log /nowhere/log" + fine, "audit log"},
                                 {"--min-disk-free 100" + fine, "disk"},
                                 {"--device cuda:77" + fine, "GPU"},
                                 {"--max-level 3 --min-level 2 --bbox 100,10,101,11" + fine, ""}};
  for (const Row& row : rows) {
    const bool has_data = row.arguments.find("--data") != std::string::npos;
    const Ended ended = shell("cd " + folder_.path().string() + " && " + kProgram + " doctor --json " + row.arguments +
                              (has_data ? "" : " --data " + (folder_.path() / "new").string()) + " 2>/dev/null");
    const Json report = Json::parse(ended.output, nullptr, false);
    EXPECT_EQ(ended.code, row.check.empty() ? 0 : 1) << row.arguments << ended.output;
    for (const Json& check : report["checks"]) {
      if (check["name"] != row.check) continue;
      EXPECT_EQ(check["health"], "bad") << row.arguments << check.dump();
      EXPECT_FALSE(check.value("advice", "").empty()) << check.dump();
    }
  }
  // A machine without PROJ's database knows no CRS, and builds nothing.
  const Ended blind = shell("PROJ_LIB=/nowhere PROJ_DATA=/nowhere " + kProgram + " doctor --json" + fine);
  EXPECT_EQ(blind.code, 1) << blind.output;
}

TEST_F(Operator, DoctorAsksWhatServeAsks) {
  start_server();
  EXPECT_EQ(post_and_wait(raster_)["state"], "ready");
  server_.end(SIGTERM);
  const std::filesystem::path data = folder_.path() / "data", registry = data / "registry.sqlite", kept = folder_.path() / "kept";
  std::filesystem::copy_file(registry, kept);
  const auto doctor = [&] {
    return shell(kProgram + " doctor --json --listen 127.0.0.1:0 --data " + data.string() + " 2>/dev/null");
  };
  const auto data_of = [](const Ended& ended) {
    const Json report = Json::parse(ended.output, nullptr, false);
    for (const Json& check : report["checks"])
      if (check["name"] == "data") return check;
    return Json();
  };
  EXPECT_EQ(doctor().code, 0);
  const std::pair<const char*, std::function<void()>> kTroubles[] = {
      {"a later version",
       [&] { pipeline::Database(registry.string(), pipeline::Database::Mode::create).execute("PRAGMA user_version = 99"); }},
      {"missing", [&] { std::filesystem::remove(registry); }},
      {"no database", [&] { std::ofstream(registry) << std::string(5000, 'x'); }},
  };
  for (const auto& [what, spoil] : kTroubles) {
    spoil();
    const Ended ended = doctor();
    EXPECT_EQ(ended.code, 1) << what << ended.output;
    const Json found = data_of(ended);
    EXPECT_EQ(found["health"], "bad") << what << ended.output;
    EXPECT_FALSE(found.value("advice", "").empty()) << what;
    const Ended served = shell("timeout 60 " + kProgram + " serve --listen 127.0.0.1:0 --data " + data.string());
    EXPECT_EQ(served.code, 1) << what << served.output;
    EXPECT_THAT(served.output, HasSubstr(std::string(found["what"]))) << what;
    std::filesystem::copy_file(kept, registry, std::filesystem::copy_options::overwrite_existing);
  }
  pipeline::Database(registry.string(), pipeline::Database::Mode::create).execute("UPDATE datasets SET private = '1'");
  EXPECT_THAT(doctor().output, HasSubstr("only this machine reads what is private (1 dataset)"));
  std::filesystem::remove_all(data / "incoming");
  std::ofstream(data / "incoming") << "no folder: root may write into any";
  EXPECT_EQ(data_of(doctor())["health"], "bad");
}

TEST_F(Operator, DoctorSaysWhereItCannotBuild) {
  const Ended ended =
      shell("TMPDIR=/nowhere " + kProgram + " doctor --listen 127.0.0.1:0 --data " + (folder_.path() / "new").string());
  EXPECT_EQ(ended.code, 1) << ended.output;
  EXPECT_THAT(ended.output, testing::Not(HasSubstr("description")));
  EXPECT_THAT(ended.output, HasSubstr("TMPDIR"));
}

/// With a library that plays the driver's in its place.
TEST_F(Operator, GpuMemoryIsAskedOfTheDriver) {
  setenv("LD_LIBRARY_PATH", CORDILLERA_FAKE_NVML, 1);
  start_server();
  const PrometheusText text = read_prometheus(shell("curl -q -s " + server_.base() + "/metrics").output);
  const auto ask = [&](const std::string& visible) {
    return shell(visible + kProgram + " doctor --listen 127.0.0.1:0 --data " + (folder_.path() / "new").string());
  };
  const Ended doctor = ask(""), hidden = ask("CUDA_VISIBLE_DEVICES= "), missing = ask("CUDA_VISIBLE_DEVICES=77 ");
  unsetenv("LD_LIBRARY_PATH");
  EXPECT_THAT(text.wrong, testing::IsEmpty());
  EXPECT_EQ(text.sum("cordillera_gpu_memory_bytes", {{"gpu", "0"}, {"kind", "total"}}), 1000.0 * (1 << 20));
  EXPECT_EQ(text.sum("cordillera_gpu_memory_bytes", {{"gpu", "0"}, {"kind", "used"}}), 250.0 * (1 << 20));
  EXPECT_THAT(doctor.output, HasSubstr("Played GPU, driver 1.2.3, 750 of 1000 MiB free"));
  // Advice that helps: the card may not be used, whatever the machine has.
  if (hidden.output.find("was built without CUDA") != std::string::npos) {
    EXPECT_THAT(hidden.output, HasSubstr("-> a build of the program with CUDA;"));
    EXPECT_THAT(hidden.output, testing::Not(HasSubstr("CUDA_VISIBLE_DEVICES")));
  } else {
    EXPECT_THAT(hidden.output,
                HasSubstr("-> a newer driver, memory of the GPU that is free, or another CUDA_VISIBLE_DEVICES, which is \"\";"));
    EXPECT_THAT(missing.output, HasSubstr("CUDA_VISIBLE_DEVICES, which is \"77\";"));
    EXPECT_THAT(hidden.output, testing::Not(HasSubstr("a build of the program")));
  }
}

}  // namespace
}  // namespace cordillera::server
