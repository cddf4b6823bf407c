#pragma once
// The pieces that the API's description is put together from: operations, parameters and answers, as OpenAPI writes them.
#include <cstdint>
#include <initializer_list>
#include <optional>
#include <string>

#include "server/http/json.h"

namespace cordillera::server::openapi {

/// What is said of an operation beside what its route has.
struct Operation {
  std::string summary;
  Json good;             ///< by status
  Json parameters = {};  ///< beside those of the path
  Json body = {};        ///< of the request
};

/// With what follows from the words: the answers that every operation may give, of a GET with an ETag 304 and If-None-Match, of
/// ranges their headers, of Prefer what was made of it. method: "get".
Json operation(const std::string& id, const std::string& tag, const std::string& method, Operation words);

Json query(const std::string& name, const std::string& about);
Json header(const char* name, const char* about);
/// A whole number; no most: only what 64 bits hold.
Json counted(Json parameter, std::int64_t least = 0, std::optional<std::int64_t> most = {});
/// Without it the request is refused.
Json required(Json parameter);

/// The item of a path among all paths, with the parameters in its address.
Json& item(Json& paths, const std::string& path);

/// By media type. schema: its name among the components; null: a text, an object or bytes, as the type says.
Json content_of(const std::string& type, const char* schema);
/// A body that is no text: a raster, or a part of one.
Json bytes_of(const std::string& type);
/// As generators of clients know it, which take a schema that says nothing for JSON.
Json bytes_schema();
Json answer(const std::string& about, const std::string& type, const char* schema = nullptr);
/// An answer without a body, and its headers.
Json bare(const char* about, std::initializer_list<const char*> headers);
/// 200 with an ETag, of which an operation() that reads has 304, too.
Json tagged_answers(const std::string& about, const std::string& type, const char* schema = nullptr);
/// Headers of an answer, by their names among the components.
void add_headers(Json& good, const char* status, std::initializer_list<const char*> names);
/// Those of ranges of bytes of the 200.
void add_ranges(Json& good);

}  // namespace cordillera::server::openapi
