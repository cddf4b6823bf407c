#include "server/api/requests/typed_by_hand.h"

#include <algorithm>
#include <regex>
#include <set>

#include "proto/numbers.h"
#include "server/api/requests/delivery.h"
#include "server/http/gzip.h"
#include "server/http/json.h"
#include "server/http/percent.h"
#include "server/options/table_reader.h"

namespace cordillera::server {
namespace {

using proto::Problem;

const std::string kCollection = "/v1/datasets";
constexpr std::size_t kMostJson = std::size_t{64} << 10;

bool reads(const Request& request) { return request.method == "GET" || request.method == "HEAD"; }

bool has_slash(const std::string& path) { return path.size() > 1 && path.ends_with('/'); }

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

/// texts: of a request that changes what is there; null: of one that posts.
Problem not_json(const TextMembers* texts, const std::string& what, const std::string& member = "") {
  const char* posted = R"({"source": "https://example.org/dem.tif", "error": 5})";
  const char* changed = R"({"title": "White Mountains", "private": true})";
  return {"json-invalid", what, std::string("an object of options, such as ") + (texts == nullptr ? posted : changed), member};
}

/// The request without its body: it is in the query now.
Request bodiless(Request request) {
  forget_body_headers(request);
  request.read_body = nullptr;
  return request;
}

bool is_text(const std::string& name, const TextMembers* texts) {
  return texts != nullptr && std::find(texts->begin(), texts->end(), name) != texts->end();
}

/// What a member that is null stands for; nullopt: it is left out.
proto::Result<std::optional<std::string>> value_of_null(const std::string& name, const TextMembers* texts) {
  if (name == "source" || name == "upload") return not_json(texts, "the member " + name + " is null: it names no raster", name);
  if (texts == nullptr) return std::optional<std::string>();
  if (is_text(name, texts)) return std::optional<std::string>("");
  const std::string called = name.substr(0, 100);
  return not_json(texts, "the member " + called + " is null, and it always has a value", called);
}

/// Reads JSON; problem: set where the object has a member twice, which readers of JSON else pass over.
Json read_object(std::string_view text, bool throws, std::optional<Problem>& problem) {
  std::set<std::string> names;
  const auto look = [&](int depth, Json::parse_event_t event, Json& parsed) {
    if (event == Json::parse_event_t::key && depth == 1 && !names.insert(parsed.get<std::string>()).second && !problem)
      problem = given_twice(parsed.get<std::string>().substr(0, 100));
    return true;
  };
  return Json::parse(text, look, throws);
}

proto::Result<Request> with_members(const Request& request, const Json& json, const TextMembers* texts) {
  Request plain = bodiless(request);
  for (const auto& [name, member] : json.items()) {
    if (member.is_null()) {
      const auto text = value_of_null(name, texts);
      if (!text) return text.problem();
      if (*text) plain.query.emplace_back(name, **text);
      continue;
    }
    if (!member.is_string() && is_text(name, texts)) return not_json(texts, "the member " + name + " is no text", name);
    if (name == "source" && member.is_array() && member.size() > 1) return several_sources();
    const auto value = query_value(member);
    if (!value)
      return not_json(texts,
                      "the member " + name.substr(0, 100) + " is neither text, a number, true or false, nor a list of these",
                      name.substr(0, 100));
    plain.query.emplace_back(name, *value);
  }
  return plain;
}

/// A body of at most kMostJson bytes, whose length is known. A compressed one may become as long as it likes.
bool is_short(const Request& request) {
  if (!coding_of(request.header("content-encoding").value_or("")).empty()) return false;
  const auto bytes = proto::number<std::size_t>(request.header("content-length").value_or(""));
  return bytes && *bytes <= kMostJson && request.read_body;
}

/// The bytes at the beginning of a raster, as far as they tell whether something was left out of them.
class Beginning {
 public:
  /// Whether a raster without its line breaks and zero bytes has come. One of text may have none of either (USGS DEM), but no
  /// rows of numbers.
  bool add(std::string_view bytes) {
    const std::string_view part = bytes.substr(0, kLooked - std::min(kLooked, seen_));
    seen_ += part.size();
    first_.append(part.substr(0, kLeast - std::min(kLeast, first_.size())));
    for (const unsigned char c : part) {
      whole_ = whole_ || c == 0 || c == '\n' || c == '\r';
      binary_ = binary_ || c >= 0x80 || c < ' ';
    }
    return seen_ == kLooked && stripped();
  }
  bool stripped() const { return seen_ >= kLeast && !whole_ && (binary_ || is_rows()); }

 private:
  static constexpr std::size_t kLooked = 4096, kLeast = 64;

  /// Points of an .xyz, or the head of an .asc.
  bool is_rows() const {
    static const std::regex kRows(R"([ \t]*(ncols[ \t]|([-+.0-9eE]*[0-9][-+.0-9eE]*[ \t,;]+){2}[-+.]?[0-9]).*)",
                                  std::regex::icase);
    return std::regex_match(first_, kRows);
  }

