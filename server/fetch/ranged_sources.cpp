#include "server/fetch/ranged_sources.h"

#include <algorithm>

namespace cordillera::server::updates {

proto::Result<void> RangedSources::have(std::uint64_t number, std::span<const raster::ByteRange> ranges,
                                        const std::function<bool()>& stopped) {
  if (number >= places_.size() || !places_[number].print.ranged)
    return proto::Problem{"internal", "a job asked for bytes of a raster that it has not, or has", "", ""};
  auto found = std::find_if(opened_.begin(), opened_.end(), [&](const auto& one) { return one.first == number; });
  if (found == opened_.end()) {
    auto source = open_(places_[number], talk_);
    if (!source) return source.problem();
    opened_.emplace_front(number, std::move(*source));
    if (opened_.size() > kMostOpen) opened_.pop_back();
  } else {
    opened_.splice(opened_.begin(), opened_, found);
  }
  Clock::time_point from = Clock::now();
  const auto came = [&] {
    const Clock::time_point now = Clock::now();
    waited_ += now - from;
    from = now;
    tell_waited_(waited_);
  };
  return opened_.front().second->have(ranges, stopped, came);
}

void RangedSources::note() {
  for (const auto& [number, source] : opened_) source->note();
}

}  // namespace cordillera::server::updates
