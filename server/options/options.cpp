#include "server/options/options.h"

#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>

#include "proto/letters.h"
#include "server/options/spoken_words.h"

namespace cordillera::server {
namespace {

const std::string kVariable = "CORDILLERA_";

std::string underscored(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

using Found = std::vector<OptionSpec>::const_iterator;

/// The combinations that no single option can refuse.
proto::Result<void> check_together(const Settings& settings, Spelling spelling) {
  const proto::BuildOptions& build = settings.build;
  const auto name = [spelling](const char* plain) { return spelt({plain, "", "", "", nullptr}, spelling); };
  if (build.has_min_level() && build.has_max_level() && build.min_level() > build.max_level()) {
    return proto::Problem{"option-invalid",
                          name("min-level") + "=" + std::to_string(build.min_level()) + " is above " + name("max-level") + "=" +
                              std::to_string(build.max_level()),
                          "a least level no finer than the finest", name("min-level")};
  }
  return {};
}

std::string trimmed(std::string_view text) { return std::string(proto::trimmed(text, " \t\r")); }

proto::Problem unknown_option(const std::string& name, const std::vector<OptionSpec>& table, Spelling spelling) {
  std::vector<std::string> names;
  std::string all;
  for (const OptionSpec& option : table) {
    names.push_back(spelt(option, spelling));
    all += (all.empty() ? "" : ", ") + names.back();
  }
  auto nearest = nearest_name(name, names);
  if (const auto meant = meant_by_habit(name)) {
    const std::string word = spelt({*meant, "", "", "", nullptr}, spelling);
    if (std::find(names.begin(), names.end(), word) != names.end()) nearest = word;
  }
  const char* what = spelling == Spelling::query ? "unknown query parameter" : "unknown option";
  const std::string hint = name == "scheme" ? ": it had one value, and is left out now"
                           : nearest        ? "; did you mean " + *nearest + "?"
                                            : "";
  return unknown_name(what, name, hint, all);
}

/// Earlier versions took nodata=hole and nodata=fill for what voids= says now.
std::optional<Found> meant_for_voids(const OptionSpec& option, const std::string& value, const std::vector<OptionSpec>& table) {
  std::string word;
  if (option.name != "nodata" || read_choice(value, {"hole", "fill"}, &word)) return std::nullopt;
  const Found voids =
      std::find_if(table.begin(), table.end(), [](const OptionSpec& candidate) { return candidate.name == "voids"; });
  return voids == table.end() ? std::nullopt : std::optional(voids);
}

void note_old_nodata(const std::string& value, Spelling spelling, Settings& settings) {
  const auto name = [spelling](const char* plain) { return spelt({plain, "", "", "", nullptr}, spelling); };
  const std::string sentence = name("nodata") + "=" + value + " is understood as " + name("voids") + "=" + value + "; " +
                               name("nodata") + "= takes a value that means no data";
  auto& warnings = *settings.build.mutable_warnings();
  if (std::find(warnings.begin(), warnings.end(), sentence) == warnings.end()) warnings.Add()->assign(sentence);
}

}  // namespace

std::string spelt(const OptionSpec& option, Spelling spelling) {
  switch (spelling) {
    case Spelling::query: return underscored(option.name);
    case Spelling::command_line: return "--" + option.name;
    case Spelling::config_file: return option.name;
    case Spelling::environment: break;
  }
  std::string name = kVariable + underscored(option.name);
  for (char& c : name) c = proto::upper(c);
  return name;
}

std::string alias_spelt(const OptionSpec& option, Spelling spelling) {
  return option.alias.empty() ? "" : spelt({option.alias, "", "", "", nullptr}, spelling);
}

proto::Result<Settings> with_layer(Settings settings, const std::vector<OptionSpec>& table, const Given& given,
                                   Spelling spelling) {
  std::set<std::string> seen;
  for (const auto& [name, value] : given) {
    // Over HTTP the command line's spelling is understood, too.
    const std::string said = spelling == Spelling::query ? underscored(name) : name;
    Found option = std::find_if(table.begin(), table.end(), [&, &wanted = said](const OptionSpec& candidate) {
      return spelt(candidate, spelling) == wanted || (!wanted.empty() && alias_spelt(candidate, spelling) == wanted);
    });
    if (option == table.end()) return unknown_option(name, table, spelling);
    if (const auto voids = meant_for_voids(*option, value, table)) {
      option = *voids;
      note_old_nodata(value, spelling, settings);
    }
    if (!seen.insert(option->name).second) return given_twice(name, "each option once; lists are separated by commas");
    if ((option->name == "error" && seen.count("keep") != 0) || (option->name == "keep" && seen.count("error") != 0)) {
      return proto::Problem{"options-conflict", "error and keep are two ways to say how fine the levels are; both are given",
                            "one of them", name};
    }
    if (const Complaint complaint = option->apply(value, settings)) {
      return wrong_value(name, value, *complaint, option->accepted);
    }
  }
  if (auto together = check_together(settings, spelling); !together) return together.problem();
  return settings;
}

bool is_of_all_rasters(const std::string& name, const std::string& value) {
  std::string word;
  return (name == "voids" || name == "nodata") && !read_choice(value, {"hole", "fill"}, &word);
}

proto::Result<Settings> with_raster_layer(Settings settings, const std::vector<OptionSpec>& table, const Given& given) {
  for (const auto& [name, value] : given) {
    if (!is_of_all_rasters(name, value)) continue;
    return proto::Problem{"option-invalid", name + "=" + value + " is said of all rasters together, not of one of them",
                          "voids= with a height in metres, -500 to 16384, or voids= with the whole build", name};
  }
  return with_layer(std::move(settings), table, given, Spelling::query);
}

Given environment_layer(const std::vector<OptionSpec>& table) {
  Given given;
  for (const OptionSpec& option : table) {
    for (const std::string& name : {spelt(option, Spelling::environment), alias_spelt(option, Spelling::environment)}) {
      if (name.empty()) continue;
      if (const char* value = std::getenv(name.c_str())) given.emplace_back(name, value);
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
    known.push_back(spelt(option, Spelling::environment).substr(kVariable.size()));
    if (!option.alias.empty()) known.push_back(alias_spelt(option, Spelling::environment).substr(kVariable.size()));
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

proto::Result<Given> config_file_layer(const std::string& path) {
  std::ifstream file(path);
  if (!file) return proto::Problem{"file-unreadable", "cannot read the config file " + path, "a readable text file", "--config"};
  Given given;
  std::string line;
  for (int number = 1; std::getline(file, line); ++number) {
    line = trimmed(line);
    if (line.empty() || line.front() == '#') continue;
    const auto equals = line.find('=');
    if (equals == std::string::npos) {
      return proto::Problem{"config-invalid", path + ":" + std::to_string(number) + ": no '=' in the line",
                            "lines of name = value", "--config"};
    }
    std::string value = trimmed(line.substr(equals + 1));
    if (value.size() >= 2 && value.front() == '"' && value.back() == '"') value = value.substr(1, value.size() - 2);
    given.emplace_back(trimmed(line.substr(0, equals)), value);
  }
  return given;
}

std::vector<OptionSpec> raster_options() {
  std::vector<OptionSpec> own;
  std::copy_if(build_options().begin(), build_options().end(), std::back_inserter(own),
               [](const OptionSpec& option) { return option.of_raster; });
  return own;
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
