#include "server/options/option_words.h"

#include "server/options/option_groups.h"

namespace cordillera::server {
namespace {

/// Other tools, or earlier versions, call it so.
std::string with_habits(const OptionSpec& option) {
  const std::string name = spelt(option, Spelling::command_line), older = alias_spelt(option, Spelling::command_line);
  if (name == "--max-level") return "-z,--max-level,--max-zoom";
  return older.empty() ? name : name + "," + older;
}

}  // namespace

void add_table(CLI::App& command, const std::vector<OptionSpec>& table, Given& given) {
  for (const OptionSpec& option : table) {
    const std::string name = spelt(option, Spelling::command_line);
    const auto take = [&given, name](const CLI::results_t& values) {
      for (const std::string& value : values) given.emplace_back(name, value);
      return true;
    };
    auto* added = command.add_option(with_habits(option), take, option.help + " [" + option.accepted + "]");
    added->group(group_of(option));
    added->type_name(option.value)->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
    if (option.value.empty()) {
      added->expected(0, 1);
    } else {
      added->expected(1)->allow_extra_args(false);
    }
  }
}

}  // namespace cordillera::server
