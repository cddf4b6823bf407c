#include "pipeline/faces/pictures/height_pictures.h"

#include <array>

#include "pipeline/faces/pictures/height_colours.h"
#include "pipeline/faces/pictures/raster_tiles.h"
#include "pipeline/faces/tilejson.h"

namespace cordillera::pipeline::faces {
namespace {

using Made = proto::Result<std::optional<Document>>;

/// A way to write heights as colours. formula: of the height, in words of R, G and B.
struct HeightCode {
  HeightColour colour;
  std::string_view encoding, title, formula;
};
constexpr HeightCode kTerrainRgb{
    {10000, 0.1}, "mapbox", "Heights in metres as Terrain-RGB", "-10000 + 0.1 * (R * 65536 + G * 256 + B)"};
constexpr HeightCode kTerrarium{
    {32768, 1.0 / 256}, "terrarium", "Heights in metres as Terrarium", "R * 256 + G + B / 256 - 32768"};

/// The pictures of one way in one format of images.
struct HeightPicture {
  const HeightCode& code;
  std::string_view path, entry, format, type;
  std::string (*encode)(const std::vector<std::uint8_t>& pixels);
  std::string_view json_about, about;
};
constexpr std::string_view kPngJson = "TileJSON 3.0 of the tiles", kWebpJson = "TileJSON 3.0 of the WebP tiles",
                           kWebpTiles = "The same heights as lossless WebP";
constexpr HeightPicture kRgbPng{kTerrainRgb,        "terrain-rgb/{z}/{x}/{y}.png",
                                "terrain-rgb.json", "png",
                                "image/png",        rgb_png,
                                kPngJson,           "Heights above the geoid: -10000 + 0.1 * (R * 65536 + G * 256 + B)"};
constexpr HeightPicture kRgbWebp{
    kTerrainRgb, "terrain-rgb/{z}/{x}/{y}.webp", "terrain-rgb-webp.json", "webp", "image/webp", rgb_webp, kWebpJson, kWebpTiles};
constexpr HeightPicture kTerrariumPng{kTerrarium,       "terrarium/{z}/{x}/{y}.png",
                                      "terrarium.json", "png",
                                      "image/png",      rgb_png,
                                      kPngJson,         "Heights above the geoid: R * 256 + G + B / 256 - 32768"};
constexpr HeightPicture kTerrariumWebp{
    kTerrarium, "terrarium/{z}/{x}/{y}.webp", "terrarium-webp.json", "webp", "image/webp", rgb_webp, kWebpJson, kWebpTiles};

/// The functions of a face for one kind of pictures.
template <const HeightPicture& picture>
struct Pictured {
  static std::vector<std::uint8_t> pixels(const Terrain&, const PixelHeights& grid, const Place&) {
    return coloured(grid, picture.code.colour);
  }
  static constexpr RasterStyle kStyle{picture.path, pixels, picture.encode, Beyond::faded};

  static Made tile(const Terrain& terrain, const Place& place) { return raster_tile(terrain, place, kStyle); }
  static Made json(const Terrain& terrain, const Place&) {
    const HeightCode& code = picture.code;
    return tilejson(terrain, {picture.path, picture.format, code.title, code.encoding, code.formula, code.colour.step_m / 2,
                              -code.colour.base_m});
  }
  static void each_path(const Terrain& terrain, const PathSink& sink) {
    each_raster_tile(terrain, kStyle, sink);
    sink(std::string(picture.entry));
  }
  static constexpr std::array<Resource, 2> kResources = {{
      {picture.entry, Grid::none, "application/json", picture.json_about, json, Links::tile_templates},
      {picture.path, Grid::web_mercator, picture.type, picture.about, tile},
  }};
  static Face face(std::string_view name, std::string_view about) { return {name, about, picture.entry, kResources, each_path}; }
};

}  // namespace

const Face& terrain_rgb() {
  static const Face kFace = Pictured<kRgbPng>::face("terrain-rgb", "MapLibre GL, Mapbox GL, deck.gl: heights as PNG");
  return kFace;
}
const Face& terrain_rgb_webp() {
  static const Face kFace = Pictured<kRgbWebp>::face("terrain-rgb-webp", "the same as lossless WebP");
  return kFace;
}
const Face& terrarium() {
  static const Face kFace = Pictured<kTerrariumPng>::face("terrarium", "MapLibre GL, deck.gl: heights as PNG in finer steps");
  return kFace;
}
const Face& terrarium_webp() {
  static const Face kFace = Pictured<kTerrariumWebp>::face("terrarium-webp", "the same as lossless WebP");
  return kFace;
}

}  // namespace cordillera::pipeline::faces
