// What `build` leaves in a place: what is replaced, continued or refused there, and what is in it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "program_fixture.h"
#include "tests/sanitized.h"

namespace cordillera::server {
namespace {

using testing::HasSubstr;

TEST_F(Program, AnotherBuildInThePlaceIsReplacedOnlyWhenAsked) {
  const std::string folder = (folder_.path() / "out").string();
  for (const std::string& out : {folder, folder + ".sqlite"}) {
    SCOPED_TRACE(out);
    const auto error_of = [&] { return Json::parse(shell(kProgram + " info --json " + out).output)["options"]["error"]; };
    ASSERT_EQ(shell(build("--max-level 10 --error 20 -o " + out)).code, 0);
    const Ended refused = shell(build("--max-level 10 --error 30 -o " + out));
    EXPECT_EQ(refused.code, 1);
    EXPECT_THAT(refused.output, HasSubstr("earlier build"));
    EXPECT_THAT(refused.output, HasSubstr("--overwrite"));
    EXPECT_EQ(error_of(), 20);
    EXPECT_EQ(shell(build("--max-level 10 --error 30 --overwrite -o " + out)).code, 0);
    EXPECT_EQ(error_of(), 30);
    EXPECT_EQ(shell(build("--max-level 10 --error 40 --force -o " + out)).code, 0);
    EXPECT_EQ(error_of(), 40);
  }
}

TEST_F(Program, AFinishedFileIsThereUntilTheOneThatReplacesItIsFinished) {
  const std::string out = (folder_.path() / "out.sqlite").string(), beside = out + ".building";
  ASSERT_EQ(shell(build("-q --max-level 10 --error 20 -o " + out)).code, 0);
  const auto old = file_text(out);
  const std::string slow = build("--error 0.01 --max-level 15 --threads 1 --overwrite -o " + out);
  for (int run = 0; run < 2; ++run) {
    EXPECT_THAT(interrupted_at("build", slow).output, HasSubstr("cancelled"));
    EXPECT_TRUE(file_text(out) == old);
    ASSERT_TRUE(std::filesystem::exists(beside));
    if (run == 0) std::filesystem::create_hard_link(beside, folder_.path() / "first");
  }
  EXPECT_TRUE(std::filesystem::equivalent(beside, folder_.path() / "first")) << "the same line goes on";
  EXPECT_EQ(shell("flock " + beside + ".lock " + slow).code, 1) << "one process at a time";
  std::ofstream(out + "-wal") << "a log of the old file";
  EXPECT_EQ(shell(build("-q --error 30 --max-level 10 --overwrite -o " + out)).code, 0);
  EXPECT_EQ(Json::parse(shell(kProgram + " info --json " + out).output)["options"]["error"], 30);
  for (const char* left : {".building", ".building-meshes", ".building-wal", ".building.lock", "-wal"})
    EXPECT_FALSE(std::filesystem::exists(out + left)) << left;
}

TEST_F(Program, TextsOfPointsInAFolderAreToldOf) {
  const auto tiles = folder_.path() / "tiles";
  std::filesystem::create_directory(tiles);
  std::filesystem::copy(raster_, tiles / "cone.asc");
  std::ofstream(tiles / "README.txt") << "Read me first.\n";
  std::ofstream(tiles / "DGM1.txt") << "10 47 5\n10.1 47 5\n10 46.9 5\n10.1 46.9 5\n";
  raster_ = tiles.string();
  const std::string out = (folder_.path() / "out.sqlite").string();
  const Ended built = shell(build("--error 20 --max-level 10 -q -o " + out));
  EXPECT_EQ(built.code, 0) << built.output;
  EXPECT_THAT(built.output, HasSubstr("warning: DGM1.txt looks like points and was not taken with the folder"));
  EXPECT_THAT(Json::parse(shell(kProgram + " info --json " + out).output)["notes"].dump(),
              HasSubstr("DGM1.txt looks like points"));
}

TEST_F(Program, OneBadRasterAmongOthersIsLeftOutWhenAsked) {
  const std::string out = (folder_.path() / "out.sqlite").string(), bad = (folder_.path() / "bad.tif").string();
  std::ofstream(bad) << "II*";
  const std::string line = build(bad + " --error 20 --max-level 10 -q -o " + out);
  const Ended refused = shell(line);
  EXPECT_EQ(refused.code, 1);
  EXPECT_THAT(refused.output, HasSubstr("bad.tif"));
  EXPECT_FALSE(std::filesystem::exists(out));
  const Ended built = shell(line + " --skip-bad");
  EXPECT_EQ(built.code, 0) << built.output;
  EXPECT_THAT(built.output, HasSubstr("left out: " + bad));
  const Json manifest = Json::parse(shell(kProgram + " info --json " + out).output);
  EXPECT_EQ(manifest["sources"].size(), 1u);
  EXPECT_THAT(manifest["notes"].dump(), testing::ContainsRegex("bad.tif was left out, for it cannot be used .raster-"));
}

/// What would be ignored, or is another thing than it seems.
TEST_F(Program, OutputsThatCannotBeMeantAreRefused) {
  const std::string folder = (folder_.path() / "out").string();
  const std::pair<std::string, std::string> rows[] = {
      {"-o " + folder + ".png", "build writes no such file"},
      {"-o " + folder + ".json", "build writes no such file"},
      {"--formats terrain-rgb --normals texture -o " + folder, "--normals is for 3D Tiles"},
      {"--formats drc,relief --texture /nowhere.tif -o " + folder, "--texture is for 3D Tiles"}};
  for (const auto& [words, said] : rows) {
    const Ended refused = shell(build("--max-level 10 --error 20 " + words));
    EXPECT_EQ(refused.code, 2) << words << refused.output;
    EXPECT_THAT(refused.output, HasSubstr(said));
    EXPECT_FALSE(std::filesystem::exists(folder));
  }
  EXPECT_EQ(shell(build("--max-level 10 --error 20 --formats 'drc, 3d-tiles' -q -o " + folder)).code, 0);
}

TEST_F(Program, AnUnfinishedBuildGoesOnOnlyWithTheSameRasterAndOptions) {
  const std::string out = (folder_.path() / "out").string(), error = " --error 0.01 --max-level 15 --threads 1 -o " + out;
  const auto stopped = [&] { return interrupted_at("build", build(error)); };
  const Ended first = stopped();
  EXPECT_EQ(first.code, 1);
  EXPECT_THAT(first.output, HasSubstr("cancelled; the same line goes on from what was built"));
  ASSERT_TRUE(std::filesystem::exists(out + ".building")) << first.output;
  const Ended other = shell(build("--error 30 --max-level 10 -o " + out));
  EXPECT_EQ(other.code, 1);
  EXPECT_THAT(other.output, HasSubstr("another raster or with other options"));
  EXPECT_THAT(other.output, HasSubstr("--overwrite"));
  ASSERT_TRUE(std::filesystem::exists(out + ".building")) << "a refusal throws nothing away";
  EXPECT_THAT(stopped().output, HasSubstr("cancelled")) << "the same line goes on";
  std::ofstream(folder_.path() / "cone.asc", std::ios::app) << "\n";
  EXPECT_THAT(stopped().output, HasSubstr("another raster")) << "the file has changed since";
  EXPECT_EQ(shell(build("--error 30 --max-level 10 --overwrite -o " + out)).code, 0);
}

TEST_F(Program, BuildsAFolderThatInfoReads) {
  const std::string out = (folder_.path() / "out").string();
  std::ofstream(folder_.path() / "conf") << "error = 50\ntitle = from the file\n";
  const std::string conf = " --config " + (folder_.path() / "conf").string();
  const Ended built = shell("CORDILLERA_TITLE='from the environment' " + build("-o " + out + "/ --error 20" + conf));
  ASSERT_EQ(built.code, 0) << built.output;
  EXPECT_THAT(built.output, HasSubstr("max error m"));
  Json manifest = Json::parse(shell(kProgram + " info --json " + out).output);
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
  if (kSanitized) GTEST_SKIP() << "a sanitizer ends a process that gets no memory by itself";
  const std::string small = (folder_.path() / "small.sqlite").string();
  const Ended little = shell(build("-o " + small + " --memory 95"));
  EXPECT_EQ(little.code, 2) << little.output;
  EXPECT_THAT(little.output, HasSubstr("accepted: 0, or 96 to 16777216"));
  const Ended least = shell(build("-o " + small + " --memory 96"));
  EXPECT_EQ(least.code, 0) << least.output;
  // With more cores there are more arenas and threads: much of it has to be left.
  const Ended half = shell("ulimit -d 60000; " + build("-q -o " + (folder_.path() / "half.sqlite").string() + " --memory 96"));
  EXPECT_EQ(half.code, 0) << half.output;
  // Blocks of many samples, which an even slope makes quick work of.
  std::ofstream grid(folder_.path() / "cone.asc");
  grid << "ncols 2400\nnrows 2400\nxllcorner 10\nyllcorner 46\ncellsize 0.0008333333333333\nNODATA_value -9999\n";
  for (int k = 0; k < 2400 * 2400; ++k) grid << k % 2400 << (k % 2400 == 2399 ? '\n' : ' ');
  grid.close();
  const std::string output = (folder_.path() / "out.sqlite").string();
  const Ended starved = shell(build("-o " + output + " --error 1000 --threads 2 --memory 96"));
  EXPECT_EQ(starved.code, 1) << starved.output;
  EXPECT_THAT(starved.output, HasSubstr("memory=96 MiB"));
  EXPECT_THAT(starved.output, HasSubstr("accepted: more memory"));
  EXPECT_EQ(shell(kProgram + " info " + output).code, 1) << "not finished, and says so";
  const Ended fed = shell(build("-o " + output + " --error 1000 --threads 2 --memory 2048"));
  EXPECT_EQ(fed.code, 0) << fed.output;
  EXPECT_EQ(shell(kProgram + " info " + output).code, 0);
}

}  // namespace
}  // namespace cordillera::server
