#pragma once
// Conditions of a request (RFC 9110, 13): what a client may know of a resource for its request to be carried out.
#include <string>

#include "server/http/json.h"
#include "server/http/message.h"

namespace cordillera::server {

/// Whether If-Match lets the request pass: it is none, is *, or names the tag as a strong one. tag: of the resource, in quotes;
/// empty: it has none.
bool if_match_holds(const Request& request, const std::string& tag);
/// Whether If-None-Match names the tag, which stands in quotes.
bool names_tag(const std::string& if_none_match, const std::string& tag);
/// 412. header: the condition that is false; tag: what it would have to name, or empty.
proto::Problem condition_failed(const char* header, const std::string& tag);

/// What no cache keeps, with a strong tag: whoever wants to change it says with If-Match what was read.
Response guarded_json(Json json);
/// Whether it is such an answer, or the 304 of one.
bool is_guarded(const Response& response);
/// A strong tag is of bytes, and a coding has others: its name is added to the tag.
void name_coding(Response& response, const std::string& coding);

}  // namespace cordillera::server
