#pragma once
// The colours of styled pictures: which ramps a style knows by name, and what they come to for a dataset.
#include <string_view>

#include "pipeline/faces/pictures/colour_ramp.h"
#include "pipeline/faces/terrain.h"

namespace cordillera::pipeline::faces {

/// What ?ramp= accepts, for the API's description and for refusals.
inline constexpr std::string_view kHeightRamps =
    "atlas (blue below the sea's level and where water masks say; the default), land (no blue), viridis, grey; or stops in "
    "metres above the geoid, "
    "VALUE:RRGGBB,VALUE:RRGGBB,…";
inline constexpr std::string_view kSlopeRamps =
    "steep (the default), grey (0 to 90 degrees); or stops in degrees, VALUE:RRGGBB,VALUE:RRGGBB,…";
inline constexpr std::string_view kAspectRamps =
    "compass (the default), grey (0 to 360 degrees); or stops in degrees from north over east, VALUE:RRGGBB,VALUE:RRGGBB,…";

struct StyleColours {
  Ramp ramp;
  double low = 0, high = 0;  ///< what a legend need show: the data's own heights in metres above the geoid, or degrees
  bool sea = false;          ///< blue below 0 m: water that lies higher is as blue
};

/// For heights of a dataset: named ramps are stretched over what the manifest's bounds say of them. A problem where the text is
/// no ramp, or without a geoid.
proto::Result<StyleColours> height_colours(const Terrain& terrain, std::string_view text);
proto::Result<StyleColours> slope_colours(const Terrain& terrain, std::string_view text);
proto::Result<StyleColours> aspect_colours(const Terrain& terrain, std::string_view text);

}  // namespace cordillera::pipeline::faces
