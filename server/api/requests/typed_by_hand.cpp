#include "server/api/requests/typed_by_hand.h"

#include "server/http/json.h"

namespace cordillera::server {
namespace {

using proto::Problem;

const std::string kCollection = "/v1/datasets";
constexpr std::size_t kMostJson = std::size_t{64} << 10;

bool reads(const Request& request) { return request.method == "GET" || request.method == "HEAD"; }

bool has_slash(const std::string& path) { return path.starts_with("/v1/") && path.ends_with('/'); }

std::string stripped(std::string path) {
  path.pop_back();
  return path;
}

/// The value of a member as a query would have it; lists as their items between commas.
std::optional<std::string> query_value(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_boolean()) return value.get<bool>() ? "1" : "0";
  if (value.is_number()) return plain_numbers(value).dump();
  if (!value.is_array() || value.empty()) return std::nullopt;
  std::string text;
  for (const Json& item : value) {
    if (!item.is_number() && !item.is_string()) return std::nullopt;
    if (!text.empty()) text += ',';
    text += *query_value(item);
  }
  return text;
}

}  // namespace

Route route_meant(const Request& request) {
  Route route = parse_route(request.path);
  if (route.resource != Resource::none || reads(request)) return route;
  if (has_slash(request.path)) return parse_route(stripped(request.path));
  if (request.method != "PUT" || name_in_path(request).empty()) return route;
  route.resource = Resource::datasets;
  return route;
}

std::string name_in_path(const Request& request) {
  const std::string before = kCollection + "/";
  const std::string name = request.path.starts_with(before) ? request.path.substr(before.size()) : "";
  return name.find('/') == name.npos ? name : "";
}

std::optional<Response> without_slash(const Request& request) {
  if (!reads(request) || !has_slash(request.path)) return std::nullopt;
  const std::string path = stripped(request.path);
  if (parse_route(path).resource == Resource::none) return std::nullopt;
  Response response;
  response.status = 308;
  response.set("Location", "../" + path.substr(path.rfind('/') + 1));
  response.set("Content-Type", "text/plain");
  response.body = "The address has no slash at its end: " + path + "\n";
  return response;
}

proto::Result<Request> with_json_as_query(const Request& request) {
  const std::string accepted = "an object of options, such as {\"source\": \"https://example.org/dem.tif\", \"error\": 5}";
  std::string text;
  const bool ended = request.read_body && request.read_body([&](std::string_view piece) {
    text += piece;
    return text.size() <= kMostJson;
  });
  if (text.size() > kMostJson) return Problem{"json-invalid", "the JSON has more than 64 KiB", accepted, ""};
  const Json json = Json::parse(text, nullptr, false);
  if (!ended || !json.is_object()) return Problem{"json-invalid", "the body is no JSON object", accepted, ""};
  Request plain = request;
  for (const auto& [name, member] : json.items()) {
    if (member.is_null()) continue;
    const auto value = query_value(member);
    if (!value) return Problem{"json-invalid", "the member " + name.substr(0, 100) + " is neither text, a number, true or false, nor a list of these", accepted, name.substr(0, 100)};
    plain.query.emplace_back(name, *value);
  }
  for (const char* gone : {"content-type", "content-length", "transfer-encoding", "content-encoding"}) plain.headers.erase(gone);
  plain.read_body = nullptr;
  return plain;
}

}  // namespace cordillera::server
