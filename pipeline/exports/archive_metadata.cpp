#include "pipeline/exports/archive_metadata.h"

#include <algorithm>
#include <cmath>

#include "pipeline/encode/json.h"
#include "pipeline/exports/tile_places.h"
#include "pipeline/exports/whole_file.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/tileset/html_text.h"
#include "pipeline/tileset/manifest_json.h"
#include "raster/place/area.h"

namespace cordillera::pipeline::exports {
namespace {

const char* address_rule(faces::Grid grid) {
  if (grid == faces::Grid::web_mercator) return "zoom, column and row from the north are the tile's own z, x and y";
  if (grid == faces::Grid::web_mercator_south)
    return "zoom and column are the tile's own z and x, the row from the north is 2^z - 1 - y (y counts from the south)";
  return "zoom is level + 1, the column is x, the row from the north is 2^level - 1 - y (y counts from the south)";
}

/// The document that a client is given, where that is JSON; else an empty object.
Json entry_of(const faces::Terrain& terrain, const faces::Face& face) {
  const auto found = faces::find(face.entry);
  if (!found || found->resource->type != "application/json") return Json::object();
  Json json = Json::parse(made(terrain, *found->resource, found->place).bytes, nullptr, false);
  return json.is_object() ? json : Json::object();
}

raster::Area area_in(const proto::Manifest& manifest, faces::Grid grid) {
  constexpr raster::Area kEverywhere{-180, -90, 180, 90};
  return (is_mercator(grid) ? faces::extent_of(manifest) : raster::area_of(manifest.bounds())).value_or(kEverywhere);
}

}  // namespace

Extent extent_of(const proto::Manifest& manifest, faces::Grid grid) {
  const raster::Area whole = raster::unwrapped(area_in(manifest, grid));
  return {whole.west_deg, whole.south_deg, whole.east_deg, whole.north_deg};
}

std::string with_commas(std::initializer_list<double> values) {
  std::string text;
  for (const double value : values) text.append(text.empty() ? "" : ",").append(Json(value).dump());
  return text;
}

View view_of(const proto::Manifest& manifest, faces::Grid grid, int least, int most) {
  const raster::Area area = area_in(manifest, grid);
  const double degrees = std::max({area.east_deg - area.west_deg, area.north_deg - area.south_deg, 1e-6});
  return {raster::middle_longitude_deg(area), (area.south_deg + area.north_deg) / 2,
          std::clamp(static_cast<int>(std::floor(std::log2(2 * 360 / degrees))), least, most)};
}

std::string title_of(const proto::Manifest& manifest) { return manifest.title().empty() ? manifest.name() : manifest.title(); }

std::string pixel_encoding(const faces::Terrain& terrain, const faces::Face& face) {
  const Json json = entry_of(terrain, face);
  return json.contains("encoding") && json["encoding"].is_string() ? json["encoding"].get<std::string>() : "";
}

Json vector_layers(const faces::Terrain& terrain, const faces::Face& face, int least, int most) {
  const Json json = entry_of(terrain, face);
  Json layers = json.contains("vector_layers") ? json["vector_layers"] : Json::array();
  for (Json& layer : layers) {
    layer["minzoom"] = least;
    layer["maxzoom"] = most;
  }
  return layers;
}

std::string format_name(const faces::Resource& tiles) {
  return tiles.type == faces::kVectorTile ? "pbf" : std::string(tiles.path.substr(tiles.path.rfind('.') + 1));
}

std::string layer_type(const faces::Resource& tiles) { return tiles.type == faces::kVectorTile ? "overlay" : "baselayer"; }

std::string archive_metadata(const faces::Terrain& terrain, const faces::Face& face, int least, int most) {
  const proto::Manifest& manifest = terrain.manifest();
  const faces::Resource& tiles = *tiles_of(face);
  Json json;
  json["name"] = title_of(manifest);
  json["description"] = std::string(tiles.about);
  json["attribution"] = html_text(manifest.attribution());
  json["type"] = layer_type(tiles);
  json["version"] = "1";
  json["format"] = format_name(tiles);
  json["media_type"] = std::string(tiles.type);
  json["face"] = std::string(face.name);
  json["tile_matrix_set"] = square_matrix_set(tiles.grid);
  json["address_rule"] = address_rule(tiles.grid);
  if (const std::string encoding = pixel_encoding(terrain, face); !encoding.empty()) json["encoding"] = encoding;
  if (tiles.type == faces::kVectorTile) json["vector_layers"] = vector_layers(terrain, face, least, most);
  json["manifest"] = Json::parse(manifest_json(manifest));
  return json.dump();
}

}  // namespace cordillera::pipeline::exports
