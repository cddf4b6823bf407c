#pragma once
// Options of the table as CLI11 reads them.
#include <CLI/CLI.hpp>
#include <vector>

#include "server/options/options.h"

namespace cordillera::server {

/// Every option of the table; given gets them as the command line spelt them, in its order.
void add_table(CLI::App& command, const std::vector<OptionSpec>& table, Given& given);

/// A flag that puts a value into its place, which lives as long as the command.
template <class T>
void add_value_flag(CLI::App& command, const std::string& names, T& place, T value, const std::string& help) {
  command.add_flag_callback(
      names, [&place, value] { place = value; }, help);
}

}  // namespace cordillera::server
