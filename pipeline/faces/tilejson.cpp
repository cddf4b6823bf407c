#include "pipeline/faces/tilejson.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "pipeline/build/provisional.h"
#include "pipeline/encode/json.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/tileset/html_text.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr double kMostUndulation_m = 110;  // of any geoid, up or down

/// Degrees for people; a tenth of a metre on the ground.
double short_deg(double deg) { return std::round(deg * 1e6) / 1e6; }

/// Longitudes of a TileJSON may not wrap.
Json bounds(const raster::Area& extent) {
  const raster::Area e = raster::unwrapped(extent);
  return {short_deg(e.west_deg), short_deg(e.south_deg), short_deg(e.east_deg), short_deg(e.north_deg)};
}

/// The zoom at which the data is about two tiles wide or high.
Json center(const raster::Area& e, const Zooms& zooms) {
  const double wide = longitude_pixel(0, e.east_deg) - longitude_pixel(0, e.west_deg);
  const double high = latitude_pixel(0, e.south_deg) - latitude_pixel(0, e.north_deg);
  const double zoom = std::floor(std::log2(2 * kTilePixels / std::max({wide, high, 1e-6})));
  return {short_deg(raster::middle_longitude_deg(e)), short_deg((e.south_deg + e.north_deg) / 2),
          std::clamp(static_cast<int>(zoom), zooms.first, zooms.last)};
}

/// How far below the encoding's lowest height the data may reach.
double cut_off_m(const Terrain& terrain, const raster::Area& extent, double lowest_m) {
  double lowest_there_m = 0;
  for (const proto::LevelSummary& level : terrain.manifest().levels())
    lowest_there_m = std::min(lowest_there_m, level.min_height());
  if (lowest_there_m - kMostUndulation_m >= lowest_m) return 0;
  const raster::Area e = raster::unwrapped(extent);
  double undulation_m = -kMostUndulation_m;
  constexpr int kPlaces = 8;  // each way
  for (int y = 0; y <= kPlaces; ++y) {
    for (int x = 0; x <= kPlaces; ++x) {
      const auto here = terrain.undulation_m(e.west_deg + (e.east_deg - e.west_deg) * x / kPlaces,
                                             e.south_deg + (e.north_deg - e.south_deg) * y / kPlaces);
      if (here.ok()) undulation_m = std::max(undulation_m, *here);
    }
  }
  return std::max(lowest_m - (lowest_there_m - undulation_m), 0.0);
}

void add_heights(Json& out, const Terrain& terrain, const RasterTileset& tiles) {
  out["encoding"] = tiles.encoding;
  out["height_formula"] = tiles.formula;
  out["heights"] = "metres above the geoid " + terrain.geoid_name();
  out["vertical_datum"] = terrain.geoid_name();
  out["no_data_height"] = 0;
}

}  // namespace

proto::Problem beyond_mercator() {
  return {"tile-unknown", "all of the dataset lies beyond 85.05 degrees of latitude, where Web Mercator ends",
          "drc, 3d-tiles, quantized-mesh and their kinds, which reach the poles", ""};
}

Json zoom_entry(const proto::Manifest& manifest, const raster::Area& extent, const Zooms& zooms, int zoom, double rounding_m) {
  const auto [equatorward, poleward] = std::minmax({std::abs(extent.south_deg), std::abs(extent.north_deg)});
  const bool equator = extent.south_deg < 0 && extent.north_deg > 0;
  Json levels = Json::array();
  std::optional<double> error_m;
  const int finest = level_of(manifest, zooms, zoom, poleward);
  for (int level = level_of(manifest, zooms, zoom, equator ? 0 : equatorward); level <= finest; ++level) {
    levels.push_back(level);
    error_m = std::max(error_m, stated_error_m(manifest, level));  // none is less than any
  }
  const Json stated = error_m ? Json(std::ceil((*error_m + rounding_m) * 1e4) / 1e4) : Json();
  return {{"zoom", zoom}, {"levels", std::move(levels)}, {"stated_max_error", stated}};
}

Json tilejson_head(const proto::Manifest& manifest, const raster::Area& extent, const Zooms& zooms, std::string_view tiles) {
  Json out = {{"tilejson", "3.0.0"}};
  out["name"] = manifest.title().empty() ? manifest.name() : manifest.title();
  out["version"] = "1.0.0";
  if (!manifest.attribution().empty()) out["attribution"] = html_text(manifest.attribution());
  out["scheme"] = "xyz";
  out["tiles"] = {tiles};
  out["vector_layers"] = Json::array();  // the specification's text does not want it of raster tiles; its schema does
  out["minzoom"] = zooms.first;
  out["maxzoom"] = zooms.last;
  out["bounds"] = bounds(extent);
  out["center"] = center(extent, zooms);
  return out;
}

proto::Result<std::optional<Document>> tilejson(const Terrain& terrain, const RasterTileset& tiles) {
  const proto::Manifest& manifest = terrain.manifest();
  const auto extent = extent_of(manifest);
  if (!extent) return beyond_mercator();
  if (const auto undulation = terrain.undulation_m(extent->west_deg, extent->south_deg); !undulation) return undulation.problem();
  const Zooms zooms = zooms_of(manifest, *extent);
  Json out = tilejson_head(manifest, *extent, zooms, tiles.path);
  out["description"] = tiles.about;
  out["tileSize"] = kTilePixels;
  out["format"] = tiles.format;
  if (!tiles.encoding.empty()) add_heights(out, terrain, tiles);
  if (tiles.more.is_object()) out.update(tiles.more);
  const double cut_m = cut_off_m(terrain, *extent, tiles.lowest_m);
  if (cut_m > 0) out["note"] = "the data goes deeper than this encoding, which ends at -10000 m; terrarium.json has all of it";
  for (int zoom = zooms.first; zoom <= zooms.last; ++zoom) {
    out["zooms"].push_back(zoom_entry(manifest, *extent, zooms, zoom, tiles.rounding_m + cut_m));
  }
  return std::optional(document(out.dump(1, ' ', false, Json::error_handler_t::replace)));
}

}  // namespace cordillera::pipeline::faces
