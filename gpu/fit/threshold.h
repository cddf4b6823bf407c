#pragma once
// The class of cost up to which a wanted number of vertices lies: a histogram, no sort.
#include "gpu/fit/steps/progress.h"

namespace cordillera::gpu::fit {

/// Those that a wave looks at: a share of the vertices that can go at all, or so many. Nobody once waves have halted.
struct FindLimit {
  CostBins bins;
  double share;
  std::uint32_t fewest;
  Progress* progress;

  template <class Team>
  CORDILLERA_HD void operator()(Team& team, std::size_t) const {
    const auto wanted = [&](std::uint32_t all) {
      const auto some = static_cast<std::uint32_t>((progress->all ? 1 : share) * all);
      return some > fewest ? some : fewest;
    };
    bins.find(team, wanted, [&](std::uint32_t limit) { progress->limit = progress->halt == Halt::none ? limit : 0; });
  }
};

template <class Device>
class Threshold {
 public:
  explicit Threshold(Device& device) : device_(device) {}

  /// Where later steps find the class; overwritten by the next call.
  Count of_share(const WaveView& wave, std::size_t vertices, double share, Progress* progress) {
    return find(wave, vertices, share, kFewest, progress);
  }
  Count of_count(const WaveView& wave, std::size_t vertices, std::uint32_t wanted, Progress* progress) {
    return find(wave, vertices, 0, wanted, progress);
  }

 private:
  static constexpr std::uint32_t kFewest = 32;

  Count find(const WaveView& wave, std::size_t vertices, double share, std::uint32_t fewest, Progress* progress) {
    if (!bins_.data()) {
      bins_.reserve(kCostClasses);
      sums_.reserve(CostBins::kParts);
      device_.zero(bins_.data(), kCostClasses);
    }
    device_.histogram(vertices, ClassOfCost{wave}, bins_.data(), kCostClasses);
    device_.each_block(1, FindLimit{{bins_.data(), sums_.data()}, share, fewest, progress});
    return {kCostClasses, &progress->limit};
  }

  Device& device_;
  typename Device::template Array<std::uint32_t> bins_, sums_;
};

}  // namespace cordillera::gpu::fit
