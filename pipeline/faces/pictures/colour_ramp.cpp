#include "pipeline/faces/pictures/colour_ramp.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "proto/letters.h"
#include "proto/numbers.h"
#include "proto/parts.h"

namespace cordillera::pipeline::faces {
namespace {

constexpr std::size_t kColourDigits = 6;

std::optional<Rgb> colour(std::string_view text) {
  const auto value = proto::number<std::uint32_t>(text, 16);
  if (!value || text.size() != kColourDigits) return std::nullopt;
  return Rgb{static_cast<std::uint8_t>(*value >> 16), static_cast<std::uint8_t>(*value >> 8), static_cast<std::uint8_t>(*value)};
}

std::optional<RampStop> stop(std::string_view text) {
  const std::size_t colon = text.find(':');
  if (colon == text.npos) return std::nullopt;
  const auto value = proto::number<double>(text.substr(0, colon));
  const auto rgb = colour(text.substr(colon + 1));
  return value && std::isfinite(*value) && rgb ? std::optional(RampStop{*value, *rgb}) : std::nullopt;
}

proto::Problem refused(std::string_view text, std::string_view accepted) {
  const bool printable = std::all_of(text.begin(), text.end(), [](char c) { return c > ' ' && c < 127; });
  return {"option-invalid",
          "ramp=" + (printable ? std::string(text.substr(0, 80)) : "(not plain text)") +
              " is neither the name of a ramp nor a list of stops with increasing values",
          std::string(accepted), "ramp"};
}

}  // namespace

Rgb colour_at(const Ramp& ramp, double value) {
  const auto above = std::upper_bound(ramp.begin(), ramp.end(), value, [](double v, const RampStop& s) { return v < s.value; });
  if (above == ramp.begin()) return ramp.front().rgb;
  if (above == ramp.end()) return ramp.back().rgb;
  const RampStop &a = above[-1], &b = *above;
  const double share = (value - a.value) / (b.value - a.value);
  Rgb out{};
  for (std::size_t k = 0; k < out.size(); ++k)
    out[k] = static_cast<std::uint8_t>(std::nearbyint(a.rgb[k] + share * (b.rgb[k] - a.rgb[k])));
  return out;
}

Ramp stretched(std::span<const RampStop> shares, double low, double high) {
  Ramp out(shares.begin(), shares.end());
  for (RampStop& stop : out) stop.value = low + stop.value * (high - low);
  return out;
}

proto::Result<Ramp> ramp_stops(std::string_view text, std::string_view accepted) {
  Ramp ramp;
  const bool wrong = proto::each_part(text, ',', [&](std::string_view part) {
    const auto next = stop(part);
    if (!next || ramp.size() == kMostStops || (!ramp.empty() && next->value <= ramp.back().value)) return true;
    ramp.push_back(*next);
    return false;
  });
  if (wrong || ramp.size() < 2) return refused(text, accepted);
  return ramp;
}

Json ramp_json(const Ramp& ramp) {
  Json out = Json::array();
  for (const RampStop& stop : ramp)
    out.push_back({std::round(stop.value * 100) / 100, std::string("#").append(proto::hex(stop.rgb))});
  return out;
}

}  // namespace cordillera::pipeline::faces
