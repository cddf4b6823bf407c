#include "pipeline/faces/pictures/style_ramps.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "raster/place/area.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr std::array<RampStop, 8> kLand = {{{0, {122, 160, 112}},
                                            {0.14, {160, 186, 132}},
                                            {0.28, {206, 208, 158}},
                                            {0.42, {228, 214, 168}},
                                            {0.58, {208, 174, 130}},
                                            {0.74, {172, 132, 104}},
                                            {0.88, {172, 156, 148}},
                                            {1, {248, 247, 245}}}};
/// From the deepest place to the shore.
constexpr std::array<RampStop, 4> kSea = {
    {{0, {22, 62, 104}}, {0.5, {52, 112, 160}}, {0.85, {104, 164, 204}}, {1, {158, 204, 226}}}};
/// Of matplotlib, at every eighth.
constexpr std::array<RampStop, 9> kViridis = {{{0, {68, 1, 84}},
                                               {0.125, {71, 44, 122}},
                                               {0.25, {59, 81, 139}},
                                               {0.375, {44, 113, 142}},
                                               {0.5, {33, 144, 141}},
                                               {0.625, {39, 173, 129}},
                                               {0.75, {92, 200, 99}},
                                               {0.875, {170, 220, 50}},
                                               {1, {253, 231, 37}}}};
constexpr std::array<RampStop, 2> kGrey = {{{0, {0, 0, 0}}, {1, {255, 255, 255}}}};
constexpr std::array<RampStop, 8> kSteep = {{{0, {250, 250, 246}},
                                             {10, {253, 243, 196}},
                                             {20, {253, 216, 112}},
                                             {30, {249, 154, 60}},
                                             {40, {225, 72, 46}},
                                             {50, {160, 27, 90}},
                                             {65, {74, 20, 102}},
                                             {90, {18, 10, 46}}}};
constexpr std::array<RampStop, 9> kCompass = {{{0, {74, 111, 181}},
                                               {45, {95, 177, 183}},
                                               {90, {123, 191, 106}},
                                               {135, {214, 210, 90}},
                                               {180, {242, 165, 65}},
                                               {225, {228, 103, 74}},
                                               {270, {192, 75, 134}},
                                               {315, {127, 88, 176}},
                                               {360, {74, 111, 181}}}};

/// Where blue ends: heights of the sea itself are zero but for rounding and the stated error.
constexpr double kShore_m = 0.25;
constexpr double kShoreWidth_m = 0.01;
/// The deepest blue is never nearer to the shore.
constexpr double kLeastDepth_m = 20;

struct HeightSpan {
  double low_m = 0, high_m = 0;
};

/// Of a dataset, above the geoid, in whole metres: the manifest knows them above the ellipsoid, and the geoid's height changes
/// little within most datasets.
proto::Result<HeightSpan> heights_of(const Terrain& terrain) {
  const auto& bounds = terrain.manifest().bounds();
  if (bounds.size() < 6) return HeightSpan{0, 1};
  const raster::Area area = *raster::area_of(bounds);
  const auto undulation_m = terrain.undulation_m(raster::middle_longitude_deg(area), (bounds[1] + bounds[3]) / 2);
  if (!undulation_m) return undulation_m.problem();
  const double low = std::floor(bounds[4] - *undulation_m);
  return HeightSpan{low, std::max(std::ceil(bounds[5] - *undulation_m), low + 1)};
}

Ramp atlas(const HeightSpan& heights) {
  Ramp ramp = stretched(kSea, std::min(heights.low_m, -kLeastDepth_m), kShore_m);
  const double from = std::max(heights.low_m, kShore_m + kShoreWidth_m);
  if (from > kShore_m + kShoreWidth_m) ramp.push_back({kShore_m + kShoreWidth_m, kLand.front().rgb});
  const Ramp land = stretched(kLand, from, std::max(heights.high_m, from + 1));
  ramp.insert(ramp.end(), land.begin(), land.end());
  return ramp;
}

proto::Result<StyleColours> over(proto::Result<Ramp> ramp, double low, double high) {
  if (!ramp) return ramp.problem();
  return StyleColours{std::move(*ramp), low, high};
}

bool is_atlas(std::string_view text) { return text.empty() || text == "atlas"; }

proto::Result<Ramp> height_ramp(const HeightSpan& heights, std::string_view text) {
  if (is_atlas(text)) return atlas(heights);
  if (text == "land") return stretched(kLand, heights.low_m, heights.high_m);
  if (text == "viridis") return stretched(kViridis, heights.low_m, heights.high_m);
  if (text == "grey") return stretched(kGrey, heights.low_m, heights.high_m);
  return ramp_stops(text, kHeightRamps);
}

proto::Result<Ramp> slope_ramp(std::string_view text) {
  if (text.empty() || text == "steep") return Ramp(kSteep.begin(), kSteep.end());
  if (text == "grey") return stretched(kGrey, 0, 90);
  return ramp_stops(text, kSlopeRamps);
}

proto::Result<Ramp> aspect_ramp(std::string_view text) {
  if (text.empty() || text == "compass") return Ramp(kCompass.begin(), kCompass.end());
  if (text == "grey") return stretched(kGrey, 0, 360);
  return ramp_stops(text, kAspectRamps);
}

}  // namespace

proto::Result<StyleColours> height_colours(const Terrain& terrain, std::string_view text) {
  const auto heights = heights_of(terrain);
  if (!heights) return heights.problem();
  auto colours = over(height_ramp(*heights, text), heights->low_m, heights->high_m);
  if (colours) colours->sea = is_atlas(text);
  return colours;
}

proto::Result<StyleColours> slope_colours(const Terrain&, std::string_view text) { return over(slope_ramp(text), 0, 90); }

proto::Result<StyleColours> aspect_colours(const Terrain&, std::string_view text) { return over(aspect_ramp(text), 0, 360); }

}  // namespace cordillera::pipeline::faces
