#include "pipeline/faces/tilejson.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "pipeline/encode/json.h"
#include "pipeline/faces/web_mercator.h"
#include "pipeline/store/levels_shown.h"
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

/// How far below an encoding's lowest height the levels may reach. A coarse level may go deeper than the data, by its error.
class CutOff {
 public:
  CutOff(const Terrain& terrain, const raster::Area& extent, double lowest_m)
      : manifest_(terrain.manifest()), lowest_m_(lowest_m) {
    const auto& levels = manifest_.levels();
    const bool deep = std::any_of(levels.begin(), levels.end(), [&](const proto::LevelSummary& level) {
      return level.min_height() - kMostUndulation_m < lowest_m;
    });
    if (deep) undulation_m_ = greatest_undulation_m(terrain, raster::unwrapped(extent));
  }
  double at(int level) const {
    const proto::LevelSummary* const summary = summary_of(manifest_, level);
    return summary == nullptr ? 0 : std::max(lowest_m_ - (summary->min_height() - undulation_m_), 0.0);
  }

 private:
  static double greatest_undulation_m(const Terrain& terrain, const raster::Area& e) {
    double greatest_m = -kMostUndulation_m;
    constexpr int kPlaces = 8;  // each way
    for (int y = 0; y <= kPlaces; ++y) {
      for (int x = 0; x <= kPlaces; ++x) {
        const auto here = terrain.undulation_m(e.west_deg + (e.east_deg - e.west_deg) * x / kPlaces,
                                               e.south_deg + (e.north_deg - e.south_deg) * y / kPlaces);
        if (here.ok()) greatest_m = std::max(greatest_m, *here);
      }
    }
    return greatest_m;
  }

  const proto::Manifest& manifest_;
  const double lowest_m_;
  double undulation_m_ = -kMostUndulation_m;  // where no level is so deep, none is with this either
};

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

Json zoom_entry(const proto::Manifest& manifest, const raster::Area& extent, const Zooms& zooms, int zoom,
                const std::function<double(int level)>& more_m) {
  const auto [equatorward, poleward] = std::minmax({std::abs(extent.south_deg), std::abs(extent.north_deg)});
  const bool equator = extent.south_deg < 0 && extent.north_deg > 0;
  Json levels = Json::array();
  std::optional<double> error_m;
  const int finest = level_of(manifest, zooms, zoom, poleward);
  for (int level = level_of(manifest, zooms, zoom, equator ? 0 : equatorward); level <= finest; ++level) {
    levels.push_back(level);
    const auto stated_m = stated_error_m(manifest, level);
    if (stated_m) error_m = std::max(error_m.value_or(0), *stated_m + (more_m ? more_m(level) : 0));
  }
  const Json stated = error_m ? Json(std::ceil(*error_m * 1e4) / 1e4) : Json();
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
  const CutOff cut(terrain, *extent, tiles.lowest_m);
  if (cut.at(static_cast<int>(manifest.max_level())) > 0)
    out["note"] = "the data goes deeper than this encoding, which ends at -10000 m; terrarium.json has all of it";
  const auto more_m = [&](int level) { return tiles.rounding_m + cut.at(level); };
  for (int zoom = zooms.first; zoom <= zooms.last; ++zoom)
    out["zooms"].push_back(zoom_entry(manifest, *extent, zooms, zoom, more_m));
  return std::optional(document(out.dump(1, ' ', false, Json::error_handler_t::replace)));
}

}  // namespace cordillera::pipeline::faces
