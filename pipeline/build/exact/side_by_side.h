#pragma once
// How much of a build goes on at once, by threads and memory. No tile depends on it.
#include <cstddef>
#include <cstdint>

#include "cordillera.pb.h"

namespace cordillera::pipeline {

/// Bytes for blocks, of what a build may use; memory_mib: 0, as much as there is.
double memory_for_blocks(std::uint32_t memory_mib);

/// Samples of a whole block.
double samples_of_block(const proto::Plan& plan);

/// How many exact blocks are simplified side by side, up to `most`: the more, the smaller they are.
std::size_t exact_at_once(const proto::Plan& plan, unsigned threads, std::uint32_t memory_mib, std::size_t most);

/// How many exact blocks are read for a GPU before it has room for them.
std::size_t exact_ahead(const proto::Plan& plan, std::uint32_t memory_mib);

/// How many regions of a level above the blocks are made side by side.
std::size_t regions_at_once(unsigned threads, std::uint32_t memory_mib);

/// Bytes for pixels that were read lately, of so many blocks on their way.
std::size_t memory_for_pixels(const proto::Plan& plan, std::size_t blocks, std::uint32_t memory_mib);

}  // namespace cordillera::pipeline
