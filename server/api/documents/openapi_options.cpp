#include "server/api/documents/openapi_options.h"

#include <algorithm>
#include <regex>

namespace cordillera::server::openapi {
namespace {

constexpr std::string_view kNoChoice = "no such choice", kSeveral = "; more than one separated by commas";

/// The words of "fast, default or best"; empty: it lists none.
std::vector<std::string> choices_in(std::string accepted) {
  static const std::regex kList("[A-Za-z0-9-]+((, | or )[A-Za-z0-9-]+)*"), kWord("[A-Za-z0-9-]+");
  if (!std::regex_match(accepted, kList)) return {};
  std::vector<std::string> words;
  for (std::sregex_iterator at(accepted.begin(), accepted.end(), kWord), end; at != end; ++at) {
    if (at->str() != "or") words.push_back(at->str());
  }
  return words;
}

std::vector<std::string> choices_of(const std::string& accepted, const Takes& takes) {
  std::vector<std::string> words = choices_in(accepted);
  const bool all = std::all_of(words.begin(), words.end(), takes);
  return all && !takes(kNoChoice) ? words : std::vector<std::string>();
}

/// Whether it takes a word that it names, such as "hole" where heights are taken, too.
bool takes_words(const std::string& accepted, const Takes& takes) {
  static const std::regex kWord("[A-Za-z]+");
  const std::sregex_iterator end;
  return std::any_of(std::sregex_iterator(accepted.begin(), accepted.end(), kWord), end,
                     [&](const std::smatch& word) { return takes(word.str()); });
}

/// "0 to 1024", "a level from 0 to 24".
void add_bounds(const std::string& accepted, Json& schema) {
  static const std::regex kBounds("(?:a level from )?([0-9]{1,9}) to ([0-9]{1,9})");
  std::smatch found;
  if (!std::regex_match(accepted, found, kBounds)) return;
  schema["minimum"] = std::stol(found[1]);
  schema["maximum"] = std::stol(found[2]);
}

}  // namespace

Json schema_of_values(const std::string& accepted, const Takes& takes) {
  const bool any_word = takes(kNoChoice);
  if (!any_word && takes("true") && takes("false")) return {{"type", "boolean"}};
  if (!any_word && (takes("0.5,0.25") || takes("7,46,8,47"))) return {{"type", "array"}, {"items", {{"type", "number"}}}};
  const bool number = (takes("0") || takes("1")) && !any_word && !takes_words(accepted, takes);
  if (number && takes("0.5")) return {{"type", "number"}};
  if (number) {
    Json whole = {{"type", "integer"}};
    add_bounds(accepted, whole);
    return whole;
  }
  const bool several = accepted.ends_with(kSeveral);
  const auto choices = choices_of(several ? accepted.substr(0, accepted.size() - kSeveral.size()) : accepted, takes);
  Json text = {{"type", "string"}};
  if (!choices.empty()) text["enum"] = choices;
  return several ? Json{{"type", "array"}, {"items", text}} : text;
}

Json schema_of_field(Json schema) {
  if (schema["type"] != "array") return schema;
  schema["type"] = "string";
  schema.erase("items");
  return schema;
}

Json typed_query(const std::string& name, const std::string& about, Json schema) {
  const bool list = schema["type"] == "array";
  Json parameter = query(name, about);
  parameter["schema"] = std::move(schema);
  if (list) parameter["explode"] = false;
  return parameter;
}

}  // namespace cordillera::server::openapi
