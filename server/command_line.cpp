#include "server/command_line.h"

#include <algorithm>
#include <filesystem>
#include <iostream>

#include "server/options/option_values.h"
#include "server/options/spoken_words.h"

namespace cordillera::server {
namespace {

/// A command nobody knows is a problem that names its neighbour. A file is what is to be done something with.
proto::Problem unknown_command(const std::string& word, const std::vector<std::string>& names) {
  std::error_code error;
  if (std::filesystem::exists(word, error))
    return {"usage", "'" + word + "' is no command but a file",
            "cordillera view " + word + ", cordillera info " + word + ", or cordillera build " + word + " -o FOLDER", word};
  std::string all;
  for (const std::string& name : names) all += (all.empty() ? "" : ", ") + name;
  const auto nearest = nearest_name(word, names);
  return {"usage", "unknown command '" + word + "'" + (nearest ? "; did you mean " + *nearest + "?" : ""), all, word};
}

/// The same of an option. A command has up to a hundred: help has them in groups, one line has not.
proto::Problem unknown_option(const std::string& word, const std::vector<std::string>& names, const std::string& command) {
  auto nearest = nearest_name(word, names);
  const auto meant = meant_by_habit(word);
  if (meant && std::find(names.begin(), names.end(), "--" + *meant) != names.end()) nearest = "--" + *meant;
  return {
      "usage",
      "unknown option '" + word + "'; " + (nearest ? "did you mean " + *nearest + "?" : "see `cordillera help " + command + "`"),
      "", word};
}

/// The first word that is no command, if there is one.
std::optional<proto::Problem> check_command(const CLI::App& app, const std::string& word) {
  if (word.empty() || word[0] == '-') return std::nullopt;
  std::vector<std::string> names;
  for (const CLI::App* command : app.get_subcommands(nullptr)) {
    if (command->get_name() == word) return std::nullopt;
    if (!command->get_group().empty()) names.push_back(command->get_name());
  }
  return unknown_command(word, names);
}

/// What the command did not take: an option nobody knows, or a word too many. A command that lacks a word cannot run either.
std::optional<proto::Problem> check_words(const CLI::App& command) {
  std::vector<std::string> names;
  for (const CLI::Option* option : command.get_options()) {
    for (const std::string& name : option->get_lnames()) names.push_back("--" + name);
  }
  const std::string help = "see cordillera " + command.get_name() + " --help";
  for (const std::string& word : command.remaining()) {
    if (word.rfind("-", 0) == 0) return unknown_option(word.substr(0, word.find('=')), names, command.get_name());
    std::error_code error;
    if (command.get_name() == "serve" && std::filesystem::exists(word, error))
      return proto::Problem{
          "usage", "unexpected '" + word + "'",
          "cordillera view " + word + "; or serve --live FOLDER of rasters, or --mount NAME=PATH of what was built", word};
    return proto::Problem{"usage", "unexpected '" + word + "'", help, word};
  }
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_positional() || option->count() > 0 || option->get_expected_min() == 0) continue;
    return proto::Problem{"usage", command.get_name() + " needs a " + option->get_name(true), help, option->get_name(true)};
  }
  return std::nullopt;
}

}  // namespace

int wrong_usage(const proto::Problem& problem) {
  complain(problem);
  return kUsage;
}

CLI::App* CommandLine::add(const std::string& name, const std::string& help, std::function<int()> run) {
  return know(app_.add_subcommand(name, help), std::move(run));
}

CLI::App* CommandLine::know(CLI::App* command, std::function<int()> run) {
  command->allow_extras();  // check_words tells of them
  all_.emplace_back(command, std::move(run));
  return command;
}

int CommandLine::run(std::vector<std::string> line) const {
  line = understood(std::move(line));
  if (line.empty()) {
    std::cerr << app_.help();
    return kUsage;
  }
  if (const auto unknown = check_command(app_, line.front())) return wrong_usage(*unknown);
  try {
    std::reverse(line.begin(), line.end());  // as the library wants them
    app_.parse(std::move(line));
  } catch (const CLI::ParseError& error) { return app_.exit(error) == 0 ? kDone : kUsage; }
  const auto asked = std::find_if(all_.begin(), all_.end(), [](const auto& one) { return one.first->parsed(); });
  if (const auto wrong = check_words(*asked->first)) return wrong_usage(*wrong);
  return asked->second();
}

}  // namespace cordillera::server
