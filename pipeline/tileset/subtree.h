#pragma once
// Binary subtree files of the implicit tilesets: availability in Morton order, a region and a geometric error for every tile.
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>

#include "pipeline/store/store.h"

namespace cordillera::pipeline {

/// Levels a subtree file describes; subtree roots stand at multiples of it.
inline constexpr int kSubtreeLevels = 5;

/// Where the bits of a subtree's level begin: availability has one level after the other.
constexpr std::size_t first_of_level(int depth) { return ((std::size_t{1} << (2 * depth)) - 1) / 3; }

/// The place of a tile in its level: bits of x and y by turns, x lowest.
constexpr std::uint32_t morton(std::uint32_t x, std::uint32_t y) {
  std::uint32_t out = 0;
  for (int bit = 0; bit < kSubtreeLevels; ++bit) out |= ((x >> bit & 1) << (2 * bit)) | ((y >> bit & 1) << (2 * bit + 1));
  return out;
}

/// The subtree whose root stands at (level, x, y) of the implicit tileset; hemisphere is 'W' or 'E'. None when the place is no
/// subtree root (level is not a multiple of kSubtreeLevels) or there is nothing at or below it.
std::optional<std::string> subtree(const StoreReader& store, char hemisphere, int level, std::int32_t x, std::int32_t y);

}  // namespace cordillera::pipeline
