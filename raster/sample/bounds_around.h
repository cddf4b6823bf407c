#pragma once
// Between which heights the samples around a sample lie.
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "proto/mesh.h"

namespace cordillera::raster {

/// Samples so many columns and rows away are around a sample.
inline constexpr std::int32_t kBoundsReach = 2;

/// Of all samples of a window, as they are when they are asked for first: so no height of the window may change before the last
/// one is. What is asked for costs its piece of a row, since neighbours are asked for together. Borrows the samples.
class BoundsAround {
 public:
  struct Bounds {
    double least_m, greatest_m;
    void add(double height_m) {
      least_m = height_m < least_m ? height_m : least_m;
      greatest_m = height_m > greatest_m ? height_m : greatest_m;
    }
  };

  explicit BoundsAround(const proto::Samples& samples);

  /// sample: row by row, as in proto::Samples; one that has a height. What is added to its bounds stays there.
  Bounds& at(std::uint32_t sample) {
    const std::size_t piece = sample / kPiece;
    if (!known_[piece]) find(piece);
    return bounds_[sample];
  }

 private:
  static constexpr std::size_t kPiece = 64;  ///< samples

  void find(std::size_t piece);

  const proto::Samples& samples_;
  std::unique_ptr<Bounds[]> bounds_;  ///< indexed by sample
  std::vector<std::uint8_t> known_;   ///< indexed by piece
};

}  // namespace cordillera::raster
