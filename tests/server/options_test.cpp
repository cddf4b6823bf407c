// The one table of options, through every door that leads to it.
#include "server/options/options.h"
#include "server/options/option_groups.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>

#include "fixture.h"
#include "server/options/request_policy.h"

namespace cordillera::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

proto::Result<Settings> query(const Given& given) { return with_layer({}, build_options(), given, Spelling::query); }

TEST(Options, EveryNameOfTheIssueIsThereOnce) {
  std::set<std::string> names;
  for (const OptionSpec& option : build_options()) EXPECT_TRUE(names.insert(option.name).second) << option.name;
  for (const char* name :
       {"error", "keep",      "crs",       "vertical-datum", "nodata",     "strategy", "device",      "threads", "memory",
        "bbox",  "min-level", "max-level", "z-scale",        "z-offset",   "title",    "attribution", "imagery", "dry-run",
        "name",  "quality",   "pixels",    "voids",          "fill-limit", "water",    "water-mask",  "band"}) {
    EXPECT_EQ(names.count(name), 1u) << name;
  }
  for (const OptionSpec& option : all_options()) {
    EXPECT_FALSE(option.help.empty()) << option.name;
    EXPECT_FALSE(option.accepted.empty()) << option.name;
  }
}

TEST(Options, AutoTakesTheStrategyOfAServiceBack) {
  Settings server;
  server.build.set_strategy("cleap");
  const auto settings = with_layer(server, build_options(), {{"strategy", "auto"}}, Spelling::query);
  ASSERT_TRUE(settings);
  EXPECT_EQ(settings->build.strategy(), "auto");
  proto::BuildOptions options = settings->build;
  EXPECT_FALSE(apply_policy(server, options)) << "auto is no name that a simplifier has";
}

TEST(Options, OneOptionHasFourSpellings) {
  EXPECT_EQ(spelt("vertical-datum", Spelling::query), "vertical_datum");
  EXPECT_EQ(spelt("vertical-datum", Spelling::command_line), "--vertical-datum");
  EXPECT_EQ(spelt("vertical-datum", Spelling::config_file), "vertical-datum");
  EXPECT_EQ(spelt("vertical-datum", Spelling::environment), "CORDILLERA_VERTICAL_DATUM");
}

TEST(Options, EveryValueArrivesInItsField) {
  const auto settings = query({{"error", "2.5"},      {"crs", "EPSG:32632"},     {"vertical_datum", "egm2008"},
                               {"nodata", "-9999"},   {"strategy", "cleap"},     {"device", "CUDA:1"},
                               {"threads", "4"},      {"memory", "512"},         {"bbox", "170,-20,-170,20"},
                               {"min_level", "3"},    {"max_level", "12"},       {"z_scale", "-0.1"},
                               {"z_offset", "-7.5"},  {"title", "Höhe"},         {"attribution", "me"},
                               {"voids", "FILL"},     {"fill_limit", "300"},     {"quality", "Best"},
                               {"water", "-0.5"},     {"water_mask", "sea.tif"}, {"dry_run", ""},
                               {"band", "elevation"}, {"name", "a.tif"}});
  ASSERT_TRUE(settings) << settings.problem().line();
  const proto::BuildOptions& build = settings->build;
  EXPECT_EQ(build.error(), 2.5);
  EXPECT_EQ(build.crs(), "EPSG:32632");
  EXPECT_EQ(build.vertical_datum(), "EGM2008");
  EXPECT_EQ(build.nodata(), "-9999");
  EXPECT_EQ(build.band(), "elevation");
  EXPECT_EQ(build.device(), "cuda:1");
  EXPECT_EQ(build.threads(), 4u);
  EXPECT_EQ(build.memory(), 512u);
  EXPECT_THAT(build.bbox(), ElementsAre(170, -20, -170, 20));
  EXPECT_EQ(build.min_level(), 3u);
  EXPECT_EQ(build.max_level(), 12u);
  EXPECT_EQ(build.z_scale(), -0.1);
  EXPECT_EQ(build.z_offset(), -7.5);
  EXPECT_EQ(build.title(), "Höhe");
  EXPECT_EQ(build.voids(), "fill");
  EXPECT_EQ(build.fill_limit(), 300u);
  EXPECT_EQ(build.quality(), "best");
  EXPECT_EQ(build.water(), -0.5);
  EXPECT_EQ(build.water_mask(), "sea.tif");
  EXPECT_TRUE(settings->dry_run);
  EXPECT_EQ(build.name(), "a.tif");
}

