#pragma once
// Colours of values: stops with straight lines between them, by name or as a request spells them.
#include <array>
#include <cstdint>
#include <span>
#include <string_view>
#include <vector>

#include "pipeline/encode/json.h"
#include "proto/result.h"

namespace cordillera::pipeline::faces {

using Rgb = std::array<std::uint8_t, 3>;

struct RampStop {
  double value = 0;  ///< metres above the geoid, or degrees
  Rgb rgb{};
};
/// Two stops at least, values strictly increasing.
using Ramp = std::vector<RampStop>;

/// Straight lines between stops, each channel rounded; the first and the last colour beyond them. value must be a number.
Rgb colour_at(const Ramp& ramp, double value);

/// Stops whose values are shares, 0 to 1, brought to low .. high.
Ramp stretched(std::span<const RampStop> shares, double low, double high);

inline constexpr std::size_t kMostStops = 32;
/// Stops as a query has them, "0:2b83ba,1500:ffffff": value and colour, 2 to kMostStops of them, values increasing. A problem
/// about ramp= that names `accepted` where it is something else.
proto::Result<Ramp> ramp_stops(std::string_view text, std::string_view accepted);

/// [[value, "#rrggbb"], …]
Json ramp_json(const Ramp& ramp);

}  // namespace cordillera::pipeline::faces
