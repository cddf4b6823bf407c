// Options of the whole program: through which door they come, what they change in what is built, what the manifest says of them.
#include <gmock/gmock.h>

#include <algorithm>
#include <cctype>
#include <cmath>

#include "program_fixture.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

/// Options of a whole build, and what the manifest then says of all.
const std::vector<std::pair<std::string, std::string>> kChosen = {{"name", "mount.asc"},
                                                                  {"band", "1"},
                                                                  {"error", "20"},
                                                                  {"crs", "EPSG:4326"},
                                                                  {"vertical-datum", "EGM96"},
                                                                  {"nodata", "-32767"},
                                                                  {"voids", "fill"},
                                                                  {"fill-limit", "300"},
                                                                  {"strategy", "cleap"},
                                                                  {"device", "cpu"},
                                                                  {"threads", "1"},
                                                                  {"memory", "512"},
                                                                  {"bbox", "10.1,46.1,10.4,46.4"},
                                                                  {"min-level", "2"},
                                                                  {"max-level", "9"},
                                                                  {"z-scale", "2"},
                                                                  {"z-offset", "100"},
                                                                  {"title", "Mount"},
                                                                  {"attribution", "me"},
                                                                  {"quality", "best"},
                                                                  {"pixels", "exact"},
                                                                  {"water", "-5"}};
constexpr const char* kEffective =
    R"({"name":"mount.asc","band":"1","error":20,"feather":0,"keep":[],"crs":"EPSG:4326",)"
    R"("vertical_datum":"EGM96","voids":"fill",)"
    R"("strategy":"cleap","device":"cpu","threads":1,"memory":512,"bbox":[10.1,46.1,10.4,46.4],"min_level":2,"max_level":9,)"
    R"("z_scale":2,)"
    R"("z_offset":100,"title":"Mount","attribution":"me","imagery":"","nodata":"-32767",)"
    R"("quality":"best","water":-5,"water_mask":"","pixels":"exact","fill_limit":300,"warnings":[]})";

TEST_F(Program, EveryOptionWorksFromTheLineTheEnvironmentTheFileAndTheQuery) {
  std::string words, variables, query, lines;
  for (const auto& [name, value] : kChosen) {
    std::string under = name, upper;
    std::replace(under.begin(), under.end(), '-', '_');
    for (const char c : under) upper += static_cast<char>(std::toupper(c));
    words += " --" + name + " " + value;
    variables += "CORDILLERA_" + upper + "=" + value + " ";
    query += "&" + under + "=" + value;
    lines += name + " = " + value + "\n";
  }
  std::ofstream(folder_.path() / "conf") << lines;
  const std::string plain = kProgram + " build " + raster_, at = (folder_.path() / "by-").string();
  const auto expect = [](const Json& manifest, const std::string& door) {
    EXPECT_EQ(nlohmann::json(manifest["options"]), nlohmann::json::parse(kEffective)) << door;
    EXPECT_EQ(manifest["attribution"], "me") << door;
  };
  const std::pair<std::string, std::string> doors[] = {{"line", plain + words},
                                                       {"environment", variables + plain},
                                                       {"file", plain + " --config " + (folder_.path() / "conf").string()}};
  for (const auto& [door, command] : doors) {
    const Ended ended = shell(command + " -o " + at + door);
    ASSERT_EQ(ended.code, 0) << ended.output;
    expect(Json::parse(shell(kProgram + " info --json " + at + door).output), door);
  }
  start_server();
  const std::string address = server_.base() + "/v1/datasets?" + query.substr(1);
  Json posted = curl("-H 'Prefer: wait=400' --data-binary @" + raster_ + " '" + address + "'");
  ASSERT_EQ(posted["state"], "ready") << posted.dump();
  expect(curl(server_.base() + "/v1/datasets/" + std::string(posted["id"]) + "/manifest.json"), "query");
}

TEST_F(Program, TheManifestSaysWhatWasAssumed) {
  const std::string out = (folder_.path() / "out").string();
  ASSERT_EQ(shell(kProgram + " build " + raster_ + " --crs EPSG:4326 --max-level 8 --device cpu -o " + out).code, 0);
  Json manifest = Json::parse(shell(kProgram + " info --json " + out).output);
  Json options = manifest["options"];
  EXPECT_LE(options["error"], double(manifest["cell_m"]) / 4);
  EXPECT_GE(options["error"], double(manifest["cell_m"]) / 64);
  EXPECT_EQ(options["error"], manifest["levels"][0]["target"]);
  EXPECT_EQ(options["vertical_datum"], "EGM96");
  EXPECT_EQ(options["voids"], "fill");
  EXPECT_EQ(options["fill_limit"], 512);
  EXPECT_EQ(options["strategy"], "exact");
  EXPECT_FALSE(options.contains("scheme"));
  EXPECT_EQ(options["device"], "cpu");
  EXPECT_GT(options["threads"], 0);
  EXPECT_EQ(options["min_level"], 0);
  EXPECT_EQ(options["max_level"], 8);
  EXPECT_EQ(options["z_scale"], 1);
  EXPECT_EQ(options["z_offset"], 0);
  EXPECT_EQ(options["nodata"], "");
  EXPECT_EQ(options["quality"], "default");
}

