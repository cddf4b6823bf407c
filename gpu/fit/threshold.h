#pragma once
// The class of cost up to which a wanted number of vertices lies: a histogram, no sort.
#include <algorithm>

#include "gpu/fit/wave_view.h"

namespace cordillera::gpu::fit {

template <class Device>
class Threshold {
 public:
  explicit Threshold(Device& device) : device_(device) {}

  std::uint32_t of_share(const WaveView& wave, std::size_t vertices, double share) {
    const std::uint64_t all = count(wave, vertices);
    return class_of(std::max<std::uint64_t>(static_cast<std::uint64_t>(share * static_cast<double>(all)), kFewest));
  }
  std::uint32_t of_count(const WaveView& wave, std::size_t vertices, std::uint64_t wanted) {
    count(wave, vertices);
    return class_of(std::max<std::uint64_t>(wanted, 1));
  }

 private:
  static constexpr std::uint64_t kFewest = 32;

  std::uint64_t count(const WaveView& wave, std::size_t vertices) {
    bins_.reserve(kCostClasses);
    device_.zero(bins_.data(), kCostClasses);
    device_.each(vertices, CountClass{wave, bins_.data()});
    device_.copy_out(counts_, bins_.data(), kCostClasses);
    std::uint64_t all = 0;
    for (const std::uint32_t n : counts_) all += n;
    return all;
  }
  std::uint32_t class_of(std::uint64_t wanted) const {
    std::uint64_t below = 0;
    for (std::uint32_t k = 0; k < kCostClasses; ++k) {
      below += counts_[k];
      if (below >= wanted) return k;
    }
    return kCostClasses;
  }

  Device& device_;
  std::uint32_t counts_[kCostClasses];
  typename Device::template Array<std::uint32_t> bins_;
};

}  // namespace cordillera::gpu::fit