/// One value for every option of a build; error and keep exclude each other.
const Given kOneOfEach = {{"name", "a.tif"},
                          {"band", "2"},
                          {"error", "2.5"},
                          {"crs", "EPSG:32632"},
                          {"vertical-datum", "EGM2008"},
                          {"nodata", "-9999"},
                          {"voids", "12.5"},
                          {"fill-limit", "40"},
                          {"strategy", "cleap"},
                          {"device", "cpu"},
                          {"threads", "3"},
                          {"memory", "512"},
                          {"bbox", "10,46,11,47"},
                          {"min-level", "3"},
                          {"max-level", "12"},
                          {"z-scale", "0.5"},
                          {"z-offset", "-7"},
                          {"title", "two words"},
                          {"imagery", "https://example.org/a/{z}/{y}/{x}?k=1"},
                          {"attribution", "me = mine"},
                          {"quality", "fast"},
                          {"pixels", "exact"},
                          {"water", "0"},
                          {"water-mask", "sea.tif"},
                          {"feather", "30"},
                          {"dry-run", "1"}};

Given through_config_file(const Given& given) {
  const TempFolder folder;
  const auto path = folder.path() / "conf";
  std::ofstream file(path);
  for (const auto& [name, value] : given) file << name << " = " << value << "\n";
  file.close();
  const auto read = config_file_layer(path.string());
  return read ? *read : Given{};
}

Given through_environment(const Given& given) {
  for (const auto& [name, value] : given) setenv(spelt(name, Spelling::environment).c_str(), value.c_str(), 1);
  Given read = environment_layer(build_options());
  for (const auto& [name, value] : given) unsetenv(spelt(name, Spelling::environment).c_str());
  return read;
}

Given respelt(Given given, Spelling spelling) {
  for (auto& [name, value] : given) name = spelt(name, spelling);
  return given;
}

TEST(Options, EveryOptionMeansTheSameThroughEveryDoor) {
  std::vector<Given> cases = {kOneOfEach, {{"keep", "0.5,0.25"}}};
  for (const auto& one : kOneOfEach) cases.push_back({one});
  const std::string untouched = Settings().build.SerializeAsString();
  for (const Given& given : cases) {
    SCOPED_TRACE(given.front().first);
    const auto asked = query(respelt(given, Spelling::query));
    const std::pair<Given, Spelling> doors[] = {{respelt(given, Spelling::command_line), Spelling::command_line},
                                                {through_config_file(given), Spelling::config_file},
                                                {through_environment(given), Spelling::environment}};
    ASSERT_TRUE(asked) << asked.problem().line();
    EXPECT_TRUE(asked->dry_run || asked->build.SerializeAsString() != untouched) << "nothing was set";
    for (const auto& [layer, spelling] : doors) {
      EXPECT_EQ(layer.size(), given.size());
      const auto settings = with_layer({}, build_options(), layer, spelling);
      ASSERT_TRUE(settings) << settings.problem().line();
      EXPECT_EQ(settings->build.SerializeAsString(), asked->build.SerializeAsString());
      EXPECT_EQ(settings->dry_run, asked->dry_run);
    }
  }
  EXPECT_EQ(kOneOfEach.size() + 1, build_options().size()) << "an option has no value here";
}

