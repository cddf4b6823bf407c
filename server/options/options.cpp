#include "server/options/options.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>

#include "gpu/simplify.h"
#include "pipeline/plan/plan.h"
#include "proto/letters.h"

namespace cordillera::server {
namespace {

const std::string kVariable = spelt("", Spelling::environment);

std::string trimmed(std::string_view text) { return std::string(proto::trimmed(text, " \t\r")); }

/// What the table of a build calls an option that somebody spelt so; empty: it has none.
std::string own_name(const std::string& said, Spelling spelling) {
  const auto place = place_of(said, names_in(build_options()), spelling);
  return place ? build_options()[*place].name : "";
}

/// voids=hole and voids=fill; earlier versions had it of nodata=.
bool says_what_becomes_of_voids(const std::string& value) {
  std::string word;
  return !read_choice(value, {"hole", "fill"}, &word);
}

}  // namespace

std::optional<proto::Problem> check_together(const Settings& settings, const Given& given, Spelling spelling) {
  const auto given_is = [&](const char* name) {
    return std::any_of(given.begin(), given.end(), [&](const auto& option) { return own_name(option.first, spelling) == name; });
  };
  if (given_is("error") && given_is("keep")) {
    return proto::Problem{"options-conflict", "error and keep are two ways to say how fine the levels are; both are given",
                          "one of them", spelt("keep", spelling)};
  }
  const proto::BuildOptions& build = settings.build;
  if (build.has_min_level() && build.has_max_level() && build.min_level() > build.max_level()) {
    const std::string least = spelt("min-level", spelling), most = spelt("max-level", spelling);
    return proto::Problem{
        "option-invalid",
        least + "=" + std::to_string(build.min_level()) + " is above " + most + "=" + std::to_string(build.max_level()),
        "a least level no finer than the finest", least};
  }
  return std::nullopt;
}

Given in_present_words(Given given, Spelling spelling, proto::BuildOptions& build) {
  const auto warn = [&](const std::string& sentence) {
    auto& warnings = *build.mutable_warnings();
    if (std::find(warnings.begin(), warnings.end(), sentence) == warnings.end()) warnings.Add()->assign(sentence);
  };
  for (auto& [name, value] : given) {
    if (own_name(name, spelling) == "strategy" && value == pipeline::kFormerStrategy) {
      warn(spelt("strategy", spelling) + "=" + value + " is understood as exact: there are no waves any more");
      value = gpu::kExact;
    }
    if (!says_what_becomes_of_voids(value) || own_name(name, spelling) != "nodata") continue;
    const std::string nodata = spelt("nodata", spelling), voids = spelt("voids", spelling);
    warn(nodata + "=" + value + " is understood as " + voids + "=" + value + "; " + nodata +
         "= takes a value that means no data");
    name = voids;
  }
  return given;
}

proto::Result<Settings> with_layer(Settings settings, const std::vector<OptionSpec>& table, const Given& given,
                                   Spelling spelling) {
  if (auto problem = read_layer(table, given, spelling, settings, settings)) return *problem;
  return settings;
}

bool is_of_all_rasters(const std::string& name, const std::string& value) {
  const std::string own = own_name(name, Spelling::query);
  return (own == "voids" || own == "nodata") && says_what_becomes_of_voids(value);
}

std::optional<proto::Problem> check_raster_layer(const Given& given) {
  for (const auto& [name, value] : given) {
    if (!is_of_all_rasters(name, value)) continue;
    return proto::Problem{"option-invalid", name + "=" + value + " is said of all rasters together, not of one of them",
                          "voids= with a height in metres, -500 to 16384, or voids= with the whole build", name};
  }
  return std::nullopt;
}

proto::Result<Settings> with_raster_layer(Settings settings, const std::vector<OptionSpec>& table, const Given& given) {
  if (auto problem = check_raster_layer(given)) return *problem;
  return with_layer(std::move(settings), table, given, Spelling::query);
}

proto::Result<proto::BuildOptions> with_listed_layer(const Settings& settings, const Given& given, const std::string& called) {
  std::vector<OptionSpec> table = raster_options();
  std::erase_if(table, [](const OptionSpec& option) { return option.name == "name"; });
  Given plain = given;  // who writes a list has the command line in mind
  for (auto& [name, value] : plain) name.erase(0, name.starts_with("--") ? 2 : 0);
  auto layered = with_raster_layer(settings, table, plain);
  if (layered) return std::move(layered->build);
  proto::Problem problem = layered.problem();
  problem.detail = called + ": " + problem.detail;
  return problem;
}

Given environment_layer(const std::vector<OptionSpec>& table) {
  Given given;
  for (const OptionSpec& option : table) {
    for (const std::string& name : {option.name, option.alias}) {
      const std::string variable = spelt(name, Spelling::environment);
      const char* value = name.empty() ? nullptr : std::getenv(variable.c_str());
      if (value != nullptr) given.emplace_back(variable, value);
    }
  }
  return given;
}

std::vector<std::string> unread_variables() {
  // What raster, the client's commands, deploy/ and the tests read, and every option: a server's variables may be set where
  // something is built.
  std::vector<std::string> known = {"CACHE",     "BUILD_FOLDER", "ALL_TESTS", "CMAKE_ARGS", "JOB_ENVIRONMENT",
                                    "TEST_DATA", "SERVER",       "TOKEN",     "TOKEN_FILE"};
  for (const OptionSpec& option : all_options()) {
    for (const std::string& name : {option.name, option.alias}) {
      if (!name.empty()) known.push_back(spelt(name, Spelling::environment).substr(kVariable.size()));
    }
  }
  std::vector<std::string> sentences;
  for (char** variable = environ; variable != nullptr && *variable != nullptr; ++variable) {
    const std::string text = *variable, name = text.substr(0, text.find('='));
    if (name.rfind(kVariable, 0) != 0) continue;
    const std::string rest = name.substr(kVariable.size());
    if (std::find(known.begin(), known.end(), rest) != known.end()) continue;
    const auto nearest = nearest_name(rest, known);
    const std::string shown = is_utf8(name) ? name.substr(0, 100) : kVariable + "(not UTF-8)";
    sentences.push_back("the environment variable " + shown + " is no option and is not read" +
                        (nearest ? "; did you mean " + kVariable + *nearest + "?" : ""));
  }
  return sentences;
}

namespace {

bool is_quoted(const std::string& value) { return value.size() >= 2 && value.front() == '"' && value.back() == '"'; }

struct WrongValue {
  std::string what, accepted;
};

/// What would be taken for a part of the value, and is hardly meant as one.
std::optional<WrongValue> wrong_in_value(const std::string& value) {
  if (value.empty() || is_quoted(value)) return std::nullopt;
  if (value.front() == '"' || value.back() == '"')
    return WrongValue{"a quote at one end of the value alone", "quotes at both ends, or none"};
  if (value.find(" #") != value.npos || value.find("\t#") != value.npos)
    return WrongValue{"a '#' behind the value", "a comment as a line of its own; a value with a '#' stands in quotes"};
  return std::nullopt;
}

}  // namespace

proto::Result<Given> config_file_layer(const std::string& path) {
  std::ifstream file(path);
  if (!file) return proto::Problem{"file-unreadable", "cannot read the config file " + path, "a readable text file", "--config"};
  Given given;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    if (number == 1 && line.starts_with("\xef\xbb\xbf")) line.erase(0, 3);  // a mark that some editors begin with
    line = trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    const auto equals = line.find('=');
    if (equals == std::string::npos) {
      return proto::Problem{"config-invalid", path + ":" + std::to_string(number) + ": no '=' in the line",
                            "lines of name = value", "--config"};
    }
    std::string value = trimmed(line.substr(equals + 1));
    if (const auto wrong = wrong_in_value(value))
      return proto::Problem{"config-invalid", path + ":" + std::to_string(number) + ": " + wrong->what, wrong->accepted,
                            "--config"};
    if (is_quoted(value)) value = value.substr(1, value.size() - 2);
    given.emplace_back(trimmed(line.substr(0, equals)), value);
  }
  return given;
}

std::vector<OptionSpec> post_options() {
  std::vector<OptionSpec> all = build_options();
  all.insert(all.end(), posting_options().begin(), posting_options().end());
  return all;
}

std::vector<OptionSpec> all_options() {
  std::vector<OptionSpec> all = serve_options();
  for (const OptionSpec& option : post_options()) all.push_back(option);
  return all;
}

}  // namespace cordillera::server
