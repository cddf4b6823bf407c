#include "pipeline/plan/relief.h"

#include <algorithm>
#include <limits>

#include "pipeline/plan/sample_places.h"

namespace cordillera::pipeline {

void see_heights(raster::Source& source, proto::Plan& plan) {
  std::int32_t low = std::numeric_limits<std::int32_t>::max(), high = std::numeric_limits<std::int32_t>::min();
  for (const proto::Samples& place : sample_places(plan, source)) {
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
