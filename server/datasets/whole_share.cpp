#include "server/datasets/whole_share.h"

#include <algorithm>
#include <string_view>

namespace cordillera::server {
namespace {

struct StageShare {
  std::string_view stage;
  double from, to;
};

// In the order in which they come. Blocks take most of the time of every build that anybody waits for; how long the others take
// beside them differs, so a build may go through some of them faster than its share says.
constexpr StageShare kStages[] = {{"fetch", 0, 0.05},   {"provisional", 0.05, 0.07}, {"open", 0.07, 0.08}, {"plan", 0.08, 0.1},
                                  {"build", 0.1, 0.85}, {"merge", 0.85, 0.97},       {"publish", 0.97, 1}};

}  // namespace

double whole_share(const proto::Progress& progress) {
  const double done = progress.total() > 0 ? std::clamp(progress.done() / progress.total(), 0.0, 1.0) : 0;
  for (const StageShare& span : kStages) {
    if (span.stage == progress.stage()) return span.from + (span.to - span.from) * done;
  }
  return 0;
}

}  // namespace cordillera::server