TEST(Options, OldSpellingsOfNodataStillWork) {
  for (const char* word : {"fill", "HOLE"}) {
    const auto settings = query({{"nodata", word}, {"source_nodata", "-9999"}});
    ASSERT_TRUE(settings) << settings.problem().line();
    EXPECT_EQ(settings->build.voids(), word == std::string("fill") ? "fill" : "hole");
    EXPECT_EQ(settings->build.nodata(), "-9999");
    ASSERT_EQ(settings->build.warnings_size(), 1);
    EXPECT_THAT(settings->build.warnings(0), HasSubstr(std::string("nodata=") + word + " is understood as voids=" + word));
  }
  EXPECT_EQ(query({{"source_nodata", "-1"}})->build.warnings_size(), 0) << "an older name is no trouble";
  EXPECT_EQ(query({{"source-nodata", "hole"}})->build.voids(), "hole");
  const auto configured = with_layer({}, build_options(), {{"source-nodata", "fill"}}, Spelling::config_file);
  EXPECT_EQ(configured->build.voids(), "fill");
  const auto line = with_layer({}, build_options(), {{"--nodata", "hole"}}, Spelling::command_line);
  EXPECT_THAT(line->build.warnings(0), HasSubstr("--voids=hole"));
  for (const Given& twice : {Given{{"nodata", "1"}, {"source_nodata", "2"}}, Given{{"nodata", "fill"}, {"voids", "hole"}}}) {
    const auto refused = query(twice);
    ASSERT_FALSE(refused);
    EXPECT_EQ(refused.problem().type, "option-repeated");
  }
  setenv("CORDILLERA_SOURCE_NODATA", "-7", 1);
  const auto set = with_layer({}, build_options(), environment_layer(build_options()), Spelling::environment);
  const auto unread = unread_variables();
  unsetenv("CORDILLERA_SOURCE_NODATA");
  ASSERT_TRUE(set);
  EXPECT_EQ(set->build.nodata(), "-7");
  EXPECT_TRUE(unread.empty());
}

TEST(Options, AHeightThatIsNoLandIsNoHeightForVoids) {
  const auto refused = query({{"voids", "-9999"}});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.problem().detail, HasSubstr("pits deeper than any land"));
  EXPECT_THAT(refused.problem().detail, HasSubstr("nodata=-9999"));
  EXPECT_TRUE(query({{"voids", "-500"}}));
  EXPECT_EQ(query({{"voids", " 5"}})->build.voids(), "5") << "what a + in an address becomes";
  EXPECT_FALSE(query({{"voids", "+-5"}}));
  EXPECT_EQ(query({{"voids", "20000"}}).problem().detail, "voids='20000': higher than any height may be");
  EXPECT_EQ(query({{"voids", "keep"}}).problem().detail, "voids='keep': not a number, and neither fill nor hole");
}

TEST(Options, OneRasterOfSeveralHasAHeightForItsVoidsAndNoOtherSay) {
  EXPECT_TRUE(with_raster_layer({}, raster_options(), {{"voids", "12"}, {"nodata", "-1"}, {"z_scale", "2"}}));
  for (const Given& given :
       {Given{{"voids", "fill"}}, Given{{"voids", "Hole"}}, Given{{"nodata", "fill"}}, Given{{"source_nodata", "hole"}}}) {
    const auto refused = with_raster_layer({}, raster_options(), given);
    ASSERT_FALSE(refused);
    EXPECT_THAT(refused.problem().detail, HasSubstr("of all rasters together"));
  }
  const auto others = with_raster_layer({}, raster_options(), {{"fill_limit", "12"}});
  ASSERT_FALSE(others);
  EXPECT_EQ(others.problem().type, "option-unknown");
}

