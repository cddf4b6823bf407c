// The API's description and the server hold each other to their word.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <regex>
#include <set>

#include "openapi_document.h"
#include "pipeline/faces/face.h"
#include "server/access/tokens.h"
#include "server/api/requests/routes.h"
#include "server/http/problems.h"

namespace cordillera::server {
namespace {

/// A path of the description with values for its braces.
std::string filled(std::string path, std::map<std::string, std::string> values) {
  for (const auto& [name, value] : std::map<std::string, std::string>{{"root", "W"},
                                                                      {"z", "3"},
                                                                      {"x", "7"},
                                                                      {"y", "6"},
                                                                      {"mesh_format", "glb"},
                                                                      {"source", "s"},
                                                                      {"version", "0"},
                                                                      {"id", "a"},
                                                                      {"client", "leaflet"}}) {
    values.emplace(name, value);
  }
  for (const auto& [name, value] : values) path = std::regex_replace(path, std::regex("\\{" + name + "\\}"), value);
  return path;
}

Words words_of(const std::string& allow) {
  Words words;
  std::istringstream list(allow);
  for (std::string word; std::getline(list, word, ',');) words.insert(word.substr(word.find_first_not_of(' ')));
  return words;
}

TEST(OpenApi, IsOfTheVersionAndCanBeKept) {
  TestService test;
  const Response got = test.get("/api");
  EXPECT_EQ(got.status, 200);
  EXPECT_EQ(got.header("Content-Type"), "application/vnd.oai.openapi+json;version=3.1");
  std::size_t links = 0;
  const Json landing = body_of(test.get("/stac"));
  for (const Json& link : landing["links"]) {
    if (link["rel"] != "service-desc") continue;
    EXPECT_EQ(test.get("/openapi.json").header("Content-Type"), link["type"]);
    ++links;
  }
  EXPECT_EQ(links, 1U);
  EXPECT_EQ(body_of(got)["openapi"], "3.1.0");
  EXPECT_EQ(body_of(got)["info"]["version"], CORDILLERA_VERSION);
  EXPECT_EQ(body_of(got)["servers"][0]["url"], ".");
  EXPECT_EQ(test.get("/api", {{"if-none-match", got.header("ETag")}}).status, 304);
}

/// The played tiles hold words instead of meshes: what fails over them was found, and the socket's adapter answers 500.
Response asked_for(TestService& test, const std::string& method, const std::string& address) {
  if (method == "post" && address == "/v1/datasets") return test.post("GOOD");
  Request request;
  request.method = method == "get" ? "GET" : method == "patch" ? "PATCH" : method == "put" ? "PUT" : "POST";
  request.path = address;
  request.read_body = [](const Request::Sink&) { return true; };
  try {
    return TestService::plain(test.api().handle(request));
  } catch (const std::exception& error) { return problem_response({"internal", error.what(), "", ""}); }
}

/// What is not as its schema says; empty: nothing. Members that a schema with properties does not name are wrong, too.
class Fits {
 public:
  explicit Fits(const Json& document) : document_(document) {}

  std::string wrong(const Json& schema, const Json& value, const std::string& where) const {
    if (schema.contains("$ref"))
      return wrong(document_.at(Json::json_pointer(schema["$ref"].get<std::string>().substr(1))), value, where);
    if (schema.contains("oneOf")) {
      for (const Json& one : schema["oneOf"])
        if (wrong(one, value, where).empty()) return "";
      return where + " is none of several";
    }
    if (schema.contains("type") && !is_of(schema["type"], value)) return where + " is no " + schema["type"].dump();
    if (value.is_array() && schema.contains("items")) {
      for (const Json& item : value)
        if (auto found = wrong(schema["items"], item, where + "[]"); !found.empty()) return found;
    }
    return value.is_object() ? wrong_members(schema, value, where) : "";
  }

 private:
  static bool is_of(const Json& types, const Json& value) {
    if (types.is_array()) return std::any_of(types.begin(), types.end(), [&](const Json& type) { return is_of(type, value); });
    const std::string type = types;
    if (type == "null") return value.is_null();
    if (type == "object") return value.is_object();
    if (type == "array") return value.is_array();
    if (type == "boolean") return value.is_boolean();
    if (type == "integer") return value.is_number_integer();
    return type == "number" ? value.is_number() : value.is_string();
  }

