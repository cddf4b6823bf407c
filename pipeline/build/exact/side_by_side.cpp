#include "pipeline/build/exact/side_by_side.h"

#include <algorithm>

#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/plan.h"

namespace cordillera::pipeline {

double samples_of_block(const proto::Plan& plan) {
  const double units = static_cast<double>(block_side(plan));
  return std::min(units, static_cast<double>(plan.window(2)) - plan.window(0)) *
             std::min(units, static_cast<double>(plan.window(3)) - plan.window(1)) +
         1;
}

double memory_for_blocks(std::uint32_t memory_mib) {
  constexpr double kUsualMemory = 4e9;
  return memory_mib > 0 ? 0.75 * memory_mib * (1 << 20) : kUsualMemory;
}

std::size_t exact_at_once(const proto::Plan& plan, unsigned threads, std::uint32_t memory_mib, std::size_t most) {
  if (threads <= 1) return 1;
  constexpr double kBytesOfSample = 200;        // measured: 57 on ground of which 30 % are vertices at first, 190 where 82 % are
  constexpr double kSamplesOfThread = 1 << 20;  // so many, and a thread seldom waits
  const double samples = samples_of_block(plan);
  const double by_memory = memory_for_blocks(memory_mib) / (kBytesOfSample * samples);
  const double by_threads = 2 + threads / std::max(1.0, samples / kSamplesOfThread);
  return std::clamp(static_cast<std::size_t>(std::min(by_memory, by_threads)), std::size_t{1}, most);
}

std::size_t exact_ahead(const proto::Plan& plan, std::uint32_t memory_mib) {
  constexpr double kMost = 16, kShare = 0.1, kBytesOfSample = 8;  // as it is read
  const double by_memory = kShare * memory_for_blocks(memory_mib) / (kBytesOfSample * samples_of_block(plan));
  return static_cast<std::size_t>(std::min(by_memory, kMost));
}

std::size_t regions_at_once(unsigned threads, std::uint32_t memory_mib) {
  constexpr double kBytesOfRegion = 0.8e9, kBytesBeside = 0.8e9, kMost = 4;
  const double by_threads = (threads + 3.0) / 4, by_memory = (memory_for_blocks(memory_mib) - kBytesBeside) / kBytesOfRegion;
  return static_cast<std::size_t>(std::clamp(std::min(by_threads, by_memory), 1.0, kMost));
}

std::size_t memory_for_pixels(const proto::Plan& plan, std::size_t blocks, std::uint32_t memory_mib) {
  constexpr double kShare = 1.0 / 16, kBytesOfSample = 16;  // as many pixels as samples, and twice those that strips share
  return static_cast<std::size_t>(
      std::min(kShare * memory_for_blocks(memory_mib), static_cast<double>(blocks) * kBytesOfSample * samples_of_block(plan)));
}

}  // namespace cordillera::pipeline
