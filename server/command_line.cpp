#include "server/command_line.h"

#include <algorithm>
#include <filesystem>
#include <iostream>
#include <sstream>
#include <string_view>

#include "server/options/mesh_options.h"
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
  const bool of_mesh =
      std::ranges::any_of(mesh_options(), [&](const MeshOption& option) { return word == std::string("--") + option.name; });
  if (command == "build" && of_mesh)
    return {"usage", word + " is an option of `cordillera export`",
            "cordillera build RASTER -o NAME.sqlite, and then cordillera export NAME.sqlite -o MESH.ply " + word + " …", word};
  auto nearest = nearest_name(word, names);
  const auto meant = meant_by_habit(word);
  if (meant && std::find(names.begin(), names.end(), "--" + *meant) != names.end()) nearest = "--" + *meant;
  return {
      "usage",
      "unknown option '" + word + "'; " + (nearest ? "did you mean " + *nearest + "?" : "see `cordillera help " + command + "`"),
      "", word};
}

/// Of an option before any command: there are few.
std::optional<proto::Problem> check_first_option(const CLI::App& app, const std::string& word) {
  const std::string name = word.substr(0, word.find('='));
  std::vector<std::string> names;
  for (const CLI::Option* option : app.get_options()) {
    for (const std::string& known : option->get_lnames()) names.push_back("--" + known);
    for (const std::string& letter : option->get_snames()) {
      if (name == "-" + letter) return std::nullopt;
    }
  }
  if (std::find(names.begin(), names.end(), name) != names.end()) return std::nullopt;
  const auto nearest = nearest_name(name, names);
  return proto::Problem{
      "usage", "unknown option '" + name + "'; " + (nearest ? "did you mean " + *nearest + "?" : "see `cordillera help`"), "",
      name};
}

/// The first word that is no command, if there is one.
std::optional<proto::Problem> check_command(const CLI::App& app, const std::string& word) {
  if (word.empty()) return std::nullopt;
  if (word[0] == '-') return check_first_option(app, word);
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
    const std::string each =
        command.get_name() == "check" && command["--source"]->count() > 0 ? "--source in front of each raster; " : "";
    return proto::Problem{"usage", "unexpected '" + word + "'", each + help, word};
  }
  for (const CLI::Option* option : command.get_options()) {
    if (!option->get_positional() || option->count() > 0 || option->get_expected_min() == 0) continue;
    const std::string name = option->get_name(true);
    const char* const article = name.ends_with('s')                                                ? ""
                                : std::string_view("aeio").find(name[0]) != std::string_view::npos ? "an "
                                                                                                   : "a ";
    return proto::Problem{"usage", command.get_name() + " needs " + article + name, help, name};
  }
  return std::nullopt;
}

constexpr std::size_t kScreenLines = 50, kScreenColumns = 100, kAboutColumn = 30;
/// Groups that a screen has room for the names of alone, the first one first.
constexpr const char* kNamesFirst[] = {"Limits", "Machine",           "Raster",           "Posts",
                                       "Output", "Heights and voids", "Levels and errors"};

/// How much of a group of options is told.
enum class Telling { whole, shortly, names };

struct HelpEntry {
  std::string names, about;
};
struct HelpGroup {
  std::string heading;
  std::vector<HelpEntry> entries;
  Telling telling = Telling::whole;
};

/// Words in lines that begin at the column, the further ones so much behind it; the first one stands behind what is there
/// already.
std::string wrapped(const std::string& text, std::size_t column, std::size_t more = 0) {
  std::string out;
  std::size_t at = column;
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (at + word.size() + 1 > kScreenColumns && at > column) {
      at = column + more;
      out += "\n" + std::string(at, ' ');
    } else if (at > column) {
      out += " ";
      ++at;
    }
    out += word;
    at += word.size();
  }
  return out + "\n";
}

/// The first thing that is said, on one line.
std::string shortened(const std::string& text) {
  std::string first = text.substr(0, std::min(text.find(" ["), text.find("; ")));
  constexpr std::size_t kRoom = kScreenColumns - kAboutColumn;
  if (first.size() <= kRoom) return first;
  return first.substr(0, first.rfind(' ', kRoom - 5)) + " …";
}

std::string shown(const HelpGroup& group) {
  if (group.telling == Telling::names) {
    std::string names = group.heading + ":";
    for (const HelpEntry& entry : group.entries) names += " " + entry.names.substr(0, entry.names.find(' '));
    return wrapped(names, 0, 2);
  }
  std::string out = group.heading + ":\n";
  for (const HelpEntry& entry : group.entries) {
    out += "  " + entry.names;
    const std::size_t width = 2 + entry.names.size();
    out += width + 2 > kAboutColumn ? "\n" + std::string(kAboutColumn, ' ') : std::string(kAboutColumn - width, ' ');
    out += wrapped(group.telling == Telling::whole ? entry.about : shortened(entry.about), kAboutColumn);
  }
  return out;
}

