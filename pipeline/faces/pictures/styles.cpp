#include "pipeline/faces/pictures/styles.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "pipeline/faces/pictures/gradient.h"
#include "pipeline/faces/pictures/png_image.h"
#include "pipeline/faces/pictures/raster_tiles.h"
#include "pipeline/faces/pictures/style_ramps.h"
#include "pipeline/faces/tilejson.h"
#include "proto/degrees.h"

namespace cordillera::pipeline::faces {
namespace {

using Made = proto::Result<std::optional<Document>>;

/// Flatter ground faces nowhere.
constexpr double kLeastSlope = 1e-3;

/// A pixel with data.
struct Pixel4 {
  Rgb rgb{};
  std::uint8_t alpha = 255;
};
struct Sample {
  double height_m = 0;
  Gradient rise;
  double exaggeration = 1;  ///< of the relief's shades
  double water = 0;         ///< share of the pixel
};
using Paint = Pixel4 (*)(const Sample& sample, const Ramp& ramp);

/// Lights from the south-west, west, north-west and north, each as strong as the slope faces it or away from it: cos² of the
/// angle between, as gdaldem -multidirectional has it. 1 on flat ground.
double multidirectional_shade(const Gradient& rise) {
  constexpr double kHalf = std::numbers::sqrt2 / 2, kAltitude = std::numbers::sqrt2 / 2;  // sines of 45 degrees
  constexpr std::array<std::array<double, 2>, 4> kLights = {{{-kHalf, -kHalf}, {-1, 0}, {-kHalf, kHalf}, {0, 1}}};
  const double square = rise.east * rise.east + rise.north * rise.north, length = std::sqrt(1 + square);
  double sum = 0;
  for (const auto& [east, north] : kLights) {
    const double along = rise.east * east + rise.north * north;
    const double weight = square > 0 ? along * along / square : 0.5;  // the four are 2 together
    sum += weight * std::max(1 - along, 0.0) * kAltitude / length;
  }
  return sum / 2 / kAltitude;
}

/// Shadows take light away, blue last; what faces the light goes towards white.
Rgb lit(const Rgb& colour, double shade) {
  constexpr double kLeast = 0.38, kGlare = 0.55;
  constexpr std::array<double, 3> kShadow = {1.0, 0.96, 0.86};
  Rgb out{};
  for (std::size_t k = 0; k < out.size(); ++k) {
    const double dark = 1 - (1 - kLeast) * kShadow[k] * (1 - std::min(shade, 1.0));
    const double glare = kGlare * std::clamp(shade - 1, 0.0, 1.0);
    out[k] = static_cast<std::uint8_t>(std::nearbyint(colour[k] * dark + (255 - colour[k]) * glare));
  }
  return out;
}

/// Water is as the sea of its depth; a lake above it, as the sea at its shore.
Rgb ground_colour(const Sample& sample, const Ramp& ramp) {
  Rgb out = colour_at(ramp, sample.height_m);
  if (sample.water <= 0) return out;
  const Rgb blue = colour_at(ramp, std::min(sample.height_m, 0.0));
  for (std::size_t k = 0; k < out.size(); ++k)
    out[k] = static_cast<std::uint8_t>(std::nearbyint(out[k] + sample.water * (blue[k] - out[k])));
  return out;
}

/// What waves and a radar make of water is no relief.
Pixel4 paint_relief(const Sample& sample, const Ramp& ramp) {
  const Gradient rise{sample.rise.east * sample.exaggeration, sample.rise.north * sample.exaggeration};
  const double shade = multidirectional_shade(rise);
  return {lit(ground_colour(sample, ramp), shade + sample.water * (1 - shade))};
}
Pixel4 paint_height(const Sample& sample, const Ramp& ramp) { return {ground_colour(sample, ramp)}; }
double steepness(const Gradient& rise) { return std::sqrt(rise.east * rise.east + rise.north * rise.north); }
Pixel4 paint_slope(const Sample& sample, const Ramp& ramp) {
  return {colour_at(ramp, std::atan(steepness(sample.rise)) * proto::kRadian_deg)};
}
Pixel4 paint_aspect(const Sample& sample, const Ramp& ramp) {
  if (steepness(sample.rise) < kLeastSlope) return {{}, 0};
  const double down = std::atan2(-sample.rise.east, -sample.rise.north) * proto::kRadian_deg;  // clockwise from north
  return {colour_at(ramp, down < 0 ? down + 360 : down)};
}

/// Of the shades, by zoom: coarse heights are smooth, and would look flat. A tile's whole zoom has one, so borders do not show.
double exaggeration(int zoom) {
  const double pixel_m = 2 * std::numbers::pi * 6378137 / std::ldexp(256, zoom);
  return std::clamp(std::sqrt(pixel_m / 25), 1.2, 8.0);
}

struct Style {
  std::string_view path, entry, about, unit;
  proto::Result<StyleColours> (*colours)(const Terrain& terrain, std::string_view text);
  Paint paint;
};

std::vector<std::uint8_t> painted(const Style& style, const Terrain& terrain, const PixelHeights& grid, const Place& place) {
  const auto colours = style.colours(terrain, place.ramp);
  std::vector<std::uint8_t> out(std::size_t{4} * kTilePixels * kTilePixels, 0);
  if (!colours) return out;  // whoever asks for the tile was told before
  auto pixel = out.begin();
  for (std::int32_t row = 0; row < kTilePixels; ++row) {
    const PixelSize size = pixel_size(place, row);
    for (std::int32_t column = 0; column < kTilePixels; ++column, pixel += 4) {
      const double height_m = grid.at(row, column);
      if (std::isnan(height_m)) continue;
      const double wet = colours->sea ? grid.water_at(row, column) : 0;
      const Pixel4 paint = style.paint({height_m, gradient(grid, row, column, size), exaggeration(place.z), wet}, colours->ramp);
      std::copy(paint.rgb.begin(), paint.rgb.end(), pixel);
      pixel[3] = paint.alpha;
    }
  }
  return out;
}

std::string rgb_alpha_png(const std::vector<std::uint8_t>& pixels) { return png(pixels, kTilePixels, Pixel::rgb_alpha); }

/// The functions of a face for one style.
template <const Style& style>
struct Styled {
  static std::vector<std::uint8_t> pixels(const Terrain& terrain, const PixelHeights& grid, const Place& place) {
    return painted(style, terrain, grid, place);
  }
  static constexpr RasterStyle kPng{style.path, pixels, rgb_alpha_png};

