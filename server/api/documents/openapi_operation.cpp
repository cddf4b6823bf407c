#include "server/api/documents/openapi_operation.h"

#include <algorithm>

namespace cordillera::server::openapi {
namespace {

Json problem_answer(const char* name = "problem") { return {{"$ref", std::string("#/components/responses/") + name}}; }

Json parameter_ref(const std::string& name) { return {{"$ref", "#/components/parameters/" + name}}; }

/// Every brace of a path as a required parameter.
Json path_parameters(const std::string& path) {
  Json parameters = Json::array();
  for (std::size_t brace = path.find('{'); brace != path.npos; brace = path.find('{', brace + 1)) {
    parameters.push_back(parameter_ref(path.substr(brace + 1, path.find('}', brace) - brace - 1)));
  }
  return parameters;
}

void add_parameter(Operation& words, const std::string& name) {
  if (words.parameters.is_null()) words.parameters = Json::array();
  words.parameters.push_back(parameter_ref(name));
}

/// Of what is read and has a tag.
void add_conditions(Operation& words) {
  const auto whole = words.good.find("200");
  if (whole == words.good.end() || !whole->contains("headers") || !(*whole)["headers"].contains("ETag")) return;
  words.good["304"] = {{"description", "Nothing changed since the ETag in If-None-Match"}};
  add_headers(words.good, "304", {"ETag"});
  add_parameter(words, "If-None-Match");
  if (!words.good.contains("206")) return;
  add_parameter(words, "Range");
  add_parameter(words, "If-Range");
}

/// Of what takes Prefer.
void add_preferences(Operation& words) {
  const bool prefers = std::any_of(words.parameters.begin(), words.parameters.end(),
                                   [](const Json& parameter) { return parameter.value("name", "") == "Prefer"; });
  if (!prefers) return;
  for (const char* status : {"200", "201", "202"}) {
    if (words.good.contains(status)) add_headers(words.good, status, {"Preference-Applied"});
  }
}

}  // namespace

Json content_of(const std::string& type, const char* schema) {
  if (schema != nullptr) return {{type, {{"schema", {{"$ref", std::string("#/components/schemas/") + schema}}}}}};
  if (type.starts_with("text/")) return {{type, {{"schema", {{"type", "string"}}}}}};
  return type == "application/json" || type == kOpenApiType ? Json{{type, {{"schema", {{"type", "object"}}}}}} : bytes_of(type);
}

Json bytes_schema() { return {{"type", "string"}, {"format", "binary"}}; }

Json bytes_of(const std::string& type) { return {{type, {{"schema", bytes_schema()}}}}; }

Json answer(const std::string& about, const std::string& type, const char* schema) {
  return {{"description", about}, {"content", content_of(type, schema)}};
}

Json operation(const std::string& id, const std::string& tag, const std::string& method, Operation words) {
  if (method == "get") add_conditions(words);
  add_preferences(words);
  Json json;
  json["operationId"] = id;
  json["tags"] = Json::array({tag});
  json["summary"] = words.summary;
  if (!words.parameters.empty()) json["parameters"] = words.parameters;
  if (!words.body.empty()) json["requestBody"] = words.body;
  json["responses"] = words.good;
  json["responses"]["4XX"] = problem_answer();
  json["responses"]["5XX"] = problem_answer();
  return json;
}

Json query(const std::string& name, const std::string& about) {
  return {{"name", name}, {"in", "query"}, {"description", about}, {"schema", {{"type", "string"}}}};
}
Json header(const char* name, const char* about) {
  return {{"name", name}, {"in", "header"}, {"description", about}, {"schema", {{"type", "string"}}}};
}
Json counted(Json parameter, std::int64_t least, std::optional<std::int64_t> most) {
  Json& schema = parameter["schema"] = {{"type", "integer"}, {"minimum", least}};
  if (most) schema["maximum"] = *most;
  if (!most || *most > INT32_MAX) schema["format"] = "int64";  // generators of clients take 32 bits else
  return parameter;
}
Json required(Json parameter) {
  parameter["required"] = true;
  return parameter;
}

Json& item(Json& paths, const std::string& path) {
  Json& made = paths[path];
  if (Json parameters = path_parameters(path); made.is_null() && !parameters.empty()) made["parameters"] = std::move(parameters);
  return made;
}

Json bare(const char* about, std::initializer_list<const char*> headers) {
  Json good = {{"description", about}};
  for (const char* name : headers) good["headers"][name] = {{"schema", {{"type", "string"}}}};
  return good;
}

void add_ranges(Json& good) {
  good["206"] = {{"description", "The part that Range asked for"}, {"content", good["200"]["content"]}};
  add_headers(good, "206", {"ETag", "Content-Range"});
  good["416"] = problem_answer("range_beyond");
}

Json tagged_answers(const std::string& about, const std::string& type, const char* schema) {
  Json good;
  good["200"] = answer(about, type, schema);
  add_headers(good, "200", {"ETag"});
  return good;
}

void add_headers(Json& good, const char* status, std::initializer_list<const char*> names) {
  for (const char* name : names) good[status]["headers"][name] = {{"$ref", std::string("#/components/headers/") + name}};
}

}  // namespace cordillera::server::openapi
