#pragma once
// Requests as hands type them, said as the API has them: a PUT on the collection, a slash too many, options as JSON.
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "proto/result.h"
#include "server/api/requests/routes.h"
#include "server/http/message.h"

namespace cordillera::server {

/// What the request's path means: for one that writes, also with a slash at its end. A PUT of …/v1/datasets/dem.tif, which curl
/// -T makes of …/v1/datasets/, is one on the collection.
Route route_meant(const Request& request);

/// The name that curl added to the path of the collection (curl -T file URL/); empty where there is none.
std::string name_in_path(const Request& request);

/// To a GET with a slash too many: 308, for relative links in the answer would lead elsewhere. None: there is nothing at the path
/// without it, or a file of the viewer.
std::optional<Response> without_slash(const Request& request);

/// Members of JSON that are texts and nothing else. null empties them; null of any other member is refused.
using TextMembers = std::vector<std::string>;

/// A body of type application/json, {"source": "https://…", "error": 5}: its members become parameters of the query, and the body
/// is gone. texts: nullptr: what is null is left out, but for what names a raster.
proto::Result<Request> with_json_as_query(const Request& request, const TextMembers* texts = nullptr);

/// A body of type application/x-www-form-urlencoded. What curl -d sends, source=…&error=5 or the JSON above, becomes parameters
/// in the same way. curl --data-binary says that type of a raster, too: any other body stays, as it came.
proto::Result<Request> with_typed_body_as_query(const Request& request, const TextMembers* texts = nullptr);
/// The request, but its body ends early, and stripped is set, where it is a raster out of which curl -d has taken line breaks and
/// zero bytes.
Request with_body_looked_at(const Request& request, const std::shared_ptr<bool>& stripped);
proto::Problem body_stripped();
/// Takes out what the headers say of a body whose parts have gone elsewhere.
void forget_body_headers(Request& request);

}  // namespace cordillera::server