/// "-o,--output FILE": its other spellings are --help-all's.
std::string spelt(const CLI::Option& option) {
  if (option.get_positional()) return option.get_name(true);
  std::string names = option.get_snames().empty() ? "" : "-" + option.get_snames().front();
  if (!option.get_lnames().empty()) names += (names.empty() ? "--" : ",--") + option.get_lnames().front();
  return option.get_type_size() == 0 || option.get_type_name().empty() ? names : names + " " + option.get_type_name();
}

std::vector<HelpGroup> help_groups(const CLI::App& command) {
  std::vector<HelpGroup> groups;
  const auto add = [&](const std::string& heading, HelpEntry entry) {
    auto found = std::find_if(groups.begin(), groups.end(), [&](const HelpGroup& one) { return one.heading == heading; });
    if (found == groups.end()) found = groups.insert(groups.end(), {heading, {}});
    found->entries.push_back(std::move(entry));
  };
  for (const bool positional : {true, false}) {
    for (const CLI::Option* option : command.get_options()) {
      if (option->get_group().empty() || option->get_positional() != positional) continue;
      // They are told of at the end of the page, and by the list of commands.
      const bool help = option == command.get_help_ptr() || option == command.get_help_all_ptr();
      if (help && command.get_parent() != nullptr) continue;
      add(positional ? "Words" : option->get_group(), {spelt(*option), option->get_description()});
    }
  }
  for (const CLI::App* one : command.get_subcommands(nullptr)) {
    if (!one->get_group().empty()) add("Commands", {one->get_name(), one->get_description()});
  }
  return groups;
}

}  // namespace

std::string help_page(const CLI::App& command) {
  const bool all = command.get_parent() == nullptr;
  const std::string name = all ? command.get_name() : command.get_parent()->get_name() + " " + command.get_name();
  std::vector<HelpGroup> groups = help_groups(command);
  const auto page = [&] {
    std::string usage = "Usage: " + name + (all ? " COMMAND" : "") + " [OPTIONS]";
    std::string options;
    bool in_full = true;
    for (const HelpGroup& group : groups) {
      options += shown(group);
      in_full = in_full && group.telling == Telling::whole;
      if (group.heading != "Words") continue;
      for (const HelpEntry& entry : group.entries) usage += " " + entry.names;
    }
    std::string end = command.get_footer().empty() ? "" : wrapped(command.get_footer(), 0);
    if (all) end += "Of one of them: cordillera help COMMAND\n";
    if (!in_full) end += "In full: " + name + " --help-all\n";
    return wrapped(command.get_description(), 0) + usage + "\n\n" + options + (end.empty() ? "" : "\n" + end);
  };
  const auto fits = [&] {
    const std::string text = page();
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n')) <= kScreenLines;
  };
  if (!fits()) {
    for (HelpGroup& group : groups) group.telling = Telling::shortly;
  }
  for (const char* heading : kNamesFirst) {
    if (fits()) break;
    for (HelpGroup& group : groups) group.telling = group.heading == heading ? Telling::names : group.telling;
  }
  return page();
}

CLI::App* CommandLine::add(const std::string& name, const std::string& help, std::function<int()> run) {
  return know(app_.add_subcommand(name, help), std::move(run));
}

CLI::App* CommandLine::know(CLI::App* command, std::function<int()> run) {
  command->allow_extras();  // check_words tells of them
  all_.emplace_back(command, std::move(run));
  return command;
}

int CommandLine::run(std::vector<std::string> line) const { return with_output(run_line(std::move(line))); }

int CommandLine::run_line(std::vector<std::string> line) const {
  line = understood(std::move(line));
  if (line.empty()) {
    std::cerr << help_page(app_);
    return kUsage;
  }
  if (const auto unknown = check_command(app_, line.front())) return wrong_usage(*unknown);
  try {
    std::reverse(line.begin(), line.end());  // as the library wants them
    app_.parse(std::move(line));
  } catch (const CLI::CallForHelp&) {
    const auto parsed = app_.get_subcommands();
    std::cout << help_page(parsed.empty() ? app_ : *parsed.back());
    return kDone;
  } catch (const CLI::ParseError& error) { return app_.exit(error) == 0 ? kDone : kUsage; }
  const auto asked = std::find_if(all_.begin(), all_.end(), [](const auto& one) { return one.first->parsed(); });
  if (const auto wrong = check_words(*asked->first)) return wrong_usage(*wrong);
  try {
    return asked->second();
  } catch (const std::exception& error) {
    return fail({"internal", std::string("this should not have happened: ") + error.what(), "", ""});
  }
}

}  // namespace cordillera::server
