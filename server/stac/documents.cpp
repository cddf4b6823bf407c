#include "server/stac/documents.h"

#include <array>

#include "pipeline/faces/face.h"

namespace cordillera::server::stac {
namespace {

constexpr const char* kVersion = "1.0.0";
constexpr const char* kJson = "application/json";
constexpr const char* kGeoJson = "application/geo+json";

const std::vector<std::string>& classes() {
  static const std::vector<std::string> kClasses = {"https://api.stacspec.org/v1.0.0/core",
                                                    "https://api.stacspec.org/v1.0.0/collections",
                                                    "http://www.opengis.net/spec/ogcapi-common-1/1.0/conf/core",
                                                    "http://www.opengis.net/spec/ogcapi-common-1/1.0/conf/landing-page",
                                                    "http://www.opengis.net/spec/ogcapi-common-1/1.0/conf/json",
                                                    "http://www.opengis.net/spec/ogcapi-common-2/1.0/conf/collections"};
  return kClasses;
}

Json link(const char* rel, const std::string& href, const char* type, const char* title = nullptr) {
  Json json = {{"rel", rel}, {"href", href}, {"type", type}};
  if (title != nullptr) json["title"] = title;
  return json;
}

std::string home(const ServiceRoot& place) { return place.root + "/stac"; }
std::string home_of_collection(const ServiceRoot& place) { return home(place) + "/collections/datasets"; }

/// West, south, east, north with longitudes in [-180, 180]; west above east crosses the antimeridian.
std::array<double, 4> box_of(const proto::Manifest& manifest) {
  if (manifest.bounds_size() < 4) return {-180, -90, 180, 90};
  std::array<double, 4> box = {manifest.bounds(0), manifest.bounds(1), manifest.bounds(2), manifest.bounds(3)};
  if (box[2] - box[0] >= 360) return {-180, box[1], 180, box[3]};
  for (const std::size_t side : {std::size_t{0}, std::size_t{2}}) {
    if (box[side] > 180) box[side] -= 360;
    if (box[side] < -180) box[side] += 360;
  }
  return box;
}

Json ring(double west, double south, double east, double north) {
  Json corners = Json::array({{west, south}, {east, south}, {east, north}, {west, north}, {west, south}});
  return Json::array({std::move(corners)});
}

/// GeoJSON cuts at the antimeridian (RFC 7946, 3.1.9).
Json geometry_of(const std::array<double, 4>& box) {
  const auto& [west, south, east, north] = box;
  if (west <= east) return {{"type", "Polygon"}, {"coordinates", ring(west, south, east, north)}};
  return {{"type", "MultiPolygon"},
          {"coordinates", Json::array({ring(west, south, 180, north), ring(-180, south, east, north)})}};
}

Json asset(const std::string& href, std::string_view type, std::string_view title, const char* role) {
  return {{"href", href}, {"type", std::string(type)}, {"title", std::string(title)}, {"roles", Json::array({role})}};
}

/// What a client of each format is given, and files of the whole.
Json assets_of(const std::string& path, const Offered& offered) {
  Json assets;
  for (const pipeline::faces::Face* face : offered.faces) {
    const auto entry = pipeline::faces::find(face->entry);
    const std::string_view type = entry ? entry->resource->type : std::string_view(kJson);
    assets[std::string(face->name)] = asset(path + "/" + std::string(face->entry), type, face->about, "data");
  }
  assets["manifest"] =
      asset(path + "/manifest.json", kJson, "What was read and assumed, and the error of every level", "metadata");
  if (!offered.archive) return assets;
  assets["pmtiles"] =
      asset(path + ".pmtiles", "application/vnd.pmtiles", "Pictures of heights (Terrain-RGB) in one archive", "data");
  return assets;
}

}  // namespace

Json landing_page(const ServiceRoot& place) {
  Json json = {{"type", "Catalog"}, {"stac_version", kVersion}, {"id", "cordillera"}, {"title", "Cordillera"}};
  json["description"] = "Terrain for the web: each dataset is an elevation model as level-of-detail tiles in several formats";
  json["conformsTo"] = classes();
  json["links"] =
      Json::array({link("self", home(place), kJson), link("root", home(place), kJson),
                   link("conformance", home(place) + "/conformance", kJson, "What this service conforms to"),
                   link("data", home(place) + "/collections", kJson, "Collections"),
                   link("http://www.opengis.net/def/rel/ogc/1.0/data", home(place) + "/collections", kJson, "Collections"),
                   link("child", home_of_collection(place), kJson, "Datasets"),
                   link("service-desc", place.root + "/openapi.json", kOpenApiType, "OpenAPI"),
                   link("service-doc", place.root + "/docs", "text/html", "The same for people")});
  return json;
}

Json conformance() { return {{"conformsTo", classes()}}; }

Json collection(const ServiceRoot& place) {
  Json json = {{"type", "Collection"}, {"stac_version", kVersion}, {"id", "datasets"}, {"title", "Datasets"}};
  json["description"] = "The datasets of this service that are ready and that you may read";
  json["license"] = "various";  // each dataset has the terms of its source
  // Of all that there may be: the box of what there is would take a look at every dataset.
  json["extent"]["spatial"]["bbox"] = Json::array({{-180, -90, 180, 90}});
  json["extent"]["temporal"]["interval"] = Json::array({{nullptr, nullptr}});
  json["links"] = Json::array({link("self", home_of_collection(place), kJson), link("root", home(place), kJson),
                               link("parent", home(place), kJson),
                               link("items", home_of_collection(place) + "/items", kGeoJson, "Datasets, newest first")});
  return json;
}

Json collections(const ServiceRoot& place) {
  return {{"collections", Json::array({collection(place)})},
          {"links", Json::array({link("self", home(place) + "/collections", kJson), link("root", home(place), kJson)})}};
}

Json item(const ServiceRoot& place, const Dataset& dataset, const proto::Manifest& manifest, const Offered& offered) {
  const std::string path = place.root + "/v1/datasets/" + dataset.id, here = home_of_collection(place);
  const auto box = box_of(manifest);
  Json json = {{"type", "Feature"}, {"stac_version", kVersion}, {"id", dataset.id}, {"collection", "datasets"}};
  json["stac_extensions"] = Json::array();
  json["geometry"] = geometry_of(box);
  json["bbox"] = box;
  Json& about = json["properties"];
  about["datetime"] = dataset.created;  // when it was posted: rasters seldom say when they were measured
  about["created"] = dataset.created;
  about["title"] = manifest.title().empty() ? dataset.name : manifest.title();
  if (!manifest.attribution().empty())
    about["providers"] = Json::array({{{"name", manifest.attribution()}, {"roles", Json::array({"producer"})}}});
  about["cordillera:levels"] = {manifest.min_level(), manifest.max_level()};
  if (manifest.bounds_size() >= 6) about["cordillera:heights"] = {manifest.bounds(4), manifest.bounds(5)};
  json["links"] = Json::array({link("self", here + "/items/" + dataset.id, kGeoJson), link("root", home(place), kJson),
                               link("parent", here, kJson), link("collection", here, kJson),
                               link("via", path, kJson, "The dataset in this service's own API")});
  json["assets"] = assets_of(path, offered);
  return json;
}

Json item_list(const ServiceRoot& place, const std::vector<Json>& items, const std::string& self, const std::string& next) {
  const std::string here = home_of_collection(place), own = here + "/items" + (self.empty() ? "" : "?" + self);
  Json json = {{"type", "FeatureCollection"}, {"features", items}, {"numberReturned", items.size()}};
  json["links"] = Json::array({link("self", own, kGeoJson), link("root", home(place), kJson), link("collection", here, kJson)});
  if (!next.empty()) json["links"].push_back(link("next", here + "/items?" + next, kGeoJson));
  return json;
}

}  // namespace cordillera::server::stac
