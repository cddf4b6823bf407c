#pragma once
// Tables of options beside those of a build (options.h): of a mesh, of a list, of an archive, of the published algorithm. One
// reader serves them.
#include <algorithm>
#include <functional>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "server/options/option_values.h"
#include "server/options/options.h"

namespace cordillera::server {

/// A row: what may be said of a Wish.
template <class Wish>
struct OptionOf {
  std::string name;   ///< in a query; with -- before it on the command line
  std::string value;  ///< what stands for the value in help
  std::string help;
  std::string accepted;
  std::function<Complaint(std::string_view text, Wish& wish)> apply;  ///< a function of one name: sources are compiled as one
};

/// Words of a table's problems.
struct TableWords {
  std::string dashes = "";     ///< before every name as it was given: "--" of the command line
  std::string of = "";         ///< what is asked with them: " of a list"
  std::string elsewhere = "";  ///< what else may be meant, behind the names that there are
};

/// Tells the wish what was given: names of the table, each once. "option-unknown", "option-repeated" or "option-invalid" of the
/// first that is not so.
template <class Wish>
std::optional<proto::Problem> read_options(const std::vector<OptionOf<Wish>>& table, const Given& given, const TableWords& words,
                                           Wish& wish) {
  std::set<std::string> seen;
  for (const auto& [name, value] : given) {
    const auto option = std::find_if(table.begin(), table.end(), [&, &wanted = name](const OptionOf<Wish>& candidate) {
      return words.dashes + candidate.name == wanted;
    });
    if (option == table.end()) {
      std::string all;
      for (const OptionOf<Wish>& known : table) all += (all.empty() ? "" : ", ") + known.name;
      return unknown_name("unknown query parameter", name, words.of, all + words.elsewhere);
    }
    if (!seen.insert(name).second) return given_twice(name, "each parameter once");
    if (const Complaint complaint = option->apply(value, wish)) return wrong_value(name, value, *complaint, option->accepted);
  }
  return std::nullopt;
}

}  // namespace cordillera::server
