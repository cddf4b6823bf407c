#pragma once
// Rows of option tables as the API's description has them: parameters of a query, and members of a body.
#include <functional>
#include <string>
#include <string_view>

#include "server/api/documents/openapi_operation.h"
#include "server/options/table_reader.h"

namespace cordillera::server::openapi {

/// Whether a row takes this text. A row is asked what it takes, so no list of kinds beside the table can say something else.
using Takes = std::function<bool(std::string_view)>;
/// A switch, a number, a choice, numbers between commas, or a text. accepted: what the row says of its values.
Json schema_of_values(const std::string& accepted, const Takes& takes);
/// The same where a list is one text with commas between, as in fields of a form.
Json schema_of_field(Json schema);
/// A parameter of a query with this schema. A list is one value with commas between.
Json typed_query(const std::string& name, const std::string& about, Json schema);

template <class Wish>
Json schema_of(const OptionOf<Wish>& option) {
  return schema_of_values(option.accepted, [&option](std::string_view text) {
    Wish wish{};
    return !option.apply(text, wish);
  });
}

template <class Wish>
std::string about(const OptionOf<Wish>& option) {
  return option.help + "; accepted: " + option.accepted;
}

/// The rows of a table as parameters of a query.
template <class Wish>
Json parameters_of(const std::vector<OptionOf<Wish>>& table) {
  Json parameters = Json::array();
  for (const OptionOf<Wish>& option : table) {
    if (option.open_to == OpenTo::requests)
      parameters.push_back(typed_query(spelt(option.name, Spelling::query), about(option), schema_of(option)));
  }
  return parameters;
}

/// The same as members of JSON.
template <class Wish>
Json members_of(const std::vector<OptionOf<Wish>>& table) {
  Json members = Json::object();
  for (const OptionOf<Wish>& option : table) {
    if (option.open_to != OpenTo::requests) continue;
    Json& member = members[spelt(option.name, Spelling::query)] = schema_of(option);
    member["description"] = about(option);
  }
  return members;
}

/// The same as fields of a form.
template <class Wish>
Json fields_of(const std::vector<OptionOf<Wish>>& table) {
  Json fields = members_of(table);
  for (Json& field : fields) field = schema_of_field(std::move(field));
  return fields;
}

}  // namespace cordillera::server::openapi