  std::string wrong_members(const Json& schema, const Json& value, const std::string& where) const {
    const Json properties = schema.value("properties", Json::object()), others = schema.value("additionalProperties", Json());
    const Json needed = schema.value("required", Json::array());
    for (const Json& name : needed)
      if (!value.contains(name.get<std::string>())) return where + " lacks " + name.dump();
    for (const auto& [name, member] : value.items()) {
      const bool known = properties.contains(name);
      if (!known && !properties.empty() && others.is_null()) return where + " has an undescribed " + name;
      const Json& form = known ? properties[name] : others;
      if (auto found = form.is_object() ? wrong(form, member, where + "." + name) : ""; !found.empty()) return found;
    }
    return "";
  }

  const Json& document_;
};

void expect_headers_as_described(const Json& operation, const Response& answer, const std::string& where) {
  const Json good = operation["responses"].value(std::to_string(answer.status), Json());
  ASSERT_FALSE(good.is_null()) << where << " answers " << answer.status;
  const Json headers = good.value("headers", Json::object());
  for (const char* name : {"ETag", "Server-Timing", "Location", "Content-Location", "Content-Range", "Preference-Applied"}) {
    const bool may_lack = where == "get /" || name == std::string("Preference-Applied");  // a viewer that is not built has no tag
    if (!may_lack || !headers.contains(name)) {
      EXPECT_EQ(headers.contains(name), !answer.header(name).empty()) << where << " " << name;
    }
  }
  const bool tagged = where.starts_with("get ") && headers.contains("ETag");
  if (answer.status == 200) { EXPECT_EQ(operation["responses"].contains("304"), tagged) << where; }
}

TEST(OpenApi, EveryPathIsAnswered) {
  TestService test;
  std::filesystem::create_directories(test.folder() / "web" / "demo");
  std::ofstream(test.folder() / "web" / "demo" / "leaflet.html") << "<!doctype html>";
  const std::string id = body_of(test.post("GOOD", {}, {{"prefer", "wait=200"}}))["id"];
  const std::string version = body_of(test.get("/v1/datasets/" + id))["version"];
  int asked = 0;
  const Json document = description();
  for (const auto& [path, item] : document["paths"].items()) {
    const std::string address = filled(path, {{"id", id}, {"version", version}});
    EXPECT_EQ(address.find('{'), std::string::npos) << address;
    for (const auto& [method, operation] : item.items()) {
      if (method == "parameters" || method == "delete") continue;
      const Response answer = asked_for(test, method, address);
      ++asked;
      EXPECT_NE(answer.status, 405) << method << " " << address;
      if (answer.status >= 400) { EXPECT_NE(slug_of(answer), "not-found") << method << " " << address; }
      if (answer.status >= 400) { EXPECT_TRUE(operation["responses"].contains("4XX")) << path; }
      if (answer.status < 400 && !answer.later && !answer.rest)
        expect_headers_as_described(operation, answer, method + " " + path);
      if (answer.status >= 400 || answer.header("Content-Type").find("json") == std::string::npos) continue;
      const Json& content = operation["responses"][std::to_string(answer.status)]["content"];
      EXPECT_EQ(Fits(document).wrong(content[answer.header("Content-Type")]["schema"], body_of(answer), method + " " + path), "");
    }
  }
  EXPECT_GT(asked, 20);
  EXPECT_EQ(test.send("DELETE", "/v1/datasets/" + id).status, 204);
}

TEST(OpenApi, MethodsAreThoseThatAreAllowed) {
  const Json document = description();
  for (const auto& [path, item] : document["paths"].items()) {
    Words described;
    for (const auto& [method, operation] : item.items()) {
      if (method == "parameters") continue;
      std::string upper = method;
      for (char& c : upper) c = static_cast<char>(c - 'a' + 'A');
      described.insert(upper);
    }
    Words allowed = words_of(allowed_methods(parse_route(filled(path, {}))));
    allowed.erase("HEAD");
    allowed.erase("OPTIONS");
    EXPECT_EQ(described, allowed) << path;
  }
}

TEST(OpenApi, EveryRouteIsDescribed) {
  std::map<const RouteRow*, int> described;
  const Json document = description();
  for (const auto& [path, item] : document["paths"].items()) {
    const RouteRow* const row = parse_route(filled(path, {})).row;
    EXPECT_NE(row, nullptr) << path;
    ++described[row];
  }
  for (const RouteRow& row : route_table()) EXPECT_GE(described[&row], 1) << row.path << " is in no path";
}

TEST(OpenApi, EveryFaceIsDescribedWithAndWithoutAVersion) {
  const Json paths = description()["paths"];
  for (const auto* face : pipeline::faces::all_faces()) {
    for (const auto& resource : face->resources) {
      for (const std::string& base : {std::string("/v1/datasets/{id}/"), std::string("/v1/datasets/{id}/versions/{version}/")}) {
        const std::string path = base + std::string(resource.path);
        ASSERT_TRUE(paths.contains(path)) << path;
        EXPECT_TRUE(paths[path]["get"]["responses"]["200"]["content"].contains(std::string(resource.type))) << path;
      }
    }
  }
}

TEST(OpenApi, NamesAreUsedOnceAndReferencesResolve) {
  const Json document = description();
  const std::string text = document.dump();
  static const std::regex kReference(R"re("\$ref":"#([^"]+)")re");
  int references = 0;
  for (std::sregex_iterator at(text.begin(), text.end(), kReference), end; at != end; ++at, ++references) {
    EXPECT_TRUE(document.contains(Json::json_pointer((*at)[1].str()))) << (*at)[1];
  }
  EXPECT_GT(references, 20);
  Words ids;
  for (const auto& [path, item] : document["paths"].items()) {
    for (const auto& [method, operation] : item.items()) {
      if (method != "parameters") { EXPECT_TRUE(ids.insert(operation["operationId"]).second) << operation["operationId"]; }
    }
  }
}

/// A generator of clients sends a body that has no type as JSON.
TEST(OpenApi, BodiesThatAreBytesSayIt) {
  const Json document = description();
  const Json bytes = {{"type", "string"}, {"format", "binary"}};
  int seen = 0;
  for (const auto& [path, item] : document["paths"].items()) {
    for (const auto& [method, operation] : item.items()) {
      if (method == "parameters" || !operation.contains("requestBody")) continue;
      for (const auto& [type, content] : operation["requestBody"]["content"].items()) {
        EXPECT_FALSE(content["schema"].empty()) << method << " " << path << " " << type;
        if (type.ends_with("octet-stream")) { EXPECT_EQ(content["schema"], bytes) << method << " " << path; }
        if (type.ends_with("octet-stream")) ++seen;
      }
    }
  }
  EXPECT_EQ(seen, 5);
  const Json& all = document["paths"]["/v1/datasets"];
  EXPECT_EQ(all["put"]["requestBody"]["content"].size(), 1u) << "generators of clients take one type, JSON where it is there";
  EXPECT_EQ(all["post"]["requestBody"]["content"].begin().key(), "application/octet-stream");
  const Json form = document["components"]["schemas"]["raster_form"]["properties"];
  EXPECT_EQ(form["file"]["items"], bytes);
  for (const Json& parameter : all["post"]["parameters"]) {
    if (parameter["in"] == "query") { EXPECT_TRUE(form.contains(parameter["name"])) << parameter["name"]; }
  }
}

TEST(OpenApi, ABodyOfFieldsIsDescribedWhereItIsTaken) {
  const Json content = description()["paths"]["/v1/datasets/{id}"]["patch"]["requestBody"]["content"];
  EXPECT_EQ(content["application/x-www-form-urlencoded"], content["application/json"]);
  EXPECT_TRUE(content["application/json"]["schema"].contains("$ref"));
}

TEST(OpenApi, WhatIsAnsweredBesideTheGoodIsDescribed) {
  const Json document = description(), paths = document["paths"];
  for (const char* path : {"/v1/datasets/{id}/mesh.{mesh_format}", "/v1/datasets/{id}.pmtiles"}) {
    const Json& get = paths[path]["get"];
    EXPECT_EQ(get["responses"]["206"]["content"], get["responses"]["200"]["content"]) << path;
    const Json beyond = get["responses"]["416"]["$ref"];
    EXPECT_TRUE(document[Json::json_pointer(std::string(beyond).substr(1))]["headers"].contains("Content-Range")) << path;
    for (const char* name : {"If-None-Match", "Range", "If-Range"})
      EXPECT_THAT(get["parameters"], testing::Contains(Json{{"$ref", std::string("#/components/parameters/") + name}})) << path;
  }
  const auto headers_of = [&](const char* path, const char* method) {
    Words names;
    for (const Json& parameter : paths[path][method]["parameters"]) {
      if (parameter.value("in", "") == "header") names.insert(parameter["name"]);
    }
    return names;
  };
  EXPECT_EQ(headers_of("/v1/datasets/{id}/sources/{source}", "delete"), (Words{"Prefer", "Idempotency-Key", "If-Match"}));
  EXPECT_TRUE(paths["/v1/datasets"]["post"]["responses"]["201"]["headers"].contains("Preference-Applied"));
  EXPECT_TRUE(document["components"]["responses"]["problem"]["headers"].contains("Retry-After"));
}

TEST(OpenApi, WithTokensWhatWritesTakesOne) {
  Settings settings;
  settings.serve.token_lines = access::make_token("alice", access::Role::write).line;
  TestService test(settings);
  const Json guarded = body_of(test.get("/api"))["paths"], open = description()["paths"];
  const Json token = Json::array({{{"bearer", Json::array()}}});
  EXPECT_EQ(guarded["/v1/datasets"]["post"]["security"], token);
  EXPECT_EQ(guarded["/v1/datasets/{id}/sources/{source}"]["delete"]["security"], token);
  EXPECT_EQ(guarded["/metrics"]["get"]["security"], token);
  EXPECT_FALSE(guarded["/v1/datasets"]["get"].contains("security"));
  EXPECT_FALSE(open["/v1/datasets"]["post"].contains("security"));
}

TEST(OpenApi, TokensAreAScheme) {
  const Json document = description();
  EXPECT_EQ(document["components"]["securitySchemes"]["bearer"]["scheme"], "bearer");
  // With a token or without one; each named scheme is there.
  ASSERT_EQ(document["security"].size(), 2u);
  EXPECT_TRUE(document["security"][0].is_object() && document["security"][0].empty());
  for (const Json& one : document["security"]) {
    for (const auto& [name, scopes] : one.items()) EXPECT_TRUE(document["components"]["securitySchemes"].contains(name));
  }
}

/// Slugs of the rows of the page of errors that have a status: what HTTP may say.
Words slugs_of_the_page() {
  const std::string text = file_text(std::filesystem::path(CORDILLERA_SOURCE_DIR) / "docs" / "reference" / "errors.md");
  Words slugs;
  static const std::regex kRow(R"(\| *[0-9]{3} *\|(.*)\|)"), kSlug("`([a-z-]+)`");
  std::istringstream lines(text);
  std::smatch row;
  for (std::string line; std::getline(lines, line);) {
    if (!std::regex_match(line, row, kRow)) continue;
    const std::string cell = row[1];
    for (std::sregex_iterator at(cell.begin(), cell.end(), kSlug), end; at != end; ++at) slugs.insert((*at)[1]);
  }
  return slugs;
}

TEST(OpenApi, ProblemsAreThoseOfTheTableAndThePage) {
  Words said;
  const Json document = description();
  for (const Json& type : document["components"]["schemas"]["problem"]["properties"]["type"]["enum"]) {
    EXPECT_TRUE(said.insert(type.get<std::string>().substr(std::string("urn:cordillera:problem:").size())).second) << type;
  }
  EXPECT_GT(said.size(), 45u);
  EXPECT_EQ(said, slugs_of_the_page());
}

}  // namespace
}  // namespace cordillera::server
