#include "pipeline/plan/relief.h"

#include <algorithm>
#include <limits>
#include <vector>

namespace cordillera::pipeline {

namespace {

struct Places {
  std::vector<double> longitude_deg, latitude_deg;
};

std::vector<std::size_t> flat_samples(const proto::Samples& samples) {
  std::vector<std::size_t> flat;
  for (std::size_t k = 0; k < samples.flat_water.size(); ++k) {
    if ((samples.flat_water[k] & proto::kFlatWater) != 0) flat.push_back(k);
  }
  return flat;
}

/// Of these, spread evenly, about so many at most.
Places places_of(const std::vector<std::size_t>& flat, const proto::Samples& samples, const proto::Lattice& lattice) {
  constexpr std::size_t kMost = 1024;
  Places places;
  const std::size_t step = std::max<std::size_t>(1, flat.size() / kMost);
  for (std::size_t k = 0; k < flat.size(); k += step) {
    const auto row = static_cast<std::int64_t>(flat[k]) / samples.columns,
               column = static_cast<std::int64_t>(flat[k]) % samples.columns;
    places.longitude_deg.push_back(lattice.longitude_deg(samples.west + column));
    places.latitude_deg.push_back(lattice.latitude_deg(samples.south + row));
  }
  return places;
}

/// The share of them that is exactly 0.
double share_of_zeros(const Places& places, raster::Source& source) {
  std::vector<double> value(places.longitude_deg.size());
  if (!source.nearest(places.longitude_deg, places.latitude_deg, value.data()).ok()) return 0;
  return static_cast<double>(std::count(value.begin(), value.end(), 0.0)) / static_cast<double>(value.size());
}

}  // namespace

bool may_have_sea(const proto::BuildOptions& options, const proto::Source& source) {
  return !options.has_water() && !options.no_water() && options.water_mask().empty() && source.vertical_datum() != "ellipsoid";
}

bool sees_sea(std::span<const proto::Samples> places, const proto::Lattice& lattice, raster::Source& source) {
  constexpr double kLeast = 0.01;
  double all = 0, sea = 0;
  for (const proto::Samples& place : places) {
    all += static_cast<double>(place.height.size());
    const std::vector<std::size_t> flat = flat_samples(place);
    if (!flat.empty()) sea += static_cast<double>(flat.size()) * share_of_zeros(places_of(flat, place, lattice), source);
  }
  return all > 0 && sea >= kLeast * all;
}

void see_heights(std::span<const proto::Samples> places, proto::Plan& plan) {
  std::int32_t low = std::numeric_limits<std::int32_t>::max(), high = std::numeric_limits<std::int32_t>::min();
  for (const proto::Samples& place : places) {
    for (const std::int32_t h : place.height) {
      if (h == proto::kNoHeight) continue;
      low = std::min(low, h);
      high = std::max(high, h);
    }
  }
  if (low > high) return;
  plan.add_seen_heights(low * proto::kHeightStep_m);
  plan.add_seen_heights(high * proto::kHeightStep_m);
}

std::optional<std::pair<double, double>> seen_heights_m(const proto::Plan& plan) {
  if (plan.seen_heights_size() != 2) return std::nullopt;
  return std::pair(plan.seen_heights(0), plan.seen_heights(1));
}

}  // namespace cordillera::pipeline