TEST_F(Program, AValueMayBeDeclaredToBeNoData) {
  const auto source_of = [&](const std::string& arguments) {
    const std::string out = (folder_.path() / "out").string();
    const Ended ended = shell(build(arguments + " -q --overwrite --max-level 9 -o " + out));
    EXPECT_EQ(ended.code, 0) << ended.output;
    return Json::parse(shell(kProgram + " info --json " + out).output)["source"];
  };
  std::string text = cone();
  for (const char* word : {"NODATA_value -9999\n", "\n"}) {  // the line about it goes, and a corner of the data
    const auto at = text.find(word, word[0] == '\n' ? text.find("cellsize") + 10 : 0);
    text.replace(at, word[0] == '\n' ? text.find(' ', at) - at : std::string(word).size(), word[0] == '\n' ? "\n-8888" : "");
  }
  std::ofstream(raster_) << text;
  const Json as_it_is = source_of("");
  EXPECT_LT(as_it_is["min_height"], -7000) << "the test has no such value";
  Json declared = source_of("--source-nodata -8888");
  EXPECT_GT(declared["min_height"], 1000);
  EXPECT_GT(declared["nodata_share"], as_it_is["nodata_share"]);
  EXPECT_THAT(std::string(declared["nodata"]), HasSubstr("value -8888 (request)"));
  EXPECT_GT(source_of("--nodata -8888 --voids 1200")["min_height"], 1100) << "it is a hole like any other";
  EXPECT_LT(source_of("--source-nodata nan")["min_height"], -7000);
}

TEST_F(Program, TheRangeIsThatOfTheSamplesHoweverCoarseTheMesh) {
  const std::string out = (folder_.path() / "out").string();
  ASSERT_EQ(shell(build("--error 5000 --max-level 9 -o " + out)).code, 0);
  Json manifest = Json::parse(shell(kProgram + " info --json " + out).output);
  EXPECT_GT(manifest["source"]["max_height"], 2900);
  EXPECT_LT(manifest["levels"][0]["max_height"], 2800) << "the mesh keeps the summit: the test tests nothing";
}

TEST_F(Program, QualityBuysFewerTriangles) {
  std::ostringstream text;
  text << "ncols 400\nnrows 400\nxllcorner 10\nyllcorner 46\ncellsize 0.0027465820\n";
  for (int k = 0; k < 400 * 400; ++k)
    text << 500 + 300 * std::sin(k % 400 / 23.0) * std::cos(k / 400 / 19.0) + k * 7919 % 13 << (k % 400 == 399 ? '\n' : ' ');
  std::ofstream(raster_) << text.str();
  const auto manifest_of = [&](const std::string& quality) {
    const std::string out = (folder_.path() / quality).string();
    EXPECT_EQ(shell(build("-q --error 20 --min-level 6 --quality " + quality + " -o " + out)).code, 0);
    return Json::parse(shell(kProgram + " info --json " + out).output);
  };
  Json fast = manifest_of("fast"), usual = manifest_of("default"), best = manifest_of("best");
  EXPECT_GT(fast["triangles"], usual["triangles"]);
  EXPECT_GT(usual["triangles"], best["triangles"]);
  for (const Json& manifest : {fast, usual, best}) {
    for (const Json& level : manifest["levels"])
      EXPECT_LE(level["stated_max_error"], level["target"]) << manifest["options"]["quality"];
  }
  EXPECT_EQ(best["options"]["quality"], "best");
  const std::string out = (folder_.path() / "fast").string();
  EXPECT_EQ(shell(build("-q --error 20 --min-level 6 --quality best -o " + out)).code, 1) << "another quality is another build";
}

TEST_F(Program, AVariableThatNobodyReadsIsAWarning) {
  const Ended ended = shell("CORDILLERA_EROR=5 " + build("--dry-run --max-level 8"));
  EXPECT_EQ(ended.code, 0) << ended.output;
  EXPECT_THAT(ended.output, HasSubstr("cordillera: warning: the environment variable CORDILLERA_EROR"));
}

/// Two of one command line, as schedulers and impatient people start them.
TEST_F(Program, ABuildLeavesAloneWhatAnotherOneIsWriting) {
  for (const std::string name : {"out", "out.pmtiles"}) {
    const std::string out = (folder_.path() / name).string(), work = out + ".building";
    std::filesystem::create_directory(work);
    std::ofstream(work + "/theirs");
    const Ended refused = shell("flock " + work + ".lock " + build("-q --max-level 10 --overwrite -o " + out));
    EXPECT_EQ(refused.code, 1) << name;
    EXPECT_THAT(refused.output, HasSubstr("another process is writing " + out));
    EXPECT_TRUE(std::filesystem::exists(work + "/theirs"));
  }
}

/// As `doctor` says: the service runs without a viewer and without grids.
TEST_F(Program, ServeWarnsOfFoldersThatAreNamedAndNotThere) {
  const std::string none = (folder_.path() / "none").string();
  server_.start(folder_.path(), {"--web", none, "--geoids", folder_.path().string() + ":" + none + "/g"});
  EXPECT_THAT(server_.log(), HasSubstr("there is no viewer in " + none));
  EXPECT_THAT(server_.log(), HasSubstr("there is no folder " + none + "/g"));
  EXPECT_THAT(server_.log(), testing::Not(HasSubstr("there is no folder " + folder_.path().string() + ",")));
}

}  // namespace
}  // namespace cordillera::server
