#include "pipeline/plan/relief.h"

#include <algorithm>
#include <limits>

#include "pipeline/plan/sample_places.h"

namespace cordillera::pipeline {

double relief_m(const std::vector<proto::Samples>& places) {
  std::int32_t low = std::numeric_limits<std::int32_t>::max(), high = std::numeric_limits<std::int32_t>::min();
  for (const proto::Samples& place : places) {
    for (const std::int32_t h : place.height) {
      if (h == proto::kNoHeight) continue;
      low = std::min(low, h);
      high = std::max(high, h);
    }
  }
  return low > high ? 0 : (static_cast<double>(high) - low) * proto::kHeightStep_m;
}

}  // namespace cordillera::pipeline
