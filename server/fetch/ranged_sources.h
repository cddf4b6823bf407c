#pragma once
// The rasters of a dataset that are fetched as they are read: the one at its address, or those that the list there names.
#include <chrono>
#include <cstddef>
#include <functional>
#include <list>
#include <memory>
#include <span>
#include <utility>
#include <vector>

#include "server/fetch/ranged_source.h"

namespace cordillera::server::updates {

/// One thread's.
class RangedSources {
 public:
  using Open = std::function<proto::Result<std::unique_ptr<RangedSource>>(RangedSource::Place, HttpTalk&)>;
  using Clock = std::chrono::steady_clock;
  /// How long was waited for all of them together: told after each request.
  using Waited = std::function<void(Clock::duration)>;
  /// open: RangedSource::open within what the operator allows. places: by the numbers that a job has for them.
  RangedSources(Open open, std::vector<RangedSource::Place> places, Waited waited)
      : open_(std::move(open)), places_(std::move(places)), tell_waited_(std::move(waited)) {}

  /// RangedSource::have of one of them. Whoever asks is not trusted.
  proto::Result<void> have(std::uint64_t number, std::span<const raster::ByteRange> ranges, const std::function<bool()>& stopped);
  /// RangedSource::note.
  void note();

 private:
  static constexpr std::size_t kMostOpen = 16;  ///< each has two descriptors
  const Open open_;
  const std::vector<RangedSource::Place> places_;
  const Waited tell_waited_;
  Clock::duration waited_{0};
  HttpTalk talk_;                                                              ///< most rasters of a list have one host
  std::list<std::pair<std::uint64_t, std::unique_ptr<RangedSource>>> opened_;  ///< the last used first
};

}  // namespace cordillera::server::updates