  std::size_t seen_ = 0;
  std::string first_;
  bool whole_ = false, binary_ = false;
};

/// name=… of one line: no raster begins so and goes on without control characters.
bool is_fields(std::string_view text) {
  const auto in_name = [](char c) { return (c >= 'a' && c <= 'z') || c == '_' || c == '-'; };
  const auto control = [](unsigned char c) { return c < 0x20 || c == 0x7f; };
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == text.npos) return false;
  return std::all_of(text.begin(), text.begin() + static_cast<std::ptrdiff_t>(equals), in_name) &&
         std::none_of(text.begin(), text.end(), control);
}

Request with_fields(const Request& request, std::string_view text) {
  Request plain = bodiless(request);
  while (!text.empty()) {
    const std::string_view field = text.substr(0, text.find('&'));
    text.remove_prefix(std::min(text.size(), field.size() + 1));
    const std::size_t equals = std::min(field.find('='), field.size());
    const auto decoded = [&](std::size_t from, std::size_t count) {
      return percent_decoded(field.substr(std::min(from, field.size()), count), AddressPart::query);
    };
    if (!field.empty()) plain.query.emplace_back(decoded(0, equals), decoded(equals + 1, field.npos));
  }
  return plain;
}

}  // namespace

void forget_body_headers(Request& request) {
  for (const char* gone : {"content-type", "content-length", "transfer-encoding", "content-encoding"})
    request.headers.erase(gone);
}

Route route_meant(const Request& request) {
  Route route = parse_route(request.path);
  if (route.row != nullptr || reads(request)) return route;
  if (has_slash(request.path)) return parse_route(stripped(request.path));
  return request.method == "PUT" && !name_in_path(request).empty() ? parse_route(kCollection) : route;
}

std::string name_in_path(const Request& request) {
  const std::string before = kCollection + "/";
  const std::string name = request.path.starts_with(before) ? request.path.substr(before.size()) : "";
  return name.find('/') == name.npos ? name : "";
}

std::optional<Response> without_slash(const Request& request) {
  if (!reads(request) || !has_slash(request.path)) return std::nullopt;
  const std::string path = stripped(request.path);
  const Route route = parse_route(path);
  if (route.row == nullptr || route.is(RouteRow::kElsewhere)) return std::nullopt;
  Response response;
  response.status = 308;
  response.set("Location", "../" + path.substr(path.rfind('/') + 1));
  response.set("Content-Type", "text/plain");
  response.body = "The address has no slash at its end: " + path + "\n";
  return response;
}

proto::Result<Request> with_json_as_query(const Request& request, const TextMembers* texts) {
  std::string text;
  const bool ended = request.read_body && request.read_body([&](std::string_view piece) {
    text += piece;
    return text.size() <= kMostJson;
  });
  if (text.size() > kMostJson) return not_json(texts, "the JSON has more than 64 KiB");
  if (!ended) return not_json(texts, "the body is no JSON object");
  try {
    std::optional<Problem> twice;
    const Json json = read_object(text, true, twice);
    if (!json.is_object()) return not_json(texts, "the body is JSON, but no object");
    if (twice) return *twice;
    return with_members(request, json, texts);
  } catch (const Json::parse_error& error) {
    return not_json(
        texts, text.empty() ? "the body is empty" : "the body is no JSON from its byte " + std::to_string(error.byte) + " on");
  } catch (const Json::out_of_range&) {
    return not_json(texts, "the body has a number that is greater than any that a program can hold");
  }
}

Request with_body_looked_at(const Request& request, const std::shared_ptr<bool>& stripped) {
  Request looked = request;
  looked.read_body = [read = request.read_body, stripped](const Request::Sink& sink) {
    Beginning beginning;
    const bool ended = read([&](std::string_view piece) { return !(*stripped = beginning.add(piece)) && sink(piece); });
    *stripped = *stripped || beginning.stripped();
    return ended && !*stripped;
  };
  return looked;
}

Problem body_stripped() {
  return {"body-stripped", "the body is a raster without its line breaks and zero bytes, as curl -d @dem.tif sends it",
          "curl -T dem.tif …, curl --data-binary @dem.tif …, or curl -F file=@dem.tif …", ""};
}

proto::Result<Request> with_typed_body_as_query(const Request& request, const TextMembers* texts) {
  if (!is_short(request)) return request;
  std::string bytes;
  const bool ended = request.read_body([&](std::string_view piece) {
    bytes += piece;
    return bytes.size() <= kMostJson;
  });
  const std::string_view line = std::string_view(bytes).substr(0, bytes.find_last_not_of("\r\n") + 1);
  if (ended && is_fields(line)) return with_fields(request, line);
  std::optional<Problem> twice;
  if (const Json json = ended && line.starts_with('{') ? read_object(line, false, twice) : Json(); json.is_object())
    return twice ? proto::Result<Request>(*twice) : with_members(request, json, texts);
  Request again = request;
  again.read_body = [bytes = std::move(bytes), ended](const Request::Sink& sink) {
    return (bytes.empty() || sink(bytes)) && ended;
  };
  return again;
}

}  // namespace cordillera::server
