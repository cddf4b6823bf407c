// Paths of the API's description: the fixed ones, and those of all faces.
#include <algorithm>

#include "pipeline/faces/face.h"
#include "proto/lattice.h"
#include "server/api/documents/openapi.h"
#include "server/api/documents/openapi_operation.h"
#include "server/api/requests/list_query.h"
#include "server/options/mesh_options.h"
#include "server/options/options.h"

namespace cordillera::server::openapi {
namespace {

using pipeline::faces::Face;
using pipeline::faces::Grid;

Json prefer_of_reading() {
  return header(
      "Prefer",
      "wait=SECONDS: while the dataset is being built, the answer waits so long for the final tile, within the limit max_wait");
}

Json post_parameters() {
  Json parameters = Json::array();
  for (const OptionSpec& option : post_options()) {
    parameters.push_back(query(spelt(option, Spelling::query), option.help + "; accepted: " + option.accepted));
  }
  parameters.push_back(query("updates", "1: keep what it takes to add, replace and remove rasters later"));
  parameters.push_back(query("upload", "id of an upload that is complete; then there is no body"));
  parameters.push_back(query("source", "an address that the operator lets the service fetch; then there is no body"));
  parameters.push_back(header("Prefer", "wait=SECONDS: the answer waits so long for the tiles, 600 at most"));
  parameters.push_back(header("Idempotency-Key", "the same key with the same request gives the same dataset"));
  return parameters;
}

void add_datasets(Json& paths) {
  Json& all = item(paths, "/v1/datasets");
  Json of_list = Json::array();
  for (const ListOption& option : list_options())
    of_list.push_back(query(option.name, option.help + "; accepted: " + option.accepted));
  all["get"] =
      operation(Operation{"list_datasets",
                          "datasets",
                          "Datasets, newest first, a page at a time; a page with `next` is not the last, however few it has",
                          {{"200", answer("A page of datasets", "application/json", "datasets")}},
                          of_list});
  Json good;
  good["200"] = answer("With dry_run: what a build would make", "application/json", "estimate");
  good["201"] = answer("The tiles are ready", "application/json", "dataset");
  good["202"] = answer("Queued; Location names the dataset", "application/json", "dataset");
  for (const char* status : {"201", "202"}) {
    good[status]["headers"]["Location"] = {{"description", "the path of the dataset"}, {"schema", {{"type", "string"}}}};
  }
  all["post"] = operation(Operation{
      "post_dataset", "datasets",
      "Build tiles from a raster: the body is the raster itself, a form with rasters as its files and options as fields, or "
      "options as JSON or as fields of a plain form. Several files become one dataset, the first wins. A PUT does the same",
      good, post_parameters()});
  all["post"]["requestBody"] = {{"required", false}, {"content", content_of("application/octet-stream", nullptr)}};
  for (const char* type : {"multipart/form-data", "application/json", "application/x-www-form-urlencoded"})
    all["post"]["requestBody"]["content"][type]["schema"] = {{"type", "object"}};

  all["put"] = all["post"];
  all["put"]["operationId"] = "put_dataset";

  Json& one = item(paths, "/v1/datasets/{id}");
  one["get"] = operation(Operation{"dataset",
                                   "datasets",
                                   "State, progress, links, and what there is to fetch",
                                   {{"200", answer("The dataset", "application/json", "dataset")}}});
  one["patch"] = operation(Operation{
      "describe_dataset",
      "datasets",
      "Change title, attribution, imagery or private, or build the rest of a lazy dataset, as JSON or in the query; for who "
      "posted it, or an admin",
      {{"200", answer("The dataset", "application/json", "dataset")}},
      Json::array({query("title", "text"), query("attribution", "text"), query("imagery", "an address with {z}, {x} and {y}"),
                   query("private", "1: read with a token only; 0: by everybody"),
                   query("build", "full: all blocks are made from now on")})});
  one["patch"]["requestBody"] = {{"required", false}, {"content", content_of("application/json", "description")}};
  one["delete"] = operation(Operation{"delete_dataset",
                                      "datasets",
                                      "Remove a dataset; a running build is cancelled",
                                      {{"204", {{"description", "It is gone"}}}}});
  item(paths, "/v1/datasets/{id}/events")["get"] = operation(
      Operation{"events",
                "datasets",
                "Progress as server-sent events, `tiles` whenever other tiles can be read, then one `ready` or `failed`",
                {{"200", answer("A stream of events", "text/event-stream")}}});
}

void add_uploads(Json& paths) {
  item(paths, "/v1/uploads")["post"] = operation(
      {"begin_upload",
       "uploads",
       "Begin an upload in parts (tus 1.0)",
       {{"201", bare("It begins at offset 0", {"Location", "Upload-Offset", "Tus-Resumable"})}},
       Json::array({header("Upload-Length", "bytes of the raster"), header("Upload-Metadata", "filename and its base64")})});
  Json& one = item(paths, "/v1/uploads/{id}");
  one["get"] = operation({"upload",
                          "uploads",
                          "How much of it is on disk for good; a HEAD has it in Upload-Offset and Upload-Length",
                          {{"200", answer("The upload", "application/json")}}});
  one["patch"] = operation({"continue_upload",
                            "uploads",
                            "Bytes from the offset on",
                            {{"204", bare("They are on disk", {"Upload-Offset", "Tus-Resumable"})}},
                            Json::array({header("Upload-Offset", "where the body begins: what HEAD told")})});
  one["patch"]["requestBody"] = {{"required", true}, {"content", content_of("application/offset+octet-stream", nullptr)}};
  one["delete"] = operation({"end_upload", "uploads", "Throw it away", {{"204", bare("It is gone", {"Tus-Resumable"})}}});
}

Json sent_raster() { return {{"required", false}, {"content", content_of("application/octet-stream", nullptr)}}; }

/// What one raster of several may have of its own.
Json source_parameters() {
  Json parameters = Json::array();
  for (const OptionSpec& option : raster_options()) {
    parameters.push_back(query(spelt(option, Spelling::query), option.help + "; accepted: " + option.accepted));
  }
  parameters.push_back(query("position", "where it stands in the list; 0, the default of a new one, wins"));
  parameters.push_back(query("upload", "id of an upload that is complete; then there is no body"));
  parameters.push_back(query("source", "an address that the operator lets the service fetch; then there is no body"));
  for (const Json& one : {header("Prefer", "wait=SECONDS: the answer waits so long for the new version, 600 at most"),
                          header("Idempotency-Key", "the same key with the same request makes one change")}) {
    parameters.push_back(one);
  }
  return parameters;
}

void add_sources(Json& paths) {
  const auto change = [](const char* id, const char* summary, const char* good) {
    Operation made{id, "sources", summary, {}, source_parameters()};
    made.good[good] = answer("The new version is served", "application/json", "change");
    made.good["202"] = answer("Noted; a version will come of it", "application/json", "change");
    return operation(made);
  };
  Json& all = item(paths, "/v1/datasets/{id}/sources");
  all["get"] = operation({"sources",
                          "sources",
                          "The rasters, the one that wins first, and changes of them",
                          {{"200", answer("The rasters", "application/json", "sources")}}});
  all["post"] = change("add_source", "Add a raster to a dataset that was posted with updates=1; the body is the raster", "201");
  all["post"]["requestBody"] = sent_raster();
  Json& one = item(paths, "/v1/datasets/{id}/sources/{source}");
  one["get"] = operation({"source", "sources", "One raster", {{"200", answer("The raster", "application/json", "source")}}});
  one["put"] = change("replace_source", "Another raster in its place, another place in the list, or other options", "200");
  one["put"]["requestBody"] = sent_raster();
  one["delete"] = change("remove_source", "Take a raster away; the last one stays", "200");
  one["delete"].erase("parameters");
  item(paths, "/v1/datasets/{id}/versions")["get"] =
      operation({"versions",
                 "versions",
                 "The version that is served, and earlier ones that are kept",
                 {{"200", answer("The versions", "application/json", "versions")}}});
  item(paths, "/v1/datasets/{id}/rollback")["post"] =
      operation({"rollback",
                 "versions",
                 "Serve an earlier version again, the one before if none is named",
                 {{"200", answer("The versions", "application/json", "versions")}},
                 Json::array({query("to", "number of a kept version")})});
}

void add_service(Json& paths) {
  const auto get = [&](const char* path, const char* id, const char* summary, const char* type, const char* schema) {
    item(paths, path)["get"] = operation({id, "service", summary, {{"200", answer(summary, type, schema)}}});
  };
  get("/", "viewer", "The viewer", "text/html", nullptr);
  get("/api", "description", "This document", "application/json", nullptr);
  get("/openapi.json", "openapi", "The same", "application/json", nullptr);
  get("/docs", "docs", "The same, for people", "text/html", nullptr);
  get("/version", "version", "What runs here", "application/json", nullptr);
  get("/favicon.ico", "icon", "A mountain, for browsers", "image/x-icon", nullptr);
  get("/v1", "index", "Options of a POST, and links", "application/json", nullptr);
  get("/v1/limits", "limits", "What the service takes on at most, and how much of it is in use", "application/json", "limits");
  get("/metrics", "metrics", "Numbers for Prometheus; takes a token where there are any", "text/plain", nullptr);
  get("/healthz", "health", "The process is alive", "application/json", "health");
  get("/readyz", "readiness", "The service takes work", "application/json", "health");
}

void add_stac(Json& paths) {
  const auto get = [&](const char* path, const char* id, const char* summary, const char* type, const Json& parameters = {}) {
    item(paths, path)["get"] = operation({id, "stac", summary, {{"200", answer(summary, type)}}, parameters});
  };
  const char* geo = "application/geo+json";
  get("/stac", "stac", "Landing page of STAC 1.0 and OGC API - Common", "application/json");
  get("/stac/conformance", "stac_conformance", "What it conforms to", "application/json");
  get("/stac/collections", "stac_collections", "The one collection", "application/json");
  get("/stac/collections/datasets", "stac_collection", "The collection of all datasets", "application/json");
  get("/stac/collections/datasets/items", "stac_items",
      "Datasets that are ready as items, newest first, at most 100 a page; the link `next` leads on", geo,
      Json::array({query("limit", "most items of a page, 1 to 100"),
                   query("after", "where the page before ended; the link `next` has it"),
                   query("bbox", "only those that touch this box: west,south,east,north in degrees")}));
  get("/stac/collections/datasets/items/{id}", "stac_item", "A dataset as an item", geo);
}

/// Below a dataset and below its versions alike.
void add_reading(Json& paths, const std::string& path, const Operation& from) {
  item(paths, "/v1/datasets/{id}/" + path)["get"] = operation(from);
  Operation versioned = from;
  versioned.id += "_of_version";
  versioned.tag = "versions";
  item(paths, "/v1/datasets/{id}/versions/{version}/" + path)["get"] = operation(versioned);
}

/// Letters of a path that an operation's name may have.
std::string id_of(std::string_view path) {
  std::string id;
  for (const char c : path) id += (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9') ? c : '_';
  id.erase(std::unique(id.begin(), id.end(), [](char a, char b) { return a == '_' && b == '_'; }), id.end());
  return id;
}

void add_faces(Json& paths) {
  for (const Face* face : pipeline::faces::all_faces()) {
    for (const auto& resource : face->resources) {
      std::string summary(resource.about);
      if (resource.grid == Grid::web_mercator) summary += " (WebMercatorQuad, rows from the north)";
      if (resource.grid == Grid::web_mercator_south) summary += " (WebMercatorQuad, rows from the south)";
      if (resource.grid == Grid::geodetic) summary += " (WorldCRS84Quad, rows from the south)";
      Json good = good_answers(summary, std::string(resource.type));
      if (resource.absent == pipeline::faces::Absent::no_content) good["204"] = {{"description", "The place has no data"}};
      Json parameters;
      if (!resource.ramps.empty()) parameters.push_back(query("ramp", "the colours; accepted: " + std::string(resource.ramps)));
      if (!resource.intervals.empty())
        parameters.push_back(query("interval", "metres from line to line; accepted: " + std::string(resource.intervals)));
      if (!resource.normals.empty())
        parameters.push_back(query("normals", "of the tiles; accepted: " + std::string(resource.normals)));
      if (resource.grid != Grid::none && !resource.path.ends_with(".subtree")) parameters.push_back(prefer_of_reading());
      add_reading(paths, std::string(resource.path), {id_of(resource.path), "tiles", summary, good, parameters});
    }
  }
}

void add_elevation(Json& paths) {
  const Json good = {
      {"200", answer("Heights of the places, in their order; null beside the data", "application/json", "elevations")}};
  const Json parameters = Json::array({query("points", "places, lon,lat;lon,lat;… in degrees; not with line"),
                                       query("line", "the corners of a line that is sampled evenly, as points are given"),
                                       query("samples", "how many places of the line"),
                                       query("level", "of the meshes; the finest without it"), prefer_of_reading()});
  add_reading(paths, "elevation",
              {"elevation", "heights", "Heights at places or along a line, from the meshes that clients get", good, parameters});
  for (const char* path : {"/v1/datasets/{id}/elevation", "/v1/datasets/{id}/versions/{version}/elevation"}) {
    Json& post = item(paths, path)["post"];
    post = operation({paths[path]["get"]["operationId"].get<std::string>() + "_by_post", "heights",
                      "The same for places in the body: points or a line as lists of [lon, lat], or GeoJSON", good,
                      Json::array({parameters[2], parameters[3], parameters[4]})});
    post["requestBody"] = {{"required", true}, {"content", content_of("application/json", nullptr)}};
  }
}

void add_meshes(Json& paths) {
  Json parameters = Json::array();
  for (const MeshOption& option : mesh_options()) {
    parameters.push_back(query(option.name, option.help + "; accepted: " + option.accepted));
  }
  Json good = good_answers("The mesh", "application/octet-stream");
  for (const char* type : {"model/gltf-binary", "model/obj", "model/stl"}) {
    good["200"]["content"][type] = {{"schema", Json::object()}};
  }
  add_ranges(good);
  add_reading(paths, "mesh.{mesh_format}",
              {"mesh", "meshes",
               "A tile, a level or a box as one mesh of at most " + std::to_string(kMostTrianglesOverHttp) + " triangles", good,
               parameters});
}

void add_archive(Json& paths) {
  Json good = good_answers("The archive", "application/vnd.pmtiles");
  add_ranges(good);
  item(paths, "/v1/datasets/{id}.pmtiles")["get"] = operation(
      {"archive", "tiles", "All tiles of a format as a PMTiles archive, whole or by ranges; made when it is first asked for",
       good, Json::array({query("format", "a format with tiles; without it Terrain-RGB")})});
}

/// What a client reads of a dataset, of a raster's address alike.
void add_live(Json& paths) {
  Json address = query("url", "address of a raster that the operator lets the service fetch");
  address["required"] = true;
  Json options = Json::array({address});
  for (const Json& one : post_parameters()) {
    const std::string name = one.value("name", "");
    const bool of_post = name == "build" || name == "provisional" || name == "dry_run" || name == "updates" || name == "upload" ||
                         name == "source" || one["in"] != "query";
    if (!of_post) options.push_back(one);
  }
  options.push_back(
      header("Prefer", "wait=SECONDS: the answer waits so long until something can be read, within the limit max_wait"));
  Json good;
  good["200"] =
      answer("The dataset of this address with these options, of which something can be read", "application/json", "dataset");
  good["202"] = answer("The same before anything can be read", "application/json", "dataset");
  item(paths, "/v1/live")["get"] = operation(
      {"live", "live", "The dataset of an address, made where there is none yet; Content-Location names it", good, options});
  std::vector<std::string> names = {"/manifest.json", "/elevation", "/events", "/mesh.{mesh_format}", ".pmtiles"};
  for (const Face* face : pipeline::faces::all_faces()) {
    for (const auto& resource : face->resources) names.push_back("/" + std::string(resource.path));
  }
  for (const std::string& name : names) {
    Json get = paths["/v1/datasets/{id}" + name]["get"];
    get["operationId"] = get["operationId"].get<std::string>() + "_of_address";
    get["tags"] = Json::array({"live"});
    get["parameters"].push_back(address);
    if ((name.find('{') == name.npos && name != "/elevation") || name.starts_with("/mesh."))
      get["responses"]["307"] = {{"description", "The same of the dataset"}};
    item(paths, "/v1/live" + name)["get"] = std::move(get);
  }
}

}  // namespace

Json all_paths() {
  Json paths;
  add_service(paths);
  add_datasets(paths);
  add_uploads(paths);
  add_sources(paths);
  add_reading(paths, "manifest.json",
              {"manifest", "datasets", "What was read and assumed, and the errors of every level",
               good_answers("The manifest", "application/json")});
  item(paths, "/v1/datasets/{id}/demo/{client}.html")["get"] =
      operation({"demo",
                 "datasets",
                 "A page with the dataset in a map library; the same for every id, it asks for the dataset itself",
                 {{"200", answer("The page", "text/html")}}});
  add_faces(paths);
  add_elevation(paths);
  add_meshes(paths);
  add_archive(paths);
  add_live(paths);
  add_stac(paths);
  return paths;
}

}  // namespace cordillera::server::openapi
