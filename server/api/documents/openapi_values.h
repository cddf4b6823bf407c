#pragma once
// Schemas of the values in bodies and answers, as OpenAPI writes them.
#include <string>

#include "server/http/json.h"

namespace cordillera::server::openapi {

inline Json typed(const char* type, const char* about) { return {{"type", type}, {"description", about}}; }
inline Json text(const char* about) { return typed("string", about); }
inline Json number(const char* about) { return typed("number", about); }
inline Json whole(const char* about) { return typed("integer", about); }
/// Or null.
inline Json nullable(Json schema) {
  schema["type"] = Json::array({schema["type"], "null"});
  return schema;
}
/// One of the components.
inline Json ref(const char* schema) { return {{"$ref", std::string("#/components/schemas/") + schema}}; }
inline Json or_null(const char* schema) { return {{"oneOf", Json::array({ref(schema), {{"type", "null"}}})}}; }
inline Json array_of(const Json& items, const char* about) {
  return {{"type", "array"}, {"items", items}, {"description", about}};
}
inline Json list_of(const char* schema) { return {{"type", "array"}, {"items", ref(schema)}}; }
inline Json object(const Json& properties, const Json& required) {
  return {{"type", "object"}, {"properties", properties}, {"required", required}};
}
/// With any names.
inline Json map_of(const Json& values, const char* about) {
  return {{"type", "object"}, {"additionalProperties", values}, {"description", about}};
}

/// Into the schemas among the components: what is read of a dataset and of the service, and what STAC and TileJSON have.
void add_answers(Json& schemas);

}  // namespace cordillera::server::openapi
