#include "pipeline/plan/relief.h"

#include <algorithm>
#include <limits>

#include "pipeline/plan/sample_places.h"

namespace cordillera::pipeline {

double relief_m(const proto::Plan& plan, raster::Source& source) {
  const proto::Lattice lattice = lattice_of(plan);
  const std::vector<proto::TileAddress> nodes = filled_nodes(plan, source, lattice.finest_level);
  const std::size_t places = count_at(nodes, lattice.finest_level);  // more than nodes, where these are coarser
  std::int32_t low = std::numeric_limits<std::int32_t>::max(), high = std::numeric_limits<std::int32_t>::min();
  for (std::size_t k = 0; k < std::min(kReliefPlaces, places); ++k) {
    const std::size_t place = places <= kReliefPlaces ? k : spread_place(k, places);
    const raster::Source::Window w = node_window(plan, node_at(nodes, place, lattice.finest_level));
    if (w.west > w.east || w.south > w.north) continue;
    const auto samples = source.sample(lattice, w.west, w.south, static_cast<std::int32_t>(w.east - w.west + 1), static_cast<std::int32_t>(w.north - w.south + 1));
    if (!samples.ok()) continue;
    for (const std::int32_t h : samples->height) {
      if (h == proto::kNoHeight) continue;
      low = std::min(low, h);
      high = std::max(high, h);
    }
  }
  return low > high ? 0 : (static_cast<double>(high) - low) * proto::kHeightStep_m;
}

}  // namespace cordillera::pipeline
