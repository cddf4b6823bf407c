#include "pipeline/store/pixel_error_sum.h"

#include <algorithm>
#include <bit>
#include <cmath>

namespace cordillera::pipeline {
namespace {

constexpr std::uint64_t kFirstStep =
    std::bit_cast<std::uint64_t>(0x1p-10) >> 48;  // sign, exponent and four bits behind the point

/// What all errors of a step are below.
double end_of(std::size_t step) { return std::bit_cast<double>((kFirstStep + step) << 48); }

}  // namespace

std::uint32_t pixel_error_step(double error_m) {
  const std::uint64_t bits = std::bit_cast<std::uint64_t>(error_m) >> 48;
  return bits < kFirstStep ? 0 : static_cast<std::uint32_t>(bits - kFirstStep + 1);
}

void PixelErrorSum::add(const proto::PixelErrors& tile) {
  max_ = std::max(max_, tile.max());
  sum_squared_ += tile.sum_squared();
  pixels_ += tile.pixels();
  uncovered_ += tile.uncovered();
  for (int k = 0; k < tile.counts_size(); ++k)
    counts_[std::min<std::size_t>(tile.first() + static_cast<std::size_t>(k), kSteps - 1)] += tile.counts(k);
}

double PixelErrorSum::beyond(double limit_m) const {
  double pixels = 0;
  for (std::size_t step = pixel_error_step(limit_m) + std::size_t{1}; step < kSteps; ++step) pixels += counts_[step];
  return pixels;
}

proto::ErrorAtPixels PixelErrorSum::total() const {
  proto::ErrorAtPixels out;
  out.set_max(max_);
  out.set_rmse(pixels_ > 0 ? std::sqrt(sum_squared_ / pixels_) : 0);
  out.set_pixels(pixels_);
  out.set_uncovered(uncovered_);
  double farther = pixels_;
  std::size_t step = 0;
  while (step + 1 < kSteps && (farther -= counts_[step]) > pixels_ / 100) ++step;
  out.set_p99(std::min(max_, end_of(step)));
  return out;
}

}  // namespace cordillera::pipeline
