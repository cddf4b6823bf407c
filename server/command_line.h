#pragma once
// The command line: which commands there are, and what of a line is wrong before any of them runs.
#include <CLI/CLI.hpp>
#include <functional>
#include <string>
#include <utility>
#include <vector>

#include "server/cli/commands.h"

namespace cordillera::server {

/// The commands: what reads the words of each, and what then runs, which gives the exit code. A new one is a function in
/// add_commands.cpp.
class CommandLine {
 public:
  explicit CommandLine(CLI::App& app) : app_(app) { app_.set_help_all_flag("--help-all", "every option, in full, and exit"); }

  CLI::App& app() { return app_; }
  /// What the words are read into has to live as long as run, which may keep it.
  CLI::App* add(const std::string& name, const std::string& help, std::function<int()> run);
  /// One that the app has already.
  CLI::App* know(CLI::App* command, std::function<int()> run);
  /// The one that the line asks for.
  int run(std::vector<std::string> line) const;

 private:
  int run_line(std::vector<std::string> line) const;

  CLI::App& app_;
  std::vector<std::pair<CLI::App*, std::function<int()>>> all_;
};

/// All that there are.
void add_commands(CommandLine& commands);

/// What --help prints of a command, or of all: on one screen of 50 lines and 100 columns. What does not fit is told shortly, then
/// by the names of options alone, the longest group first; --help-all has it in full.
std::string help_page(const CLI::App& command);

}  // namespace cordillera::server
