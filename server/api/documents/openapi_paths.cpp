// Paths of the API's description: those of the table of routes, with words of their own.
#include <algorithm>
#include <map>
#include <stdexcept>

#include "pipeline/faces/face.h"
#include "proto/lattice.h"
#include "server/api/documents/openapi.h"
#include "server/api/documents/openapi_options.h"
#include "server/api/requests/elevation_query.h"
#include "server/api/requests/list_query.h"
#include "server/api/requests/query_words.h"
#include "server/api/requests/routes.h"
#include "server/options/mesh_options.h"
#include "server/options/options.h"

namespace cordillera::server::openapi {
namespace {

using pipeline::faces::Grid;
using pipeline::faces::Resource;
using Operations = std::map<std::string, Operation, std::less<>>;

Json prefer_of_reading() {
  return header(
      "Prefer",
      "wait=SECONDS: while the dataset is being built, the answer waits so long for the final tile, within the limit max_wait");
}

/// Of the list of datasets and of its like in STAC.
Json list_parameters() {
  Json parameters = parameters_of(list_options());
  for (Json& one : parameters) {
    if (one["name"] == "after") one = counted(one, 0, kLastPlace);
  }
  return parameters;
}

/// What a change may name with If-Match.
Json guarded(const std::string& about, const char* schema) { return tagged_answers(about, "application/json", schema); }

/// Of a change.
Json if_match() {
  return header("If-Match", "the ETag that a GET of it said; the change is made only if that is still so, else it is 412");
}

Json url_parameter() { return required(query("url", "the address of a raster that the operator lets the service fetch")); }

/// Of everything of /v1/live: what is built.
Json live_parameters() {
  Json parameters = parameters_of(live_words());
  parameters[0] = url_parameter();
  return parameters;
}

/// The same beside those of a resource below it. A word of both is that of the build.
Json below_live(const Json& own) {
  Json parameters = live_parameters();
  for (const Json& one : own) {
    const bool taken = std::any_of(parameters.begin(), parameters.end(),
                                   [&](const Json& live) { return live["name"] == one.value("name", ""); });
    if (!taken) parameters.push_back(one);
  }
  return parameters;
}

Json post_parameters() {
  Json parameters = parameters_of(post_words());
  parameters.push_back(header("Prefer", "wait=SECONDS: the answer waits so long for the tiles, 600 at most"));
  parameters.push_back(header("Idempotency-Key", "the same key with the same request gives the same dataset"));
  return parameters;
}

Json raster_body() { return {{"required", false}, {"content", bytes_of("application/octet-stream")}}; }

Operation get_of(const std::string& about, const char* type, const char* schema = nullptr) {
  return {about, {{"200", answer(about, type, schema)}}};
}

void describe_datasets(Operations& all) {
  all["list_datasets"] = {"Datasets, newest first, a page at a time; a page with `next` is not the last, however few it has",
                          {{"200", answer("A page of datasets", "application/json", "datasets")}},
                          list_parameters()};
  Json good;
  good["200"] = answer("With dry_run: what a build would make", "application/json", "estimate");
  good["201"] = answer("The tiles are ready", "application/json", "dataset");
  good["202"] = answer("Queued; Location names the dataset", "application/json", "dataset");
  for (const char* status : {"201", "202"}) add_headers(good, status, {"Location"});
  Operation& post = all["post_dataset"] = {
      "Build tiles from a raster: the body is the raster itself, a form with rasters as its files and options as fields, or "
      "options as JSON or as fields of a plain form. Several files become one dataset, the first wins",
      good, post_parameters(), raster_body()};
  post.body["content"].update(content_of("multipart/form-data", "raster_form"));
  for (const char* type : {"application/json", "application/x-www-form-urlencoded"})
    post.body["content"].update(content_of(type, type == std::string("application/json") ? "posting" : "posting_fields"));
  // Of one type: generators of clients take one of several, and that is JSON.
  all["put_dataset"] = {
      "The same of a raster that is the body. A PUT of /v1/datasets/dem.tif, which curl -T makes of the folder's address, is the "
      "same with that name",
      good, post_parameters(), raster_body()};
  all["dataset"] = {"State, progress, links, and what there is to fetch", guarded("The dataset", "dataset")};
  all["describe_dataset"] = {
      "Change title, attribution, imagery or private, or build the rest of a lazy dataset, as JSON or in the query; for who "
      "posted it, or an admin",
      guarded("The dataset", "dataset"),
      parameters_of(description_words()),
      {{"required", false}, {"content", content_of("application/json", "description")}}};
  all["describe_dataset"].parameters.push_back(if_match());
  all["describe_dataset"].body["content"].update(content_of("application/x-www-form-urlencoded", "description"));
  all["delete_dataset"] = {
      "Remove a dataset; a running build is cancelled", {{"204", {{"description", "It is gone"}}}}, Json::array({if_match()})};
  all["events"] = {"Progress as server-sent events, `tiles` whenever other tiles can be read, then one `ready` or `failed`",
                   {{"200", answer("A stream of events", "text/event-stream")},
                    {"204", {{"description", "The last event is that of Last-Event-ID: an EventSource asks no more"}}}},
                   Json::array({header("Last-Event-ID", "`id` of the last event that was seen")})};
  all["manifest"] = {"What was read and assumed, and the errors of every level",
                     tagged_answers("The manifest", "application/json", "manifest")};
  add_headers(all["manifest"].good, "200", {"Cordillera-Provisional"});
  all["demo"] = {"A page with the dataset in a map library; the same for every id, it asks for the dataset itself",
                 tagged_answers("The page", "text/html")};
}

void describe_uploads(Operations& all) {
  const Json tus = header("Tus-Resumable", "1.0.0, as without it; any other is refused");
  all["begin_upload"] = {"Begin an upload in parts (tus 1.0)",
                         {{"201", bare("It begins at offset 0", {"Location", "Upload-Offset", "Tus-Resumable"})}},
                         Json::array({counted(required(header("Upload-Length", "bytes of the raster")), 1),
                                      header("Upload-Metadata", "filename and its base64"), tus})};
  all["upload"] = {"How much of it is on disk for good; a HEAD has it in Upload-Offset and Upload-Length",
                   {{"200", answer("The upload", "application/json", "upload")}},
                   Json::array({tus})};
  all["continue_upload"] = {
      "Bytes from the offset on",
      {{"204", bare("They are on disk", {"Upload-Offset", "Tus-Resumable"})}},
      Json::array({counted(required(header("Upload-Offset", "where the body begins: what HEAD told"))), tus}),
      {{"required", true}, {"content", bytes_of("application/offset+octet-stream")}}};
  all["end_upload"] = {"Throw it away", {{"204", bare("It is gone", {"Tus-Resumable"})}}, Json::array({tus})};
}

/// Of every change of the rasters.
Json change_headers() {
  return Json::array({header("Prefer", "wait=SECONDS: the answer waits so long for the new version, 600 at most"),
                      header("Idempotency-Key", "the same key with the same request makes one change"), if_match()});
}

/// What one raster of several may have of its own.
Json source_parameters() {
  Json parameters = parameters_of(change_words());
  for (Json& one : change_headers()) parameters.push_back(std::move(one));
  return parameters;
}

void describe_sources(Operations& all) {
  const auto change = [](const char* summary, const char* good) {
    Operation made{summary, {}, source_parameters(), raster_body()};
    made.good[good] = answer("The new version is served", "application/json", "change");
    made.good["202"] = answer("Noted; a version will come of it", "application/json", "change");
    for (const char* status : {good, "202"}) add_headers(made.good, status, {"Location"});
    return made;
  };
  all["sources"] = {"The rasters, the one that wins first, and changes of them", guarded("The rasters", "sources")};
  all["add_source"] = change("Add a raster to a dataset that was posted with updates=1; the body is the raster", "201");
  all["source"] = {"One raster", guarded("The raster", "source")};
  all["replace_source"] = change("Another raster in its place, another place in the list, or other options", "200");
  Operation& removed = all["remove_source"] = change("Take a raster away; the last one stays", "200");
  removed.parameters = change_headers();
  removed.body = {};
  for (const char* status : {"200", "202"}) removed.good[status].erase("headers");  // there is nothing to lead to
  all["versions"] = {"The version that is served, and earlier ones that are kept", guarded("The versions", "versions")};
  all["rollback"] = {"Serve an earlier version again, the one before if none is named", guarded("The versions", "versions"),
                     Json::array({counted(query("to", "number of a kept version"), 1, UINT32_MAX),
                                  header("Idempotency-Key", "the same key with the same request goes back once"),
                                  header("If-Match", "the ETag of the versions; if it is another by now, the answer is 412")})};
}

void describe_service(Operations& all) {
  all["viewer"] = {"The viewer", tagged_answers("The viewer", "text/html")};
  all["description"] = {"This document", tagged_answers("This document", kOpenApiType)};
  all["openapi"] = {"The same", tagged_answers("The same", kOpenApiType)};
  all["docs"] = get_of("The same, for people", "text/html");
  all["version"] = get_of("What runs here", "application/json", "program");
  all["icon"] = get_of("A mountain, for browsers", "image/x-icon");
  all["index"] = get_of("Options of a POST, and links", "application/json", "index");
  all["limits"] = get_of("What the service takes on at most, and how much of it is in use", "application/json", "limits");
  all["metrics"] = get_of("Numbers for Prometheus; takes a token where there are any", "text/plain");
  all["health"] = get_of("The process is alive", "application/json", "health");
  all["readiness"] = get_of("The service takes work", "application/json", "health");
}

void describe_stac(Operations& all) {
  const char* geo = "application/geo+json";
  all["stac"] = get_of("Landing page of STAC 1.0 and OGC API - Common", "application/json", "stac_catalog");
  all["stac_conformance"] = get_of("What it conforms to", "application/json", "stac_conformance");
  all["stac_collections"] = get_of("The one collection", "application/json", "stac_collections");
  all["stac_collection"] = get_of("The collection of all datasets", "application/json", "stac_collection");
  all["stac_items"] =
      get_of("Datasets that are ready as items, newest first, at most 100 a page; the link `next` leads on", geo, "stac_items");
  Json& parameters = all["stac_items"].parameters = Json::array();
  for (Json& one : list_parameters()) {
    if (one["name"] == "limit") one["description"] = "most items of a page, 1 to 1000; above 100 it is 100";
    if (one["name"] != "state" && one["name"] != "q") parameters.push_back(std::move(one));
  }
  all["stac_item"] = get_of("A dataset as an item", geo, "stac_item");
}

void describe_elevation(Operations& all) {
  const char* about = "Heights of the places, in their order; null beside the data";
  Json good = tagged_answers(about, "application/json", "elevations");
  Json posted = {{"200", answer(about, "application/json", "elevations")}};
  for (Json* one : {&good, &posted}) add_headers(*one, "200", {"Cordillera-Provisional"});
  const Json parameters =
      Json::array({query("points", "places, lon,lat;lon,lat;… in degrees; not with line"),
                   query("line", "the corners of a line that is sampled evenly, as points are given"),
                   counted(query("samples", "how many places of the line"), 2, kMostPlaces),
                   counted(query("level", "of the meshes; the finest without it"), 0, proto::kMaxLevel), prefer_of_reading()});
  all["elevation"] = {"Heights at places or along a line, from the meshes that clients get", good, parameters};
  all["elevation_by_post"] = {"The same for places in the body: points or a line as lists of [lon, lat], or GeoJSON",
                              posted,
                              Json::array({parameters[2], parameters[3], parameters[4]}),
                              {{"required", true}, {"content", content_of("application/json", "places")}}};
}

void describe_meshes(Operations& all) {
  Json parameters = parameters_of(mesh_options());
  for (Json& one : parameters) {
    if (one["name"] == "level") one = counted(one, 0, proto::kMaxLevel);
  }
  Json good = tagged_answers("The mesh", "application/octet-stream");
  for (const char* type : {"model/gltf-binary", "model/obj", "model/stl"}) { good["200"]["content"].update(bytes_of(type)); }
  add_ranges(good);
  all["mesh"] = {"A tile, a level or a box as one mesh of at most " + std::to_string(kMostTrianglesOverHttp) + " triangles", good,
                 parameters};
  good = tagged_answers("The archive", "application/vnd.pmtiles");
  add_ranges(good);
  all["archive"] = {
      "All tiles of a format as a PMTiles archive, whole or by ranges; made when it is first asked for", good,
      Json::array({query("format", "a format with tiles; without it Terrain-RGB"),
                   header("Prefer", "wait=SECONDS: the answer waits so long until it is made, within the limit max_wait")})};
}

void describe_live(Operations& all) {
  Json options = live_parameters();
  options.push_back(
      header("Prefer", "wait=SECONDS: the answer waits so long until something can be read, within the limit max_wait"));
  Json good;
  good["200"] =
      answer("The dataset of this address with these options, of which something can be read", "application/json", "dataset");
  good["202"] = answer("The same before anything can be read", "application/json", "dataset");
  for (const char* status : {"200", "202"}) add_headers(good, status, {"ETag", "Content-Location"});
  all["live"] = {"The dataset of an address, made where there is none yet; Content-Location names it", good, options};
}

/// The words of every operation but those of faces, by their names in the table of routes.
Operations described() {
  Operations all;
  for (const auto add : {describe_service, describe_datasets, describe_uploads, describe_sources, describe_elevation,
                         describe_meshes, describe_live, describe_stac}) {
    add(all);
  }
  return all;
}

/// Letters of a path that an operation's name may have.
std::string id_of(std::string_view path) {
  std::string id;
  for (const char c : path) id += (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ? c : '_';
  id.erase(std::unique(id.begin(), id.end(), [](char a, char b) { return a == '_' && b == '_'; }), id.end());
  return id;
}

Operation of_resource(const Resource& resource) {
  std::string summary(resource.about);
  if (resource.grid == Grid::web_mercator) summary += " (WebMercatorQuad, rows from the north)";
  if (resource.grid == Grid::web_mercator_south) summary += " (WebMercatorQuad, rows from the south)";
  if (resource.grid == Grid::geodetic) summary += " (WorldCRS84Quad, rows from the south)";
  const bool tilejson = resource.links == pipeline::faces::Links::tile_templates;
  Operation made{summary, tagged_answers(summary, std::string(resource.type), tilejson ? "tilejson" : nullptr)};
  add_headers(made.good, "200", {"Server-Timing", "Cordillera-Provisional", "Cordillera-Hint"});
  if (resource.absent == pipeline::faces::Absent::no_content) made.good["204"] = {{"description", "The place has no data"}};
  const auto take = [&made](const char* name, const char* about, std::string_view accepted) {
    if (!accepted.empty()) made.parameters.push_back(query(name, about + std::string("; accepted: ").append(accepted)));
  };
  take("ramp", "the colours", resource.ramps);
  take("interval", "metres from line to line", resource.intervals);
  take("normals", "of the tiles", resource.normals);
  if (resource.grid != Grid::none && !resource.path.ends_with(".subtree")) made.parameters.push_back(prefer_of_reading());
  return made;
}

/// An operation wherever its row has it. id: its name below the dataset. leads: of /v1/live, to the dataset's own address.
struct Place {
  const RouteRow& row;
  const RouteMethod& method;
  std::string path, id;
  bool leads;
  Tokens tokens;
};

void add(Json& paths, const Place& at, const Operation& words) {
  std::string method(at.method.name);
  for (char& c : method) c = static_cast<char>(c - 'A' + 'a');
  const auto described = [&](const std::string& id, const std::string& tag) {
    Json json = operation(id, tag, method, words);
    if (at.tokens == Tokens::asked_for && at.method.needs != access::Role::none)
      json["security"] = Json::array({{{"bearer", Json::array()}}});
    return json;
  };
  const std::string tag(at.row.tag), below = at.path.substr(std::min(at.path.size(), kOneDataset.size()));
  item(paths, at.path)[method] = described(at.id, tag);
  if ((at.row.is & RouteRow::kVersioned) != 0) {
    const std::size_t stem = method == "get" ? at.id.size() : at.row.name.size();  // elevation_of_version_by_post
    const std::string id = std::string(at.id).insert(stem, "_of_version");
    item(paths, std::string(kOneDataset) + "/versions/{version}" + below)[method] = described(id, "versions");
  }
  if ((at.row.is & RouteRow::kLive) == 0 || method != "get") return;
  Json get = described(at.id + "_of_address", "live");
  get["parameters"] = below_live(get.value("parameters", Json::array()));
  if (at.leads) get["responses"]["307"] = {{"description", "The same of the dataset"}};
  if (at.leads) add_headers(get["responses"], "307", {"Location"});
  item(paths, "/v1/live" + below)[method] = std::move(get);
}

void add_faces(Json& paths, const RouteRow& row, const RouteMethod& method, Tokens tokens) {
  const std::string before(row.path.substr(0, row.path.size() - kOfFaces.size()));
  for (const auto* face : pipeline::faces::all_faces()) {
    for (const Resource& one : face->resources)
      add(paths, {row, method, before + std::string(one.path), id_of(one.path), one.grid == Grid::none, tokens},
          of_resource(one));
  }
}

}  // namespace

Json all_paths(Tokens tokens) {
  Json paths;
  Operations all = described();
  for (const RouteRow& row : route_table()) {
    for (const RouteMethod& method : row.methods) {
      if (row.path.ends_with(kOfFaces)) {
        add_faces(paths, row, method, tokens);
        continue;
      }
      const auto own = all.extract(std::string(method.operation));
      if (own.empty()) throw std::logic_error("no words for the operation " + std::string(method.operation));
      add(paths, {row, method, std::string(row.path), own.key(), (row.is & RouteRow::kOneAddress) != 0, tokens}, own.mapped());
    }
  }
  if (!all.empty()) throw std::logic_error("no route has the operation " + all.begin()->first);
  return paths;
}

}  // namespace cordillera::server::openapi
