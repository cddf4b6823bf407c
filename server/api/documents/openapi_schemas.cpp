// What the paths of the API's description refer to.
#include "pipeline/exports/mesh/mesh_output.h"
#include "proto/lattice.h"
#include "server/api/documents/openapi.h"
#include "server/api/documents/openapi_options.h"
#include "server/api/documents/openapi_values.h"
#include "server/api/requests/query_words.h"
#include "server/datasets/registry.h"
#include "server/http/problems.h"

namespace cordillera::server::openapi {
namespace {

Json problem() {
  Json types = Json::array();
  for (const ProblemKind& kind : all_problem_kinds()) types.push_back("urn:cordillera:problem:" + kind.slug);
  Json properties;
  properties["type"] = {{"type", "string"}, {"enum", types}, {"description", "stable; what went wrong"}};
  properties["title"] = text("the type in words");
  properties["status"] = {{"type", "integer"}, {"description", "the HTTP status"}};
  properties["detail"] = text("what is wrong, and where");
  properties["accepted"] = text("what would be accepted instead");
  properties["parameter"] = text("the parameter at fault, as it was spelt");
  properties["request_id"] = text("names the request in the service's log; also the header X-Request-Id");
  properties["reasons"] = {{"type", "array"}, {"items", {{"type", "string"}}}, {"description", "of not-ready, a word each"}};
  return object(properties, {"type", "title", "status", "detail"});
}

Json dataset() {
  Json states = Json::array();
  for (const State state : {State::queued, State::running, State::ready, State::failed}) states.push_back(to_string(state));
  Json properties;
  properties["id"] = text("part of its address");
  properties["name"] = text("what the raster was called");
  properties["title"] = text("what people call it; its name where nobody has said");
  properties["state"] = {{"type", "string"}, {"enum", states}};
  properties["created"] = {{"type", "string"}, {"format", "date-time"}};
  properties["private"] = {{"type", "boolean"}, {"description", "read with a token only"}};
  properties["provisional"] = {
      {"type", "boolean"}, {"description", "coarse tiles can be read until the build is done; how far they are off is unknown"}};
  properties["build"] = {
      {"type", "string"},
      {"enum", {"full", "lazy"}},
      {"description", "lazy: blocks are made as their tiles are asked for; until all are, the dataset is running"}};
  properties["asleep"] = {{"type", "boolean"},
                          {"description", "what was made of it went to make room; who reads it has it made anew"}};
  properties["source"] = {
      {"type", Json::array_t{"string", "null"}},
      {"description",
       "the address at which its raster is read, without what may be a signature; null: the service has the raster"}};
  properties["progress"] = or_null("progress");
  properties["error"] = or_null("problem");
  properties["links"] = {{"type", "object"},
                         {"additionalProperties", {{"type", "string"}}},
                         {"description", "paths, below the prefix that a proxy told in X-Forwarded-Prefix"}};
  properties["notes"] = {{"type", "array"},
                         {"items", {{"type", "string"}}},
                         {"description", "sentences for people: voids that were filled, options of an older spelling"}};
  properties["manifest"] = or_null("summary");
  properties["updates"] = ref("updates");
  properties["version"] = text("once it is ready: names this build in addresses that never change");
  properties["faces"] = list_of("face");
  return object(properties, {"id", "name", "state", "created", "progress", "error", "links", "manifest"});
}

Json progress() {
  Json properties;
  properties["stage"] = text("queued, fetch, provisional, open, plan, build, merge or publish");
  properties["done"] = number("of total");
  properties["total"] = number("samples, tiles or steps");
  properties["share"] = number("of all stages together, 0 to 1; never less than before");
  properties["place"] = {{"type", Json::array_t{"integer", "null"}},
                         {"description", "in the queue, 1 for the next; null while it is built"}};
  properties["seconds_left"] = {{"type", Json::array_t{"number", "null"}},
                                {"description", "of the stage; null while nobody can tell"}};
  return object(properties, {"stage", "done", "total", "share", "seconds_left", "place"});
}

Json face() {
  Json properties;
  properties["name"] = text("as --formats has it");
  properties["about"] = text("which clients read it");
  properties["href"] = text("path of what a client is given");
  properties["type"] = text("its media type");
  properties["links"] = list_of("link");
  return object(properties, {"name", "about", "href", "type", "links"});
}

Json link() {
  Json properties;
  properties["rel"] = text("item: tiles; alternate: a document");
  properties["href"] = text("a path; braces where it is templated");
  properties["type"] = text("media type");
  properties["title"] = text("what it is");
  properties["templated"] = {{"type", "boolean"}};
  properties["tileMatrixSetId"] = {{"type", "string"}, {"enum", Json::array_t{"WorldCRS84Quad", "WebMercatorQuad"}}};
  properties["rows"] = {{"type", "string"}, {"enum", Json::array_t{"north", "south"}}, {"description", "where y counts from"}};
  return object(properties, {"rel", "href", "type", "title"});
}

Json limits() {
  Json of_one;
  of_one["value"] = number("at most, min_disk_free apart");
  of_one["unit"] = text("what it counts");
  of_one["about"] = text("what it is");
  Json properties;
  properties["limits"] = {{"type", "object"}, {"additionalProperties", object(of_one, Json::array_t{"value", "unit", "about"})}};
  properties["in_use"] = {
      {"type", "object"}, {"additionalProperties", {{"type", "integer"}}}, {"description", "of some of them, by the same names"}};
  return object(properties, Json::array_t{"limits", "in_use"});
}

Json sources_schemas(Json all) {
  Json source;
  for (const auto& [name, about] : {std::pair{"id", "its name in addresses"},
                                    {"name", "what it is called"},
                                    {"added", "when it came"},
                                    {"crs", "its CRS"},
                                    {"vertical_datum", "what its heights count from"},
                                    {"vertical_datum_from", "who says so"},
                                    {"source", "where it was fetched from"}}) {
    source[name] = text(about);
  }
  source["position"] = {{"type", Json::array_t{"integer", "null"}}, {"description", "0 wins"}};
  source["bytes"] = number("of its file");
  source["extent"] = {{"type", "array"}, {"items", {{"type", "number"}}}, {"description", "west, south, east, north in degrees"}};
  source["resolution"] = {
      {"type", "array"}, {"items", {{"type", "number"}}}, {"description", "metres of a pixel, across and up"}};
  for (const char* count : {"columns", "rows"}) source[count] = {{"type", "integer"}, {"description", "pixels"}};
  source["beside_bbox"] = {
      {"type", "boolean"},
      {"description", "true where the dataset's bbox does not touch it, so that it adds nothing; else left out"}};
  source["all_void"] = {{"type", "boolean"}, {"description", "true where none of its pixels has data, else left out"}};
  source["options"] = {{"type", "object"}, {"description", "those that were given to this raster"}};
  source["changes"] = list_of("change");
  source["changes"]["description"] = "those of it that wait; in the list of rasters, which has all changes, left out";
  all["source"] = object(source, Json::array_t{"name", "position"});
  Json change;
  change["id"] = text("names the change");
  change["kind"] = {{"type", "string"}, {"enum", Json::array_t{"add", "replace", "remove"}}};
  change["source"] = text("the raster's id");
  change["state"] = {{"type", "string"}, {"enum", Json::array_t{"pending", "done", "failed"}}};
  change["version"] = {{"type", "integer"}, {"description", "that comes or came of it"}};
  change["error"] = or_null("problem");
  all["change"] = object(change, Json::array_t{"id", "kind", "source", "state", "version", "error"});
  all["sources"] = object({{"version", {{"type", "integer"}}},
                           {"block_level", {{"type", "integer"}}},
                           {"sources", list_of("source")},
                           {"changes", list_of("change")}},
                          Json::array_t{"version", "sources", "changes"});
  Json version;
  version["number"] = {{"type", "integer"}};
  version["version"] = text("its name in addresses");
  version["served"] = {{"type", "boolean"}};
  version["about"] = text("what made it");
  version["created"] = text("when");
  version["href"] = text("its manifest, relative to the dataset");
  for (const char* count : {"sources", "tiles", "triangles", "bytes"}) version[count] = number("how many");
  all["versions"] =
      object({{"versions", {{"type", "array"}, {"items", object(version, Json::array_t{"number", "version", "served"})}}}},
             Json::array_t{"versions"});
  return all;
}

/// What a POST takes as its body beside a raster.
void add_postings(Json& all) {
  all["posting"] = object(members_of(post_words()), Json::array_t{});
  Json fields = fields_of(post_words());
  all["posting_fields"] = object(fields, Json::array_t{});
  fields["file"] = {{"type", "array"},
                    {"items", bytes_schema()},
                    {"description", "the rasters, the one that wins first; none with source or upload"}};
  all["raster_form"] = object(fields, Json::array_t{});
}

Json schemas() {
  Json all;
  all["problem"] = problem();
  all["dataset"] = dataset();
  all["datasets"] = object(
      {{"datasets", list_of("dataset")},
       {"next", {{"type", Json::array_t{"string", "null"}}, {"description", "path of the next page; null: this is the last"}}}},
      Json::array_t{"datasets", "next"});
  all["progress"] = progress();
  Json words = members_of(description_words());
  for (const char* text : {"title", "attribution", "imagery"}) words[text]["type"] = Json::array_t{"string", "null"};
  all["description"] = object(words, Json::array_t{});
  all["face"] = face();
  all["link"] = link();
  all["health"] = object({{"status", {{"type", "string"}, {"enum", Json::array_t{"ok"}}}},
                          {"damaged_datasets", whole("of /readyz, where there are some")}},
                         Json::array_t{"status"});
  all["limits"] = limits();
  add_answers(all);
  add_postings(all);
  return sources_schemas(std::move(all));
}

Json in_path(const char* name, const char* about, const Json& schema) {
  return {{"name", name}, {"in", "path"}, {"required", true}, {"description", about}, {"schema", schema}};
}

/// Of answers.
Json headers() {
  Json all;
  for (const auto& [name, about] : {std::pair{"ETag", "a function of the content"},
                                    {"Server-Timing", "milliseconds that making it took"},
                                    {"Cordillera-Provisional", "true: the build goes on, and this is not final"},
                                    {"Cordillera-Hint", "which word of the query was meant, where one is nearly there"},
                                    {"Preference-Applied", "what of Prefer was done"},
                                    {"Location", "the path of what was made or is meant"},
                                    {"Content-Location", "the path of the dataset"},
                                    {"Content-Range", "which bytes of how many these are; of a 416 only how many"},
                                    {"Retry-After", "seconds after which to ask again; where asking again may help"}}) {
    all[name] = {{"description", about}, {"schema", {{"type", "string"}}}};
  }
  return all;
}

Json parameters() {
  const Json whole = {{"type", "integer"}, {"minimum", 0}};
  Json level = whole;
  level["maximum"] = proto::kMaxLevel;
  Json all;
  all["id"] = in_path("id", "the dataset, as POST or the list named it; of /v1/uploads the upload, as its POST named it",
                      {{"type", "string"}, {"pattern", "^[a-z0-9-]{1,80}$"}});
  all["version"] = in_path("version", "the dataset's `version`", {{"type", "string"}, {"pattern", "^[a-z0-9-]{1,80}$"}});
  all["source"] =
      in_path("source", "the raster, as the list of sources has it", {{"type", "string"}, {"pattern", "^[a-z0-9-]{1,80}$"}});
  all["root"] = in_path("root", "western or eastern hemisphere", {{"type", "string"}, {"enum", Json::array_t{"W", "E"}}});
  all["z"] = in_path("z", "level", level);
  all["x"] = in_path("x", "column, from longitude -180 eastward; below a root, from its western side", whole);
  all["y"] = in_path("y", "row; which end it counts from, the operation says", whole);
  all["mesh_format"] = in_path("mesh_format", "kind of file", {{"type", "string"}, {"enum", pipeline::exports::mesh_endings()}});
  all["client"] = in_path(
      "client", "map library",
      {{"type", "string"}, {"enum", Json::array_t{"cesium", "threejs", "deckgl", "maplibre", "openlayers", "leaflet", "qgis"}}});
  for (const auto& [name, about] : {std::pair{"If-None-Match", "an ETag: if it is still so, the answer is 304"},
                                    {"Range", "bytes=FROM-TO: only these bytes; of several ranges the answer is the whole"},
                                    {"If-Range", "an ETag: if it is another by now, the answer is the whole"}}) {
    all[name] = header(name, about);
  }
  return all;
}

}  // namespace

Json components() {
  Json json;
  json["schemas"] = schemas();
  json["parameters"] = parameters();
  json["responses"]["problem"] = {
      {"description", "What went wrong"},
      {"headers", {{"Retry-After", {{"$ref", "#/components/headers/Retry-After"}}}}},
      {"content", {{"application/problem+json", {{"schema", {{"$ref", "#/components/schemas/problem"}}}}}}}};
  Json& beyond = json["responses"]["range_beyond"] = json["responses"]["problem"];
  beyond["description"] = "The Range begins behind the end; Content-Range has the size";
  beyond["headers"] = {{"Content-Range", {{"$ref", "#/components/headers/Content-Range"}}}};
  json["securitySchemes"]["bearer"] = {{"type", "http"},
                                       {"scheme", "bearer"},
                                       {"description",
                                        "A token of the operator. Roles: read (private datasets, metrics), write (posting, "
                                        "removing what the token posted), admin."}};
  json["headers"] = headers();
  return json;
}

}  // namespace cordillera::server::openapi
