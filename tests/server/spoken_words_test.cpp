// What people type from habit: understood, or answered with the right word.
#include "server/options/spoken_words.h"

#include <gmock/gmock.h>

#include "program_fixture.h"
#include "server/options/options.h"

namespace cordillera::server {
namespace {

namespace fs = std::filesystem;
using testing::ElementsAre;
using testing::HasSubstr;

TEST(SpokenWords, HelpVersionAndFourWordsOfABox) {
  EXPECT_THAT(understood({"help"}), ElementsAre("--help"));
  EXPECT_THAT(understood({"help", "build"}), ElementsAre("build", "--help"));
  EXPECT_THAT(understood({"help", "build", "--all"}), ElementsAre("build", "--help-all"));
  for (const char* word : {"version", "-v", "-V"}) EXPECT_THAT(understood({word}), ElementsAre("--version"));
  EXPECT_THAT(understood({"build", "version", "-v"}), ElementsAre("build", "version", "-v")) << "a raster may be called so";
  EXPECT_THAT(understood({"build", "--bbox", "-71.5", "44", "-71", "45", "dem.tif"}),
              ElementsAre("build", "--bbox", "-71.5,44,-71,45", "dem.tif"));
  EXPECT_THAT(understood({"build", "--bbox", "1,", "2,", "3,", "4"}), ElementsAre("build", "--bbox", "1,2,3,4"));
  EXPECT_THAT(understood({"build", "--bbox", "1,2,3,4", "5", "6", "7"}),
              ElementsAre("build", "--bbox", "1,2,3,4", "5", "6", "7"));
  EXPECT_THAT(understood({"build", "--bbox", "1", "2", "3", "dem.tif"}),
              ElementsAre("build", "--bbox", "1", "2", "3", "dem.tif"));
  EXPECT_THAT(understood({}), ElementsAre());
}

TEST(SpokenWords, TwoDashesEndTheOptions) {
  EXPECT_THAT(understood({"build", "a.tif", "-q", "--", "-b.tif", "c.tif", "--", "-"}),
              ElementsAre("build", "a.tif", "-q", "./-b.tif", "c.tif", "./--", "-"));
  EXPECT_THAT(understood({"info", "--"}), ElementsAre("info"));
}

TEST(SpokenWords, OptionsInMessagesAreSpeltAsTyped) {
  EXPECT_EQ(as_typed("z_scale= for another unit (z_scale=0.001 for millimetres), or nodata= for a value"),
            "--z-scale for another unit (--z-scale=0.001 for millimetres), or --nodata for a value");
  EXPECT_EQ(as_typed("vertical_datum=EGM96, a finer max_level, or frame=enu"),
            "--vertical-datum=EGM96, a finer --max-level, or --frame=enu");
  EXPECT_EQ(as_typed("error and keep are two ways; a coarser error= or a bbox="),
            "error and keep are two ways; a coarser --error or a --bbox");
  EXPECT_EQ(as_typed("max_level"), "--max-level");
  for (const char* same : {"", "--error='x': no number", "/v1/live?url=A&error=5", "lsm=landlock, KEY=value", "a/z_scale=2.tif",
                           "the name of a raster", "my_error=5", "water_mask.tif names no CRS", "x nodata=7.tif (voids=hole.asc)",
                           "`gdalmdimtranslate in.nc out.nc -array name=z`"})
    EXPECT_EQ(as_typed(same), same);
}

TEST(SpokenWords, OptionsOfOtherProgramsAreKnown) {
  for (const char* word : {"epsg", "--t_srs", "-a_srs", "SRS"}) EXPECT_EQ(meant_by_habit(word), "crs") << word;
  EXPECT_EQ(meant_by_habit("--units"), "z-scale");
  EXPECT_EQ(meant_by_habit("--bind"), "listen");
  EXPECT_EQ(meant_by_habit("--output-dir"), "output");
  EXPECT_EQ(meant_by_habit("min_zoom"), "min-level");
  for (const char* word : {"", "--", "eror", "z", "crs"}) EXPECT_EQ(meant_by_habit(word), std::nullopt) << word;
  const auto names = build_options();
  for (const char* word : {"epsg", "units", "zoom", "min-zoom", "tolerance", "ratio", "extent", "srcnodata", "fill", "geoid",
                           "copyright", "cores", "nodataValue", "tileDepth", "max", "min"}) {
    EXPECT_TRUE(std::any_of(names.begin(), names.end(), [&](const OptionSpec& option) {
      return option.name == meant_by_habit(word);
    })) << word;
  }
  const auto refused = with_layer({}, build_options(), {{"epsg", "4326"}}, Spelling::query);
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.problem().detail, "unknown query parameter 'epsg'; did you mean crs?");
}

TEST(SpokenWords, HostAndPortAreTheHalvesOfListen) {
  EXPECT_EQ(listen_address("", "9000"), "127.0.0.1:9000");
  EXPECT_EQ(listen_address("0.0.0.0", ""), "0.0.0.0:8080");
  EXPECT_EQ(listen_address("::1", "1"), "[::1]:1");
}

TEST(SpokenWords, ABoxInAnotherOrderIsToldTheRightOne) {
  const auto said = [](const std::string& box) {
    const auto settings = with_layer({}, build_options(), {{"bbox", box}}, Spelling::query);
    return settings ? "" : settings.problem().detail;
  };
  EXPECT_THAT(said("10,47,11,46"),
              HasSubstr("south is not below north; in the order west,south,east,north it may be 10,46,11,47"));
  EXPECT_THAT(said("6.2,49.9,5.8,49.6"), HasSubstr("may be 5.8,49.6,6.2,49.9")) << "not around the earth";
  EXPECT_THAT(said("179,-16,-179,-18"), HasSubstr("may be 179,-18,-179,-16")) << "over the antimeridian";
  EXPECT_THAT(said("44,-120,45,-119"), HasSubstr("may be -120,44,-119,45"));
  EXPECT_THAT(said("100,100,110,110"), testing::Not(HasSubstr("may be")));
  for (const char* box : {"10,46,11,47", "10 46 11 47", " 10\t46  11 47 ", "[10, 46, 11, 47]", "10, 46, 11, 47"})
    EXPECT_EQ(said(box), "") << box;
  EXPECT_THAT(said("10 46 11"), HasSubstr("3 numbers instead of 4"));
  EXPECT_THAT(said("[]"), HasSubstr("not a number"));
}

TEST_F(Program, WhatPeopleTypeFromHabitIsUnderstood) {
  const Ended bare = shell(kProgram);
  EXPECT_EQ(bare.code, 2);
  for (const char* command : {"serve", "build", "post", "fetch", "export"})
    EXPECT_THAT(bare.output, HasSubstr(std::string("\n  ") + command + " ")) << command;
  EXPECT_EQ(shell(kProgram + " help").code, 0);
  EXPECT_THAT(shell(kProgram + " help fetch").output, HasSubstr("--connections"));
  EXPECT_EQ(shell(kProgram + " -v").output, shell(kProgram + " --version").output);
  EXPECT_EQ(shell(kProgram + " version").code, 0);
  const Ended box = shell(build("--dry-run -z 8 --bbox 10.1 46.1 10.3 46.3"));
  EXPECT_EQ(box.code, 0) << box.output;
  EXPECT_THAT(box.output, HasSubstr("in levels 0 to 8"));
  EXPECT_THAT(shell(build("--dry-run --max-zoom 8")).output, HasSubstr("in levels 0 to 8"));
  EXPECT_THAT(shell(build("--dry-run -z 8 --max-level 9")).output, HasSubstr("--max-level is given twice"));
  const Ended turned = shell(build("--dry-run --bbox 46.1,10.1,46.3,10.3"));
  EXPECT_EQ(turned.code, 1);
  EXPECT_THAT(turned.output, HasSubstr("in the order west,south,east,north it would: 10.1,46.1,10.3,46.3"));
  EXPECT_THAT(turned.output, HasSubstr("which lie in 10,46,10.5333,46.5333"));
  EXPECT_THAT(shell(build("--dry-run --bbox 1,2,3,4")).output, testing::Not(HasSubstr("in the order")));
  const Ended served =
      shell(kProgram + " serve --host 192.0.2.1 -p 0 --insecure-writes --data " + (folder_.path() / "data").string());
  EXPECT_EQ(served.code, 1) << served.output;
  EXPECT_THAT(served.output, HasSubstr("192.0.2.1:0"));
  EXPECT_EQ(shell(kProgram + " serve --port 0 --listen 127.0.0.1:0").code, 2);
  EXPECT_EQ(shell(kProgram + " serve --port x").code, 2);
}

TEST_F(Program, CurlMayPostAsItIsTyped) {
  start_server();
  fs::copy_file(raster_, folder_.path() / "h\xc3\xb6he.asc");
  const std::string collection = server_.base() + "/v1/datasets", options = "crs=EPSG:4326&vertical_datum=ellipsoid&max_level=8";
  const std::string file = (folder_.path() / "h\xc3\xb6he.asc").string();
  const Json ways[] = {curl("-H 'Prefer: wait=300' -F file=@" + file +
                            " -F crs=EPSG:4326 -F vertical_datum=ellipsoid -F max_level=8 " + collection),
                       curl("-H 'Prefer: wait=300' -T " + file + " '" + collection + "?name=h%C3%B6he.asc&" + options + "'"),
                       curl("-H 'Prefer: wait=300' -F max_level=8 -F file=@" + file + " '" + collection +
                            "/?crs=EPSG:4326&vertical_datum=ellipsoid'")};
  for (const Json& posted : ways) {
    EXPECT_EQ(posted["state"], "ready") << posted.dump();
    EXPECT_EQ(posted["name"], "h\xc3\xb6he.asc");
    const std::string tile = "/tiles/8/270/193.drc";
    const auto bytes = [&](const Json& dataset) {
      return shell("curl -q -sf " + collection + "/" + std::string(dataset["id"]) + tile + " | sha256sum").output;
    };
    EXPECT_EQ(bytes(posted), bytes(ways[0])) << "other tiles";
    EXPECT_NE(bytes(posted), shell("true | sha256sum").output) << "no such tile";
  }
  Json put = curl("-T " + file + " " + collection + "/");  // the name is curl's doing; without a crs it fails as a build
  EXPECT_EQ(put["name"], "h\xc3\xb6he.asc") << put.dump();
  EXPECT_EQ(curl("-L " + collection + "/")["datasets"].size(), 4u);
}

TEST_F(Program, ShellsAndManKnowEveryOption) {
  const std::string bash = shell(kProgram + " completion bash").output, zsh = shell(kProgram + " completion zsh").output,
                    fish = shell(kProgram + " completion fish").output, man = shell(kProgram + " man").output;
  for (const OptionSpec& option : all_options()) {
    for (const std::string* text : {&bash, &zsh}) EXPECT_THAT(*text, HasSubstr("--" + option.name)) << text->substr(0, 40);
    EXPECT_THAT(fish, HasSubstr(" -l " + option.name + " "));
    std::string escaped = "--" + option.name;
    for (auto at = escaped.find('-'); at != escaped.npos; at = escaped.find('-', at + 2)) escaped.insert(at, "\\");
    EXPECT_THAT(man, HasSubstr("\n.B " + escaped));
  }
  EXPECT_THAT(man, HasSubstr(".SS cordillera fetch\n"));
  EXPECT_THAT(man, testing::Not(HasSubstr("cordillera job"))) << "what only the service calls";
  EXPECT_EQ(shell(kProgram + " completion tcsh").code, 2);
  const std::string script = (folder_.path() / "complete").string();
  std::ofstream(script) << bash << "COMP_WORDS=(cordillera build --err)\nCOMP_CWORD=2\n_cordillera\necho \"${COMPREPLY[@]}\"\n"
                        << "COMP_WORDS=(cordillera fe)\nCOMP_CWORD=1\n_cordillera\necho \"${COMPREPLY[@]}\"\n";
  EXPECT_EQ(shell("bash -eu " + script).output, "--error\nfetch\n");
  if (shell("command -v zsh").code == 0) {
    std::ofstream(script) << zsh;
    EXPECT_EQ(shell("zsh -n " + script).code, 0);
  }
  if (shell("command -v fish").code == 0) {
    std::ofstream(script) << fish;
    EXPECT_EQ(shell("fish -n " + script).code, 0);
  }
}

TEST_F(Program, MapsOfThePolesAreRefusedBeforeTheyAreBuilt) {
  const std::string polar = (folder_.path() / "polar.asc").string(), out = (folder_.path() / "polar").string();
  std::ofstream(polar) << "ncols 2\nnrows 2\nxllcorner 10\nyllcorner 86\ncellsize 0.1\n1 2\n3 4\n";
  const std::string build = kProgram + " build " + polar + " --crs EPSG:4326 --vertical-datum ellipsoid --dry-run -o " + out;
  for (const char* maps : {".mbtiles", ".pmtiles", " --formats 3d-tiles,terrain-rgb", " --formats contours"}) {
    const Ended refused = shell(build + maps);
    EXPECT_EQ(refused.code, 1) << maps << refused.output;
    EXPECT_THAT(refused.output, HasSubstr("beyond 85.05 degrees")) << maps;
  }
  for (const char* not_maps : {".sqlite", ".3tz", ".pmtiles --formats drc", " --formats drc,3d-tiles"})
    EXPECT_EQ(shell(build + not_maps).code, 0) << not_maps;
}

TEST_F(Program, NodataThatNobodyDeclaredContradictsNoVoids) {
  const std::string plain = (folder_.path() / "plain.asc").string();
  std::ofstream(plain) << "ncols 3\nnrows 2\nxllcorner 10\nyllcorner 46\ncellsize 0.1\n1 2 3\n4 5 6\n";
  const std::string options = " --crs EPSG:4326 --vertical-datum ellipsoid";
  EXPECT_THAT(shell(kProgram + " info " + plain + options).output, HasSubstr("\nnodata    none declared\n"));
  const Ended built = shell(kProgram + " build " + plain + options + " -o " + (folder_.path() / "plain.sqlite").string());
  EXPECT_THAT(built.output, HasSubstr("\nnodata    none declared; 0.00 % of the lattice has no height\n"));
  EXPECT_THAT(built.output, HasSubstr("\nbbox      10.00000,46.00000,10.30000,46.20000 (west, south, east, north), pixels of "));
}

TEST_F(Program, InfoOfARasterIsADryRun) {
  const std::string raster = std::string(CORDILLERA_SOURCE_DIR) + "/deploy/sample/white_mountains_srtm3.tif";
  const Ended table = shell(kProgram + " info " + raster);
  EXPECT_EQ(table.code, 0) << table.output;
  EXPECT_THAT(table.output, HasSubstr("960 x 540 Int16, GTiff"));
  EXPECT_THAT(table.output, HasSubstr("dry run: nothing was built"));
  EXPECT_THAT(table.output,
              HasSubstr("\nbbox      -71.85000,44.05083,-71.05083,44.50000 (west, south, east, north), pixels of "));
  EXPECT_THAT(table.output, HasSubstr("\nvalues    141.00 to 1908.00 m above EGM96, no voids, at all pixels\n"));
  Json json = Json::parse(shell(kProgram + " info --json " + raster).output, nullptr, false);
  EXPECT_EQ(json["dry_run"], true) << json.dump();
  EXPECT_EQ(json["manifest"]["max_level"], 10);
  const std::string points = (folder_.path() / "dgm1.xyz").string();
  {
    std::ofstream out(points);
    for (int k = 0; k < 400; ++k) out << 356000 + k % 20 << ".5 " << 5699000 + k / 20 << ".5 " << 90 + k % 7 << "\n";
  }
  EXPECT_THAT(shell(kProgram + " info " + points).output, HasSubstr("or --crs, "));
  const Ended placed = shell(kProgram + " info " + points + " --crs EPSG:25832 --vertical-datum ellipsoid");
  EXPECT_EQ(placed.code, 0) << placed.output;
  EXPECT_THAT(placed.output, HasSubstr("(EPSG:25832) (request)"));
  std::filesystem::create_directory(folder_.path() / "many");
  for (const char* name : {"a.tif", "b.tif"}) std::filesystem::copy_file(raster, folder_.path() / "many" / name);
  const std::string many = (folder_.path() / "many").string();
  const Ended two = shell(kProgram + " info " + many);
  EXPECT_THAT(two.output, HasSubstr("source    2 rasters: each 960 x 540"));
  EXPECT_THAT(two.output, HasSubstr("\nvalues    141.00 to 1908.00 m above EGM96, no voids, at "));
  std::ofstream(folder_.path() / "bad.tif") << "no raster";
  std::filesystem::copy_file(folder_.path() / "bad.tif", folder_.path() / "many" / "c.tif");
  EXPECT_EQ(shell(kProgram + " info " + many).code, 1);
  EXPECT_THAT(shell(kProgram + " info --skip-bad " + many).output, HasSubstr("source    2 rasters: each 960 x 540"));
  const Ended viewed = shell(kProgram + " view " + many + " 2>&1");
  EXPECT_EQ(viewed.code, 1);
  EXPECT_THAT(viewed.output, HasSubstr("cordillera build " + many + " -o "));
  EXPECT_EQ(shell(kProgram + " info " + (folder_.path() / "bad.tif").string()).code, 1);
}

}  // namespace
}  // namespace cordillera::server
