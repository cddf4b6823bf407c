#include "raster/place/geodesic.h"

#include <GeographicLib/Geodesic.hpp>
#include <GeographicLib/GeodesicLine.hpp>

namespace cordillera::raster {
namespace {

struct Leg {
  GeographicLib::GeodesicLine line;
  double from_m = 0, to_m = 0;
};

std::vector<Leg> legs_of(std::span<const LinePoint> line) {
  std::vector<Leg> legs;
  double length_m = 0;
  for (std::size_t k = 1; k < line.size(); ++k) {
    const auto& a = line[k - 1];
    const auto& b = line[k];
    auto leg = GeographicLib::Geodesic::WGS84().InverseLine(a.latitude_deg, a.longitude_deg, b.latitude_deg, b.longitude_deg);
    const double to_m = length_m + leg.Distance();
    legs.push_back({leg, length_m, to_m});
    length_m = to_m;
  }
  return legs;
}

}  // namespace

std::vector<LinePoint> along_geodesics(std::span<const LinePoint> line, std::size_t samples) {
  const std::vector<Leg> legs = legs_of(line);
  std::vector<LinePoint> out(line.begin(), line.end());
  out.front().distance_m = 0;
  for (std::size_t k = 0; k < legs.size(); ++k) out[k + 1].distance_m = legs[k].to_m;
  if (samples == 0 || legs.empty()) return out;
  const LinePoint last = out.back();
  out.resize(1);
  std::size_t leg = 0;
  for (std::size_t k = 1; k + 1 < samples; ++k) {
    LinePoint at;
    at.distance_m = last.distance_m * static_cast<double>(k) / static_cast<double>(samples - 1);
    while (leg + 1 < legs.size() && at.distance_m > legs[leg].to_m) ++leg;
    legs[leg].line.Position(at.distance_m - legs[leg].from_m, at.latitude_deg, at.longitude_deg);
    out.push_back(at);
  }
  out.push_back(last);
  return out;
}

}  // namespace cordillera::raster