TEST(Options, TheRangeThatIsNamedIsTheOneThatIsAccepted) {
  const auto refused = query({{"error", "-1"}});
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.problem().detail, HasSubstr("outside 0.01 to 1000000"));
  EXPECT_THAT(refused.problem().accepted, HasSubstr("0.01 to 1000000"));
  const auto below = query({{"threads", "-1"}});
  ASSERT_FALSE(below);
  EXPECT_EQ(below.problem().detail, "threads='-1': outside 0 to 1024");
  EXPECT_EQ(query({{"threads", "4294967296"}}).problem().detail, "threads='4294967296': outside 0 to 1024");
  EXPECT_TRUE(query({{"error", "0.01"}}));
  EXPECT_TRUE(query({{"error", "1000000"}}));
}

TEST(Options, AVariableThatNobodyReadsIsNamedWithItsNeighbour) {
  const auto with = [](const char* name) {
    setenv(name, "1", 1);
    const std::vector<std::string> sentences = unread_variables();
    unsetenv(name);
    return sentences.empty() ? "" : sentences.front();
  };
  EXPECT_THAT(with("CORDILLERA_EROR"), HasSubstr("CORDILLERA_EROR is no option and is not read; did you mean CORDILLERA_ERROR?"));
  EXPECT_THAT(with("CORDILLERA_max_level"), HasSubstr("did you mean CORDILLERA_MAX_LEVEL?"));
  EXPECT_THAT(with("CORDILLERA_FROBNICATION"), testing::EndsWith("not read"));
  for (const char* known :
       {"CORDILLERA_ERROR", "CORDILLERA_LISTEN", "CORDILLERA_CACHE", "CORDILLERA_TEST_DATA", "CORDILLERA_GEOIDS", "OTHER_EROR"})
    EXPECT_EQ(with(known), "") << known;
}

TEST(Options, ADeviceHasOneSpelling) {
  for (const char* text : {"cuda:1", "CUDA:1", "cuda:+1", "cuda: 1", "cuda:01"}) {
    const auto settings = query({{"device", text}});
    ASSERT_TRUE(settings) << text;
    EXPECT_EQ(settings->build.device(), "cuda:1") << text;
  }
}

TEST(Options, BadValuesAreNamedWithWhatIsAccepted) {
  const std::vector<std::pair<std::string, std::string>> bad = {{"error", "0"},
                                                                {"error", "-1"},
                                                                {"error", "nan"},
                                                                {"error", "inf"},
                                                                {"error", "1 m"},
                                                                {"error", ""},
                                                                {"error", "0x10"},
                                                                {"keep", "0.5,0.6"},
                                                                {"keep", "0.5,"},
                                                                {"keep", "1.5"},
                                                                {"keep", "0"},
                                                                {"keep", "a"},
                                                                {"vertical_datum", ""},
                                                                {"error", "1000001"},
                                                                {"error", "0.0099"},
                                                                {"source_nodata", "none"},
                                                                {"nodata", "inf"},
                                                                {"nodata", ""},
                                                                {"voids", "holes!"},
                                                                {"voids", ""},
                                                                {"crs", ""},
                                                                {"voids", "99999"},
                                                                {"voids", "-500.5"},
                                                                {"fill_limit", "1025"},
                                                                {"band", ""},
                                                                {"band", "0"},
                                                                {"band", "-1"},
                                                                {"quality", "minimax"},
                                                                {"nodata", "holes!"},
                                                                {"strategy", "magic"},
                                                                {"device", "gpu"},
                                                                {"device", "cuda:"},
                                                                {"device", "cuda:x"},
                                                                {"threads", "-1"},
                                                                {"threads", "1.5"},
                                                                {"threads", "1025"},
                                                                {"threads", "99999999999999999999"},
                                                                {"memory", "95"},
                                                                {"bbox", "1,2,3"},
                                                                {"bbox", "0,10,10,0"},
                                                                {"bbox", "0,-91,1,1"},
                                                                {"bbox", "5,0,5,1"},
                                                                {"bbox", "0,0,200,1"},
                                                                {"min_level", "23"},
                                                                {"max_level", "-1"},
                                                                {"z_scale", "0"},
                                                                {"z_offset", "x"},
                                                                {"dry_run", "perhaps"},
                                                                {"title", std::string("a\nb")},
                                                                {"title", "\xff"},
                                                                {"title", std::string(1001, 'a')}};
  for (const auto& [name, value] : bad) {
    const auto settings = query({{name, value}});
    ASSERT_FALSE(settings) << name << "=" << value;
    EXPECT_EQ(settings.problem().type, "option-invalid") << name << "=" << value;
    EXPECT_EQ(settings.problem().parameter, name);
    EXPECT_FALSE(settings.problem().accepted.empty());
  }
}

