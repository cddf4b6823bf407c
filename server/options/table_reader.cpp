#include "server/options/table_reader.h"

#include "proto/letters.h"
#include "server/options/spoken_words.h"

namespace cordillera::server {
namespace {

/// Whether who spells so is told of it.
bool is_offered(const OptionName& option, Spelling spelling) {
  return spelling != Spelling::query || option.open_to == OpenTo::requests;
}

std::string underscored(std::string name) {
  std::replace(name.begin(), name.end(), '-', '_');
  return name;
}

/// As a table has it: in a config file and over HTTP either spelling is understood.
std::string dashed(std::string name) {
  std::replace(name.begin(), name.end(), '_', '-');
  return name;
}

/// What a name that no table has may have meant, as a sentence goes on.
std::string hint_of(const std::string& said, const std::vector<OptionName>& names, Spelling spelling) {
  if (said == "scheme") return ": it had one value, and is left out now";
  std::vector<std::string> spellings;
  for (const OptionName& name : names) {
    if (is_offered(name, spelling)) spellings.push_back(spelt(name.name, spelling));
  }
  auto nearest = nearest_name(said, spellings);
  if (const auto meant = meant_by_habit(said)) {
    const std::string word = spelt(*meant, spelling);
    if (std::find(spellings.begin(), spellings.end(), word) != spellings.end()) nearest = word;
  }
  return nearest ? "; did you mean " + *nearest + "?" : "";
}

}  // namespace

std::string spelt(const std::string& name, Spelling spelling) {
  switch (spelling) {
    case Spelling::query: return underscored(name);
    case Spelling::command_line: return "--" + name;
    case Spelling::config_file: return name;
    case Spelling::environment: break;
  }
  std::string variable = "CORDILLERA_" + underscored(name);
  for (char& c : variable) c = proto::upper(c);
  return variable;
}

std::optional<std::size_t> place_of(const std::string& said, const std::vector<OptionName>& names, Spelling spelling) {
  const std::string wanted = spelling == Spelling::query         ? underscored(said)
                             : spelling == Spelling::config_file ? dashed(said)
                                                                 : said;
  const auto found = std::find_if(names.begin(), names.end(), [&](const OptionName& option) {
    return spelt(option.name, spelling) == wanted || (!option.alias.empty() && spelt(option.alias, spelling) == wanted);
  });
  if (found == names.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names.begin());
}

std::string listed(const std::vector<OptionName>& names, Spelling spelling) {
  std::string all;
  for (const OptionName& name : names) {
    if (is_offered(name, spelling)) all += (all.empty() ? "" : ", ") + spelt(name.name, spelling);
  }
  return all;
}

proto::Problem unknown_option(const std::string& said, const std::vector<OptionName>& names, const TableWords& words) {
  const char* usual = words.spelling == Spelling::query ? "unknown query parameter" : "unknown option";
  const std::string what = (words.what.empty() ? usual : words.what) + " '" + quotable(said) + "'" + words.of;
  const std::string accepted = words.accepted.empty() ? listed(names, words.spelling) + words.beside : words.accepted;
  return {"option-unknown", what + hint_of(said, names, words.spelling), accepted, quotable(said)};
}

proto::Problem given_twice(const std::string& name) {
  return {"option-repeated", quotable(name) + " is given twice", "each option once; lists are separated by commas",
          quotable(name)};
}

bool is_given(const Given& options, std::string_view name) {
  return std::any_of(options.begin(), options.end(), [&](const auto& option) { return option.first == name; });
}

}  // namespace cordillera::server
