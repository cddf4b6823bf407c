#include "server/api/documents/openapi_operation.h"

namespace cordillera::server::openapi {
namespace {

Json problem_answer() { return {{"$ref", "#/components/responses/problem"}}; }

/// Every brace of a path as a required parameter.
Json path_parameters(const std::string& path) {
  Json parameters = Json::array();
  for (std::size_t brace = path.find('{'); brace != path.npos; brace = path.find('{', brace + 1)) {
    parameters.push_back({{"$ref", "#/components/parameters/" + path.substr(brace + 1, path.find('}', brace) - brace - 1)}});
  }
  return parameters;
}

}  // namespace

Json content_of(const std::string& type, const char* schema) {
  const Json form = schema != nullptr ? Json{{"$ref", std::string("#/components/schemas/") + schema}} : Json::object();
  return {{type, {{"schema", form}}}};
}

Json bytes_schema() { return {{"type", "string"}, {"format", "binary"}}; }

Json bytes_of(const std::string& type) { return {{type, {{"schema", bytes_schema()}}}}; }

Json answer(const std::string& about, const std::string& type, const char* schema) {
  return {{"description", about}, {"content", content_of(type, schema)}};
}

Json operation(const std::string& id, const std::string& tag, const Operation& from) {
  Json json;
  json["operationId"] = id;
  json["tags"] = Json::array({tag});
  json["summary"] = from.summary;
  if (!from.parameters.empty()) json["parameters"] = from.parameters;
  if (!from.body.empty()) json["requestBody"] = from.body;
  json["responses"] = from.good;
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
  good["206"] = {{"description", "The part that Range asked for"}};
  good["416"] = problem_answer();
}

Json good_answers(const std::string& about, const std::string& type) {
  Json good;
  good["200"] = answer(about, type);
  good["200"]["headers"] = {{"ETag", {{"$ref", "#/components/headers/etag"}}},
                            {"Server-Timing", {{"$ref", "#/components/headers/timing"}}}};
  good["304"] = {{"description", "Nothing changed since the ETag in If-None-Match"}};
  return good;
}

}  // namespace cordillera::server::openapi
