#include "server/api/public_address.h"

#include <algorithm>
#include <string_view>

#include "pipeline/encode/strange_json.h"
#include "proto/letters.h"
#include "server/api/api.h"

namespace cordillera::server {
namespace {

constexpr std::size_t kLongest = 255;

/// The first word of a header, as the proxy next to the client wrote it; empty if it has other characters than these.
std::string word(const Request& request, const std::string& name, std::string_view others) {
  std::string text = request.header(name).value_or("");
  text.resize(std::min(text.find(','), text.size()));
  text.erase(text.find_last_not_of(' ') + 1);
  const auto may_stand = [&](char c) { return proto::is_letter_or_digit(c) || others.find(c) != others.npos; };
  const bool fine = std::all_of(text.begin(), text.end(), may_stand);
  return fine && text.size() <= kLongest ? text : "";
}

}  // namespace

std::string public_folder(const Request& request) {
  constexpr std::string_view kInHost = ".-_:[]";
  std::string host = word(request, "x-forwarded-host", kInHost);
  if (host.empty()) host = word(request, "host", kInHost);
  if (host.empty()) return "";
  const std::string scheme = word(request, "x-forwarded-proto", "") == "https" ? "https" : "http";
  return scheme + "://" + host + public_prefix(request) + request.path.substr(0, request.path.rfind('/') + 1);
}

std::string public_prefix(const Request& request) {
  std::string prefix = word(request, "x-forwarded-prefix", "/.-_~");
  while (!prefix.empty() && prefix.back() == '/') prefix.pop_back();
  const std::size_t begin = std::min(prefix.find_first_not_of('/'), prefix.size());  // two at the start would begin a host
  return prefix.empty() ? "" : "/" + prefix.substr(begin);
}

std::string public_path(const Request& request, const std::string& id) { return public_prefix(request) + "/v1/datasets/" + id; }

void make_absolute(const Request& request, Response& response) {
  const std::string folder = public_folder(request);
  Json json = response.status == 200 ? pipeline::json_of_stranger(response.bytes()) : Json();
  if (folder.empty() || !json.is_object()) return;
  for (Json& path : json["tiles"]) path = folder + path.get<std::string>();
  response.body = json.dump(1, ' ', false, Json::error_handler_t::replace);
  response.shared = nullptr;
  const std::string etag = pipeline::faces::document(response.body).etag;
  for (auto& [name, value] : response.headers) {
    if (name == "ETag") value = quoted(etag);
    // Of a version, too: its tiles never change, the address that they have here may.
    if (name == "Cache-Control" && value.ends_with("immutable")) value.replace(value.find(','), value.npos, ", no-cache");
  }
  response.set("Vary", kAddressHeaders);
}

}  // namespace cordillera::server
