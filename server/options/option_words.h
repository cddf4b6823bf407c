#pragma once
// Options of the table as CLI11 reads them.
#include <CLI/CLI.hpp>
#include <vector>

#include "server/options/options.h"

namespace cordillera::server {

/// A row of a table on the command line; given gets it by its name, whichever was typed, in the order of the line. also: what
/// else it is called, with dashes and commas between.
template <class Wish>
CLI::Option* add_row(CLI::App& command, const OptionOf<Wish>& row, const std::string& also, Given& given) {
  const std::string name = spelt(row.name, Spelling::command_line);
  const auto take = [&given, name](const CLI::results_t& values) {
    for (const std::string& value : values) given.emplace_back(name, value);
    return true;
  };
  CLI::Option* added = command.add_option(also.empty() ? name : name + "," + also, take, row.help + " [" + row.accepted + "]");
  added->type_name(row.value)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
  if (row.value.empty()) {
    added->expected(0, 1);
  } else {
    added->expected(1)->allow_extra_args(false);
  }
  return added;
}

/// Every option of a table.
template <class Wish>
void add_rows(CLI::App& command, const std::vector<OptionOf<Wish>>& table, Given& given) {
  for (const OptionOf<Wish>& row : table) add_row(command, row, "", given);
}
/// Every option of a build or a service, in the groups of help.
void add_table(CLI::App& command, const std::vector<OptionSpec>& table, Given& given);

/// A flag that puts a value into its place, which lives as long as the command.
template <class T>
void add_value_flag(CLI::App& command, const std::string& names, T& place, T value, const std::string& help) {
  command.add_flag_callback(
      names, [&place, value] { place = value; }, help);
}

}  // namespace cordillera::server
