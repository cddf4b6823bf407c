#include "pipeline/contours/contours.h"

#include <algorithm>
#include <array>

#include "pipeline/contours/contour_grid.h"
#include "pipeline/contours/interval.h"
#include "pipeline/contours/tile_lines.h"
#include "pipeline/contours/vector_tile.h"
#include "pipeline/encode/json.h"
#include "pipeline/faces/pictures/pixel_heights.h"
#include "pipeline/faces/pictures/raster_tiles.h"
#include "pipeline/faces/tilejson.h"
#include "pipeline/faces/web_mercator.h"

namespace cordillera::pipeline::contours {
namespace {

using faces::Document;
using faces::Place;
using faces::Terrain;
using Made = proto::Result<std::optional<Document>>;

constexpr std::string_view kTiles = "contours/{z}/{x}/{y}.mvt", kDocument = "contours.json";
constexpr std::string_view kAbout = "Contours: lines of equal height above the geoid";

/// Pieces of lines between neighbouring heights that a tile may begin with: five lines through every pixel. Only walls and noise
/// have more.
constexpr std::int64_t kMostPieces = 200'000;

/// How many multiples of an interval lie between neighbouring heights, the greater of both included.
std::int64_t pieces(const raster::HeightSteps& grid, Interval interval) {
  const auto number = [&](std::int32_t height) {
    return height >= 0 ? height / interval.mm : -((-height + interval.mm - 1) / interval.mm);
  };
  std::int64_t count = 0;
  const auto columns = static_cast<std::size_t>(grid.columns);
  for (std::size_t k = 0; k + columns + 1 < grid.height.size(); ++k) {
    const auto at = [&](std::size_t offset) { return grid.height[k + offset]; };
    const std::array<std::int32_t, 4> corners = {at(0), at(1), at(columns), at(columns + 1)};
    const auto [low, high] = std::minmax_element(corners.begin(), corners.end());
    if (*low != raster::kNoHeightHere) count += number(*high) - number(*low);
  }
  return count;
}

/// The least multiple of an interval at which a tile is not too large.
Interval bearable(const raster::HeightSteps& grid, Interval interval) {
  int step = 0;
  while (pieces(grid, {interval.mm * multiple(step)}) > kMostPieces) ++step;
  return {interval.mm * multiple(step)};
}

proto::Result<Interval> interval_of(const Terrain& terrain, const Place& place) {
  const auto& source = terrain.manifest().source();
  const Interval chosen{terrain.look().interval_mm};
  if (place.interval.empty())
    return chosen.mm > 0 ? at_zoom(chosen, place.z) : usual_interval(place.z, source.max_height() - source.min_height());
  const auto asked = interval_asked(place.interval);
  if (!asked) return asked.problem();
  return at_zoom(*asked, place.z);
}

std::string path_at(const Place& place) {
  faces::Resource tiles;
  tiles.path = kTiles;
  return faces::path_of(tiles, place);
}

Made tile(const Terrain& terrain, const Place& place) {
  const auto interval = interval_of(terrain, place);
  if (!interval) return interval.problem();
  return terrain.kept(path_at(place) + "?" + std::to_string(interval->mm), [&]() -> Made {
    const auto grid = contour_grid(terrain, place);
    if (!grid) return grid.problem();
    if (!*grid) return std::optional<Document>();
    const Interval drawn = bearable(**grid, *interval);
    const std::vector<Contour> contours = tile_lines(raster::height_lines(**grid, drawn.mm), kReach);
    if (contours.empty()) return std::optional<Document>();
    return std::optional(faces::document(vector_tile(contours, drawn)));
  });
}

double metres(Interval interval) { return interval.mm / 1000.0; }

Json layer(const faces::Zooms& zooms) {
  constexpr std::string_view kTold =
      "ele: metres above the geoid. index: the greatest of 1, 2, 5 and 10 that the line's height in intervals "
      "is a multiple of";
  Json fields = {{"ele", "Number"}, {"index", "Number"}};  // types alone: readers of MBTiles know no other words
  Json out = {{"id", kLayer}, {"description", kTold}, {"minzoom", zooms.first}, {"maxzoom", zooms.last}};
  out["fields"] = std::move(fields);
  return out;
}

Made json(const Terrain& terrain, const Place& place) {
  if (!place.interval.empty()) {
    if (const auto asked = interval_asked(place.interval); !asked) return asked.problem();
  }
  const proto::Manifest& manifest = terrain.manifest();
  const auto extent = faces::extent_of(manifest);
  if (!extent) return faces::beyond_mercator();
  if (const auto undulation = terrain.undulation_m(extent->west_deg, extent->south_deg); !undulation) return undulation.problem();
  const faces::Zooms zooms = faces::zooms_of(manifest, *extent);
  std::string path(kTiles);
  if (!place.interval.empty()) path.append("?interval=").append(place.interval);
  Json out = faces::tilejson_head(manifest, *extent, zooms, path);
  out["description"] = kAbout;
  out["format"] = "pbf";
  out["vector_layers"].push_back(layer(zooms));
  out["heights"] = "metres above the geoid " + terrain.geoid_name();
  out["vertical_datum"] = terrain.geoid_name();
  for (int zoom = zooms.first; zoom <= zooms.last; ++zoom) {
    Json entry = faces::zoom_entry(manifest, *extent, zooms, zoom);
    entry["interval"] = metres(*interval_of(terrain, {.z = zoom, .interval = place.interval}));
    entry["least_interval"] = metres(least_interval(zoom));
    out["zooms"].push_back(std::move(entry));
  }
  return std::optional(faces::document(out.dump(1, ' ', false, Json::error_handler_t::replace)));
}

constexpr std::array<faces::Resource, 2> kResources = {{
    {.path = kDocument,
     .type = "application/json",
     .about = "TileJSON 3.0 of the contours",
     .make = json,
     .links = faces::Links::tile_templates,
     .intervals = kIntervals},
    {.path = kTiles,
     .grid = faces::Grid::web_mercator,
     .type = faces::kVectorTile,
     .about = kAbout,
     .make = tile,
     .absent = faces::Absent::no_content,
     .intervals = kIntervals},
}};

void each_path(const Terrain& terrain, const faces::PathSink& sink) {
  faces::each_shown_tile(terrain, faces::Beyond::clear, sink, [&](const Place& place) -> std::optional<std::string> {
    if (sink.named() == faces::Named::expected) return path_at(place);
    const auto made = tile(terrain, place);
    if (made && !*made) return std::nullopt;
    return path_at(place);  // a problem is told to whoever fetches it
  });
  sink(std::string(kDocument));
}

}  // namespace

const faces::Face& contours() {
  static const faces::Face kFace = {"contours", "MapLibre GL, Mapbox GL, OpenLayers, QGIS: lines of equal height", kDocument,
                                    kResources, each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::contours
