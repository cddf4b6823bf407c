#include "server/options/option_words.h"

#include "server/options/option_groups.h"

namespace cordillera::server {
namespace {

/// What other tools, or earlier versions, call it.
std::string habits_of(const OptionSpec& option) {
  if (option.name == "max-level") return "-z,--max-zoom";
  return option.alias.empty() ? "" : spelt(option.alias, Spelling::command_line);
}

}  // namespace

void add_table(CLI::App& command, const std::vector<OptionSpec>& table, Given& given) {
  for (const OptionSpec& option : table) add_row(command, option, habits_of(option), given)->group(group_of(option));
}

}  // namespace cordillera::server
