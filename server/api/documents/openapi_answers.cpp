// Schemas of documents: of manifests, made from the message that they are printed from; of heights, uploads, STAC and TileJSON.
#include "server/api/documents/openapi_values.h"

namespace cordillera::server::openapi {
namespace {

const Json kNumber = {{"type", "number"}}, kText = {{"type", "string"}};

Json manifest() {
  Json made = schema_of_json(proto::Manifest());
  Json& members = made["properties"];
  // Nobody has measured errors of provisional tiles; a level without tiles has no heights either.
  for (const char* name : {"stated_max_error", "rmse", "min_height", "max_height"}) {
    Json& property = members["levels"]["items"]["properties"][name];
    property = nullable(property);
  }
  for (Json* source : {&members["source"], &members["sources"]["items"]}) {
    Json& property = (*source)["properties"]["error_at_pixels"];
    property = nullable(property);
  }
  made["required"] = {"id", "name", "title", "min_level", "max_level", "levels", "tiles", "triangles", "bytes"};
  return made;
}

/// What lists show of a manifest.
Json summary() {
  Json properties;
  for (const char* word : {"title", "attribution", "imagery"}) properties[word] = kText;
  for (const char* count : {"min_level", "max_level", "tiles", "triangles"}) properties[count] = {{"type", "integer"}};
  properties["bounds"] = array_of(kNumber, "west, south, east, north in degrees, least and greatest height in metres");
  properties["bytes"] = number("of all tiles");
  return object(properties,
                {"title", "attribution", "imagery", "min_level", "max_level", "bounds", "tiles", "triangles", "bytes"});
}

Json updates() {
  Json properties;
  properties["version"] = whole("number of the version that is served");
  properties["pending"] = whole("changes that are still to be done");
  properties["last"] = or_null("change");
  return object(properties, {"version", "pending", "last"});
}

Json estimate() {
  Json properties;
  properties["dry_run"] = {{"type", "boolean"}};
  properties["seconds"] = number("that a build would take, about");
  properties["manifest"] = ref("manifest");
  Json made = object(properties, {"dry_run", "seconds", "manifest"});
  made["description"] = "levels and targets; tiles, triangles, bytes and seconds as guesses";
  return made;
}

Json elevations() {
  Json point;
  point["lon"] = number("degrees");
  point["lat"] = number("degrees");
  point["distance"] = number("metres along the line; of places one by one not there");
  point["ellipsoidal_height"] = nullable(number("metres; null beside the data"));
  point["orthometric_height"] = nullable(number("metres above the geoid; null without a geoid grid, too"));
  Json properties;
  properties["level"] = whole("of the meshes");
  properties["stated_max_error"] =
      nullable(number("metres, of that level; null of provisional tiles, and where the level shows nothing"));
  properties["provisional"] = typed("boolean", "true: the build goes on, and these heights are of coarse tiles; else not there");
  properties["ellipsoid"] = kText;
  properties["geoid"] = nullable(text("null where no grid is installed"));
  properties["attribution"] = text("who is named with the dataset; else not there");
  properties["length"] = number("metres, of the line; of places one by one not there");
  properties["points"] = array_of(object(point, {"lon", "lat", "ellipsoidal_height", "orthometric_height"}), "in their order");
  return object(properties, {"level", "stated_max_error", "ellipsoid", "geoid", "points"});
}

/// What elevations are asked of in a body.
Json places() {
  const Json place = array_of(kNumber, "lon, lat in degrees");
  Json properties;
  properties["points"] = array_of(place, "places, one by one");
  properties["line"] = array_of(place, "the corners of a line");
  properties["type"] = text("of GeoJSON: Point, MultiPoint, LineString or Feature");
  properties["coordinates"] = array_of(Json::object(), "of GeoJSON");
  properties["geometry"] = typed("object", "of a Feature");
  Json made = object(properties, Json::array_t{});
  made["description"] = "points, line or GeoJSON";
  return made;
}

Json upload() {
  return object(
      {{"id", kText}, {"name", text("of Upload-Metadata")}, {"offset", number("bytes on disk")}, {"length", number("bytes")}},
      {"id", "name", "offset", "length"});
}

void add_service(Json& all) {
  const Json program = {{"name", kText}, {"version", kText}};
  all["program"] = object(program, {"name", "version"});
  Json index = program;
  index["links"] = map_of(kText, "paths");
  index["options"] = map_of(object({{"help", kText}, {"accepted", kText}}, {"help", "accepted"}), "of a POST");
  all["index"] = object(index, {"name", "version", "links", "options"});
}

void add_stac(Json& all) {
  all["stac_link"] = object({{"rel", kText}, {"href", kText}, {"type", kText}, {"title", kText}}, {"rel", "href"});
  const Json links = list_of("stac_link"), classes = array_of(kText, "conformance classes");
  Json named = {{"type", kText}, {"stac_version", kText}, {"id", kText}, {"title", kText}, {"description", kText}};
  named["links"] = links;
  Json catalog = named, collection = named;
  catalog["conformsTo"] = classes;
  collection["license"] = kText;
  collection["extent"] = typed("object", "spatial and temporal");
  const Json of_both = {"type", "stac_version", "id", "description", "links"};
  all["stac_catalog"] = object(catalog, of_both);
  all["stac_collection"] = object(collection, of_both);
  all["stac_conformance"] = object({{"conformsTo", classes}}, {"conformsTo"});
  all["stac_collections"] = object({{"collections", list_of("stac_collection")}, {"links", links}}, {"collections", "links"});
  Json item = {{"type", kText}, {"stac_version", kText}, {"id", kText}, {"collection", kText}};
  item["stac_extensions"] = array_of(kText, "addresses of schemas");
  item["geometry"] = typed("object", "GeoJSON: Polygon, or MultiPolygon across the antimeridian");
  item["bbox"] = array_of(kNumber, "west, south, east, north in degrees");
  item["properties"] = typed("object", "datetime, created, title, providers, cordillera:levels, cordillera:heights");
  item["links"] = links;
  const Json asset = object({{"href", kText}, {"type", kText}, {"title", kText}, {"roles", array_of(kText, "data or metadata")}},
                            {"href", "type", "title", "roles"});
  item["assets"] = map_of(asset, "by the names of formats");
  all["stac_item"] = object(item, {"type", "stac_version", "id", "geometry", "bbox", "properties", "links", "assets"});
  all["stac_items"] =
      object({{"type", kText}, {"features", list_of("stac_item")}, {"numberReturned", {{"type", "integer"}}}, {"links", links}},
             {"type", "features", "numberReturned", "links"});
}

/// Of TileJSON 3.0 what every client reads; documents say more.
Json tilejson() {
  Json properties;
  for (const char* word : {"tilejson", "name", "version", "attribution", "description", "scheme"}) properties[word] = kText;
  properties["tiles"] = array_of(kText, "templates of addresses");
  for (const char* zoom : {"minzoom", "maxzoom"}) properties[zoom] = {{"type", "integer"}};
  properties["bounds"] = array_of(kNumber, "west, south, east, north in degrees");
  properties["center"] = array_of(kNumber, "longitude, latitude, zoom");
  Json made = object(properties, {"tilejson", "tiles", "minzoom", "maxzoom", "bounds"});
  made["additionalProperties"] = true;
  return made;
}

}  // namespace

void add_answers(Json& schemas) {
  schemas["manifest"] = manifest();
  schemas["summary"] = summary();
  schemas["updates"] = updates();
  schemas["estimate"] = estimate();
  schemas["elevations"] = elevations();
  schemas["places"] = places();
  schemas["upload"] = upload();
  schemas["tilejson"] = tilejson();
  add_service(schemas);
  add_stac(schemas);
}

}  // namespace cordillera::server::openapi
