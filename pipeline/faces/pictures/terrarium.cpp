#include "pipeline/faces/pictures/terrarium.h"

#include <array>

#include "pipeline/faces/pictures/height_colours.h"
#include "pipeline/faces/pictures/raster_tiles.h"
#include "pipeline/faces/tilejson.h"

namespace cordillera::pipeline::faces {
namespace {

using Made = proto::Result<std::optional<Document>>;

constexpr HeightColour kColour{32768, 1.0 / 256};
constexpr std::string_view kFormula = "R * 256 + G + B / 256 - 32768";

std::vector<std::uint8_t> pixels(const Terrain&, const HeightGrid& grid, const Place&) { return coloured(grid, kColour); }

constexpr RasterStyle kPng{"terrarium/{z}/{x}/{y}.png", pixels, rgb_png, Beyond::faded};
constexpr RasterStyle kWebp{"terrarium/{z}/{x}/{y}.webp", pixels, rgb_webp, Beyond::faded};

Made png_tile(const Terrain& terrain, const Place& place) { return raster_tile(terrain, place, kPng); }
Made webp_tile(const Terrain& terrain, const Place& place) { return raster_tile(terrain, place, kWebp); }

RasterTileset tileset(std::string_view path, std::string_view format) {
  return {path, format, "Heights in metres as Terrarium", "terrarium", kFormula, kColour.step_m / 2};
}
Made png_json(const Terrain& terrain, const Place&) { return tilejson(terrain, tileset(kPng.path, "png")); }
Made webp_json(const Terrain& terrain, const Place&) { return tilejson(terrain, tileset(kWebp.path, "webp")); }

constexpr std::array<Resource, 2> kPngResources = {{
    {"terrarium.json", Grid::none, "application/json", "TileJSON 3.0 of the tiles", png_json, Links::tile_templates},
    {kPng.path, Grid::web_mercator, "image/png", "Heights above the geoid: R * 256 + G + B / 256 - 32768", png_tile},
}};
constexpr std::array<Resource, 2> kWebpResources = {{
    {"terrarium-webp.json", Grid::none, "application/json", "TileJSON 3.0 of the WebP tiles", webp_json, Links::tile_templates},
    {kWebp.path, Grid::web_mercator, "image/webp", "The same heights as lossless WebP", webp_tile},
}};

void each_png(const Terrain& terrain, const PathSink& sink) {
  each_raster_tile(terrain, kPng, sink);
  sink("terrarium.json");
}
void each_webp(const Terrain& terrain, const PathSink& sink) {
  each_raster_tile(terrain, kWebp, sink);
  sink("terrarium-webp.json");
}

}  // namespace

const Face& terrarium() {
  static const Face kFace = {"terrarium", "MapLibre GL, deck.gl: heights as PNG in finer steps", "terrarium.json", kPngResources,
                             each_png};
  return kFace;
}

const Face& terrarium_webp() {
  static const Face kFace = {"terrarium-webp", "the same as lossless WebP", "terrarium-webp.json", kWebpResources, each_webp};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
