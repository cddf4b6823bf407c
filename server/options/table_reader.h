#pragma once
// Tables of options and the one that reads them. Query strings, bodies, the command line, the config file and environment
// variables are all read so, and a name, a range or a sentence of help cannot differ between them. The tables: options.h of a
// build and a service, and beside what they belong to those of a mesh, a list, a change, the published algorithm.
#include <functional>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/result.h"
#include "server/options/option_values.h"

namespace cordillera::server {

/// How the user spelt a name: vertical_datum, --vertical-datum, vertical-datum or CORDILLERA_VERTICAL_DATUM.
enum class Spelling { query, command_line, config_file, environment };
/// name: as a table has it.
std::string spelt(const std::string& name, Spelling spelling);

/// One layer of options, in the order given: names as the user spelt them.
using Given = std::vector<std::pair<std::string, std::string>>;

/// Who may say an option. A request that says one of operators is understood, and told so; what lists the words of requests
/// leaves it out.
enum class OpenTo { requests, operators };

/// A row: what may be said of a Wish.
template <class Wish>
struct OptionOf {
  std::string name;   ///< as on the command line, without the dashes: "vertical-datum"
  std::string value;  ///< what stands for the value in help: "METRES"; empty: a switch
  std::string help;
  std::string accepted;  ///< for problems and help: what values there are
  std::function<Complaint(std::string_view text, Wish& wish)> apply;
  std::string alias = {};  ///< an older name that still works
  OpenTo open_to = OpenTo::requests;
};

/// A row for a whole number. place: where a wish has it, a member or what gives a reference.
template <class Wish, class Place>
OptionOf<Wish> whole_number(const char* name, const char* value, const char* help, WholeRange range, Place place) {
  const auto apply = [=](std::string_view text, Wish& wish) { return read_whole(text, range, &std::invoke(place, wish)); };
  return {name, value, help, accepted_in(range), apply};
}

/// The rows of a table, told to a part of another wish.
template <class Wish, class Part>
std::vector<OptionOf<Wish>> lifted(const std::vector<OptionOf<Part>>& table, Part Wish::*part) {
  std::vector<OptionOf<Wish>> rows;
  for (const OptionOf<Part>& row : table) {
    const auto apply = [apply = row.apply, part](std::string_view text, Wish& wish) { return apply(text, wish.*part); };
    rows.push_back({row.name, row.value, row.help, row.accepted, apply, row.alias, row.open_to});
  }
  return rows;
}

/// Words of a table's problems.
struct TableWords {
  Spelling spelling = Spelling::query;
  std::string what = {};      ///< empty: "unknown query parameter", or "unknown option"
  std::string of = {};        ///< what is asked with them: " of a list"
  std::string accepted = {};  ///< of an unknown name; empty: the names of the table
  std::string beside = {};    ///< behind these
};

/// A name of a table, or its older one.
struct OptionName {
  std::string name, alias;
  OpenTo open_to = OpenTo::requests;
};
template <class Wish>
std::vector<OptionName> names_in(const std::vector<OptionOf<Wish>>& table) {
  std::vector<OptionName> names;
  for (const OptionOf<Wish>& option : table) names.push_back({option.name, option.alias, option.open_to});
  return names;
}

/// The place among names of what somebody spelt so. Over HTTP the command line's dashes are understood, too, and in a config file
/// HTTP's underscores.
std::optional<std::size_t> place_of(const std::string& said, const std::vector<OptionName>& names, Spelling spelling);
/// "vertical_datum, nodata": as spelt, with commas between; of a query those that are open to requests.
std::string listed(const std::vector<OptionName>& names, Spelling spelling);
/// "option-unknown", with the name that was meant, where one is near, or where other programs call it so.
proto::Problem unknown_option(const std::string& said, const std::vector<OptionName>& names, const TableWords& words);
/// "option-repeated".
proto::Problem given_twice(const std::string& name);
/// Whether one of them has this name, spelt so.
bool is_given(const Given& options, std::string_view name);

/// Tells the wish what was given: names of the table, each once. "option-unknown", "option-repeated" or "option-invalid" of the
/// first that is not so.
template <class Wish>
std::optional<proto::Problem> read_options(const std::vector<OptionOf<Wish>>& table, const Given& given, const TableWords& words,
                                           Wish& wish) {
  const std::vector<OptionName> names = names_in(table);
  std::vector<bool> seen(table.size(), false);
  for (const auto& [name, value] : given) {
    const auto place = place_of(name, names, words.spelling);
    if (!place) return unknown_option(name, names, words);
    if (seen[*place]) return given_twice(name);
    seen[*place] = true;
    const OptionOf<Wish>& option = table[*place];
    if (const Complaint complaint = option.apply(value, wish)) return wrong_value(name, value, *complaint, option.accepted);
  }
  return std::nullopt;
}

}  // namespace cordillera::server
