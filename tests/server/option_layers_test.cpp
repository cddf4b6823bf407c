// Where options come from: files and the environment before what is said last.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <utility>

#include "fixture.h"
#include "server/options/options.h"
#include "server/options/request_policy.h"

namespace cordillera::server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Pair;

TEST(Options, ALaterLayerWins) {
  auto settings = with_layer({}, build_options(), {{"error", "5"}, {"threads", "2"}}, Spelling::config_file);
  ASSERT_TRUE(settings);
  settings = with_layer(*settings, build_options(), {{"keep", "0.5,0.25"}}, Spelling::query);
  ASSERT_TRUE(settings);
  EXPECT_FALSE(settings->build.has_error()) << "keep in a request replaces the operator's error";
  EXPECT_THAT(settings->build.keep(), ElementsAre(0.5, 0.25));
  EXPECT_EQ(settings->build.threads(), 2u);
}

TEST(Options, TheEnvironmentIsALayer) {
  setenv("CORDILLERA_Z_OFFSET", "-3", 1);
  const Given given = environment_layer(build_options());
  unsetenv("CORDILLERA_Z_OFFSET");
  ASSERT_THAT(given, ElementsAre(std::pair<std::string, std::string>("CORDILLERA_Z_OFFSET", "-3")));
  EXPECT_EQ(with_layer({}, build_options(), given, Spelling::environment)->build.z_offset(), -3);
}

TEST(Options, AConfigFileAndAListTakeTheSpellingsOfOthers) {
  for (const char* name : {"max_level", "max-level"}) {
    const auto settings = with_layer({}, build_options(), {{name, "8"}}, Spelling::config_file);
    ASSERT_TRUE(settings) << settings.problem().line();
    EXPECT_EQ(settings->build.max_level(), 8u);
  }
  const auto both = with_layer({}, build_options(), {{"max_level", "8"}, {"max-level", "8"}}, Spelling::config_file);
  ASSERT_FALSE(both);
  EXPECT_EQ(both.problem().type, "option-repeated");
  for (const char* name : {"--vertical-datum", "vertical-datum", "vertical_datum"}) {
    const auto listed = with_listed_layer({}, {{name, "EGM96"}}, "feet.tif");
    ASSERT_TRUE(listed) << listed.problem().line();
    EXPECT_EQ(listed->vertical_datum(), "EGM96");
  }
}

TEST(Options, ASourceMayBeginAsAddressesThatAreFetchedDo) {
  for (const char* one : {"http://host/", "HTTPS://host/dems/", "s3://bucket/"})
    EXPECT_TRUE(with_layer({}, serve_options(), {{"--source-allow", one}}, Spelling::command_line)) << one;
  for (const char* one : {"file:///tmp/", "ftp://host/", "gs://bucket/", "://host/", "https://host/,file:///tmp/"}) {
    const auto refused = with_layer({}, serve_options(), {{"--source-allow", one}}, Spelling::command_line);
    ASSERT_FALSE(refused) << one;
    EXPECT_THAT(refused.problem().line(),
                testing::AllOf(HasSubstr("no scheme of addresses that are fetched"), HasSubstr("s3://")));
  }
}

TEST(Options, TheConfigFileIsALayer) {
  const TempFolder folder;
  const auto path = folder.path() / "conf";
  std::ofstream(path) << "# comment\n\n keep = 0.5,0.25 \ntitle = \"two words\"\nlisten=[::1]:0\n";
  const auto given = config_file_layer(path.string());
  ASSERT_TRUE(given);
  const auto settings = with_layer({}, all_options(), *given, Spelling::config_file);
  ASSERT_TRUE(settings) << settings.problem().line();
  EXPECT_EQ(settings->build.title(), "two words");
  EXPECT_EQ(settings->serve.listen, "[::1]:0");
  std::ofstream(path) << "just words\n";
  EXPECT_THAT(config_file_layer(path.string()).problem().detail, HasSubstr(":1:"));
  std::ofstream(path) << "\xef\xbb\xbflisten = [::1]:0\ntitle = \"Peak #1\"\nattribution = a#b\n";
  EXPECT_THAT(*config_file_layer(path.string()),
              ElementsAre(Pair("listen", "[::1]:0"), Pair("title", "Peak #1"), Pair("attribution", "a#b")));
  const std::pair<const char*, const char*> rows[] = {{"data = /srv/data # of the service", "a '#' behind the value"},
                                                      {"data = /srv/data\t# of the service", "a '#' behind the value"},
                                                      {"data = \"/srv/data", "a quote at one end"},
                                                      {"data = /srv/data\"", "a quote at one end"},
                                                      {"data = \"", "a quote at one end"}};
  for (const auto& [text, said] : rows) {
    std::ofstream(path) << "\n" << text << "\n";
    const auto refused = config_file_layer(path.string());
    ASSERT_FALSE(refused) << text;
    EXPECT_THAT(refused.problem().detail, testing::AllOf(HasSubstr(":2:"), HasSubstr(said))) << text;
  }
  std::filesystem::remove(path);
  EXPECT_FALSE(config_file_layer(path.string()));
}

}  // namespace
}  // namespace cordillera::server
