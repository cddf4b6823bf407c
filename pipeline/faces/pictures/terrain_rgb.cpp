#include "pipeline/faces/pictures/terrain_rgb.h"

#include <array>

#include "pipeline/faces/pictures/height_colours.h"
#include "pipeline/faces/pictures/raster_tiles.h"
#include "pipeline/faces/tilejson.h"

namespace cordillera::pipeline::faces {
namespace {

using Made = proto::Result<std::optional<Document>>;

constexpr HeightColour kColour{10000, 0.1};
constexpr std::string_view kFormula = "-10000 + 0.1 * (R * 65536 + G * 256 + B)";

std::vector<std::uint8_t> pixels(const Terrain&, const HeightGrid& grid, const Place&) { return coloured(grid, kColour); }

constexpr RasterStyle kPng{"terrain-rgb/{z}/{x}/{y}.png", pixels, rgb_png, Beyond::faded};
constexpr RasterStyle kWebp{"terrain-rgb/{z}/{x}/{y}.webp", pixels, rgb_webp, Beyond::faded};

Made png_tile(const Terrain& terrain, const Place& place) { return raster_tile(terrain, place, kPng); }
Made webp_tile(const Terrain& terrain, const Place& place) { return raster_tile(terrain, place, kWebp); }

RasterTileset tileset(std::string_view path, std::string_view format) {
  return {path, format, "Heights in metres as Terrain-RGB", "mapbox", kFormula, kColour.step_m / 2};
}
Made png_json(const Terrain& terrain, const Place&) { return tilejson(terrain, tileset(kPng.path, "png")); }
Made webp_json(const Terrain& terrain, const Place&) { return tilejson(terrain, tileset(kWebp.path, "webp")); }

constexpr std::array<Resource, 2> kPngResources = {{
    {"terrain-rgb.json", Grid::none, "application/json", "TileJSON 3.0 of the tiles", png_json, Links::tile_templates},
    {kPng.path, Grid::web_mercator, "image/png", "Heights above the geoid: -10000 + 0.1 * (R * 65536 + G * 256 + B)", png_tile},
}};
constexpr std::array<Resource, 2> kWebpResources = {{
    {"terrain-rgb-webp.json", Grid::none, "application/json", "TileJSON 3.0 of the WebP tiles", webp_json, Links::tile_templates},
    {kWebp.path, Grid::web_mercator, "image/webp", "The same heights as lossless WebP", webp_tile},
}};

void each_png(const Terrain& terrain, const PathSink& sink) {
  each_raster_tile(terrain, kPng, sink);
  sink("terrain-rgb.json");
}
void each_webp(const Terrain& terrain, const PathSink& sink) {
  each_raster_tile(terrain, kWebp, sink);
  sink("terrain-rgb-webp.json");
}

}  // namespace

const Face& terrain_rgb() {
  static const Face kFace = {"terrain-rgb", "MapLibre GL, Mapbox GL, deck.gl: heights as PNG", "terrain-rgb.json", kPngResources,
                             each_png};
  return kFace;
}

const Face& terrain_rgb_webp() {
  static const Face kFace = {"terrain-rgb-webp", "the same as lossless WebP", "terrain-rgb-webp.json", kWebpResources, each_webp};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