TEST(Options, ABoxSaysWhichLongitudesItTakes) {
  for (const char* box : {"367,46,368,47", "190,46,191,47", "-1000,46,-999,47"})
    EXPECT_THAT(query({{"bbox", box}}).problem().detail, ::testing::HasSubstr("a longitude is outside -180 to 180")) << box;
  EXPECT_THAT(query({{"bbox", "7,1000,8,1001"}}).problem().detail, ::testing::HasSubstr("a latitude is beyond a pole"));
}

TEST(Options, EachHasItsGroupInHelp) {
  for (const OptionSpec& option : all_options())
    EXPECT_NE(group_of(option), "Others") << option.name << " is in no group of option_groups.cpp";
}

TEST(Options, AnUnknownNameSuggestsItsNeighbour) {
  const auto over_http = query({{"vertical-datun", "EGM96"}});
  ASSERT_FALSE(over_http);
  EXPECT_EQ(over_http.problem().type, "option-unknown");
  EXPECT_THAT(over_http.problem().detail, HasSubstr("did you mean vertical_datum?"));
  const auto typed = with_layer({}, build_options(), {{"--eror", "1"}}, Spelling::command_line);
  ASSERT_FALSE(typed);
  EXPECT_THAT(typed.problem().detail, HasSubstr("did you mean --error?"));
  const auto far = query({{"frobnicate", "1"}});
  ASSERT_FALSE(far);
  EXPECT_THAT(far.problem().detail, Not(HasSubstr("did you mean")));
  const auto gone = query({{"scheme", "geodetic"}});
  ASSERT_FALSE(gone);
  EXPECT_THAT(gone.problem().detail, HasSubstr("it had one value, and is left out now"));
  EXPECT_THAT(far.problem().accepted, HasSubstr("max_level"));
  const auto serve_only = query({{"listen", "0.0.0.0:1"}});
  EXPECT_FALSE(serve_only) << "a request must not set what only the operator may";
}

TEST(Options, TwoExchangedLettersAreOneMistake) {
  const std::vector<std::string> names = {"build", "info", "serve"};
  EXPECT_EQ(nearest_name("buidl", names), "build");
  EXPECT_EQ(nearest_name("sevre", names), "serve");
  EXPECT_EQ(nearest_name("biuld", names), "build");
  EXPECT_FALSE(nearest_name("dlibu", names));
}

TEST(Options, ContradictionsAreRefused) {
  EXPECT_EQ(query({{"error", "1"}, {"keep", "0.5"}}).problem().type, "options-conflict");
  EXPECT_EQ(query({{"error", "1"}, {"error", "2"}}).problem().type, "option-repeated");
  const auto levels = query({{"min_level", "9"}, {"max_level", "3"}});
  EXPECT_EQ(levels.problem().parameter, "min_level");
}

TEST(Options, Utf8IsTold) {
  EXPECT_TRUE(is_utf8("aé€😀"));
  for (const char* bad : {"\xc3", "\xc0\x80", "\xed\xa0\x80", "\xf5\x80\x80\x80", "\x80", "a\xe2\x82"})
    EXPECT_FALSE(is_utf8(bad));
}

}  // namespace
}  // namespace cordillera::server