  static Made tile(const Terrain& terrain, const Place& place) {
    if (const auto colours = style.colours(terrain, place.ramp); !colours) return colours.problem();
    return raster_tile(terrain, place, kPng);
  }
  static Made json(const Terrain& terrain, const Place& place) {
    const auto colours = style.colours(terrain, place.ramp);
    if (!colours) return colours.problem();
    std::string path(style.path);
    if (!place.ramp.empty()) path.append("?ramp=").append(place.ramp);
    const Json more = {
        {"ramp", ramp_json(colours->ramp)}, {"ramp_unit", style.unit}, {"ramp_range", {colours->low, colours->high}}};
    return tilejson(terrain, {.path = path, .format = "png", .about = style.about, .more = more});
  }
  static void each_path(const Terrain& terrain, const PathSink& sink) {
    each_raster_tile(terrain, kPng, sink);
    sink(std::string(style.entry));
  }
};

template <const Style& style>
constexpr std::array<Resource, 2> resources(std::string_view json_about, std::string_view ramps) {
  return {{{style.entry, Grid::none, "application/json", json_about, Styled<style>::json, Links::tile_templates,
            Absent::not_found, Compression::none, nullptr, ramps},
           {style.path, Grid::web_mercator, "image/png", style.about, Styled<style>::tile, Links::relative, Absent::no_content,
            Compression::none, nullptr, ramps}}};
}

constexpr Style kRelief{
    "relief/{z}/{x}/{y}.png", "relief.json",  "Height as colour under shades of four lights, transparent outside the data",
    "metres above the geoid", height_colours, paint_relief};
constexpr Style kColour{
    "color-relief/{z}/{x}/{y}.png", "color-relief.json", "Height as colour without shades, transparent outside the data",
    "metres above the geoid",       height_colours,      paint_height};
constexpr Style kSlope{"slope/{z}/{x}/{y}.png", "slope.json", "Slope as colour, transparent outside the data", "degrees",
                       slope_colours,           paint_slope};
constexpr Style kAspect{"aspect/{z}/{x}/{y}.png",
                        "aspect.json",
                        "The direction that the ground faces as colour, transparent where it is flat and without data",
                        "degrees from north over east",
                        aspect_colours,
                        paint_aspect};

constexpr auto kReliefResources = resources<kRelief>("TileJSON 3.0 of the relief in colour", kHeightRamps);
constexpr auto kColourResources = resources<kColour>("TileJSON 3.0 of the heights as colours", kHeightRamps);
constexpr auto kSlopeResources = resources<kSlope>("TileJSON 3.0 of the slope", kSlopeRamps);
constexpr auto kAspectResources = resources<kAspect>("TileJSON 3.0 of the aspect", kAspectRamps);

}  // namespace

const Face& relief() {
  static const Face kFace = {"relief", "any map: a picture of the relief in colour", "relief.json", kReliefResources,
                             Styled<kRelief>::each_path};
  return kFace;
}
const Face& color_relief() {
  static const Face kFace = {"color-relief", "any map: heights as colours, to be shaded by the client", "color-relief.json",
                             kColourResources, Styled<kColour>::each_path};
  return kFace;
}
const Face& slope() {
  static const Face kFace = {"slope", "any map: how steep the ground is", "slope.json", kSlopeResources,
                             Styled<kSlope>::each_path};
  return kFace;
}
const Face& aspect() {
  static const Face kFace = {"aspect", "any map: which way the ground faces", "aspect.json", kAspectResources,
                             Styled<kAspect>::each_path};
  return kFace;
}

}  // namespace cordillera::pipeline::faces
