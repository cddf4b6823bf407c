#include "server/http/conditions.h"

#include <string_view>

#include "server/http/digest.h"

namespace cordillera::server {
namespace {

constexpr std::string_view kCodingMarks[] = {"-br\"", "-gzip\""};

/// Tags are hex, so that what follows a dash is the coding.
std::string without_coding(std::string_view tag) {
  for (const std::string_view mark : kCodingMarks) {
    if (tag.ends_with(mark)) return std::string(tag.substr(0, tag.size() - mark.size())) + '"';
  }
  return std::string(tag);
}

}  // namespace

bool if_match_holds(const Request& request, const std::string& tag) {
  const auto header = request.header("if-match");
  if (!header || *header == "*") return true;
  const std::string_view list = *header;
  for (std::size_t at = list.find('"'); at != list.npos;) {
    const std::size_t end = list.find('"', at + 1);
    if (end == list.npos) return false;
    const bool weak = at >= 2 && list.substr(at - 2, 2) == "W/";
    if (!weak && !tag.empty() && without_coding(list.substr(at, end - at + 1)) == tag) return true;
    at = list.find('"', end + 1);
  }
  return false;
}

bool names_tag(const std::string& if_none_match, const std::string& tag) {
  if (if_none_match == "*") return true;
  // Tags are hex in quotes, so finding one as a substring is finding it in the list; W/ before it does not matter here.
  const std::string opaque = tag.substr(tag.find('"')), open = opaque.substr(0, opaque.size() - 1);
  if (if_none_match.find(opaque) != std::string::npos) return true;
  for (const std::string_view mark : kCodingMarks) {
    if (if_none_match.find(std::string(open).append(mark)) != std::string::npos) return true;
  }
  return false;
}

proto::Problem condition_failed(const char* header, const std::string& tag) {
  const std::string is = tag.empty() ? "it has no ETag that a condition could name" : "its ETag is " + tag;
  return {"precondition-failed", std::string("the resource is not as ") + header + " says: " + is,
          "reading it again, and then deciding anew", header};
}

Response guarded_json(Json json) {
  Response response = json_response(200, std::move(json));
  response.set("Cache-Control", "no-store");
  response.set("ETag", quoted(digest(response.body).substr(0, 32)));
  return response;
}

bool is_guarded(const Response& response) {
  return response.header("Cache-Control") == "no-store" && response.header("ETag").starts_with('"');
}

void name_coding(Response& response, const std::string& coding) {
  for (auto& [name, value] : response.headers) {
    if (name == "ETag" && value.ends_with('"')) value.insert(value.size() - 1, "-" + coding);
  }
}

}  // namespace cordillera::server
