#pragma once
// Quarters of regions, and which of them are a region of a level: see build/regions_above.h.
#include <algorithm>
#include <array>
#include <cstdint>
#include <utility>
#include <vector>

#include "pipeline/build/exact/exact_above.h"
#include "pipeline/plan/block_grid.h"
#include "proto/integers.h"

namespace cordillera::pipeline {

/// Which quarters; columns of a grid that closes are modulo the circle.
struct Region {
  std::int64_t column = 0, row = 0;
  std::int32_t across = 0, up = 0;  ///< 1 or 2 each
};

/// All quarters that the blocks of a plan lie in.
class QuarterGrid {
 public:
  QuarterGrid(const proto::Plan& plan, std::int32_t side) : side_(side), closes_(grid_of(plan).closes) {
    const BlockPlace all = place_above(plan);
    west_ = proto::floor_divide(all.west, side), east_ = proto::floor_divide(all.east - 1, side) + 1;
    south_ = proto::floor_divide(all.south, side), north_ = proto::floor_divide(all.north - 1, side) + 1;
  }
  /// Of a level that is so many above the blocks, row by row.
  std::vector<Region> regions(std::size_t level) const {
    const auto shift = static_cast<std::int64_t>(level % 2);
    std::vector<Region> all;
    for (const auto& [row, up] : spans(south_, north_, shift, false)) {
      for (const auto& [column, across] : spans(west_, east_, shift, closes_)) all.push_back({column, row, across, up});
    }
    return all;
  }
  BlockPlace place_of(const Region& region) const {
    BlockPlace place;
    place.west = region.column * side_, place.east = place.west + std::int64_t{side_} * region.across;
    place.south = region.row * side_, place.north = place.south + std::int64_t{side_} * region.up;
    return place;
  }
  /// South, east, north, west.
  std::array<bool, 4> goes_on(const Region& region) const {
    return {region.row > south_, closes_ || region.column + region.across < east_, region.row + region.up < north_,
            closes_ || region.column > west_};
  }
  std::pair<std::int64_t, std::int64_t> key(std::int64_t column, std::int64_t row) const {
    return {row, closes_ ? proto::modulo(column, east_) : column};
  }
  std::int32_t side() const { return side_; }

 private:
  /// Pairs from multiples of two on, shifted. Around the circle they are whole; else the first and the last may be halves.
  static std::vector<std::pair<std::int64_t, std::int32_t>> spans(std::int64_t from, std::int64_t to, std::int64_t shift,
                                                                  bool around) {
    std::vector<std::pair<std::int64_t, std::int32_t>> all;
    if (around) {
      for (std::int64_t first = shift; first < to; first += 2) all.emplace_back(first, 2);
      return all;
    }
    for (std::int64_t first = proto::floor_divide(from - shift, 2) * 2 + shift; first < to; first += 2) {
      const std::int64_t begin = std::max(first, from);
      all.emplace_back(begin, static_cast<std::int32_t>(std::min(first + 2, to) - begin));
    }
    return all;
  }

  std::int32_t side_;
  bool closes_;
  std::int64_t west_ = 0, east_ = 0, south_ = 0, north_ = 0;
};

}  // namespace cordillera::pipeline
