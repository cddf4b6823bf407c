#include "raster/place/pixel_places.h"

#include <algorithm>
#include <cmath>

namespace cordillera::raster {
namespace {

constexpr double kAllowed_cells = 1e-3 / 16;

double stepped(double cells) {
  constexpr double kShift = 0x1.8p32;  // rounds to multiples of 2^-20; columns are fewer than 2^31
  return cells + kShift - kShift;
}

}  // namespace

PixelPlaces::PixelPlaces(const Placement& placement, const proto::Lattice& lattice, std::int64_t first, std::int32_t columns,
                         patch::KnownPatches& known)
    : placement_(placement), lattice_(lattice), first_(first), columns_(columns), known_(known) {}

void PixelPlaces::to_lattice(double* x, double* y, std::size_t count) const {
  placement_.to_degrees_on_map(x, y, count);
  const double columns = static_cast<double>(lattice_.columns()), rows = static_cast<double>(lattice_.rows());
  for (std::size_t k = 0; k < count; ++k) {
    x[k] = (x[k] + 180) * columns / 360;
    y[k] = std::abs(y[k]) <= 90 ? (y[k] + 90) * rows / 180 : NAN;
  }
}

void PixelPlaces::exact(std::int64_t i, std::int64_t j, std::int32_t count, double* x, double* y) const {
  for (std::int32_t c = 0; c < count; ++c) x[c] = static_cast<double>(i + c) + 0.5;
  std::fill(y, y + count, static_cast<double>(j) + 0.5);
  to_lattice(x, y, static_cast<std::size_t>(count));
}

patch::Patch PixelPlaces::make(std::int64_t column, std::int64_t row) const {
  std::vector<double> x, y;
  patch::each_place([&](int c, int r) {
    x.push_back(static_cast<double>(patch::kCells * column + c) + 0.5);
    y.push_back(static_cast<double>(patch::kCells * row + r) + 0.5);
  });
  to_lattice(x.data(), y.data(), x.size());
  return {x, y, kAllowed_cells};
}

void PixelPlaces::row(std::int64_t j, double* x, double* y) {
  if (placement_.straight_plate()) {
    if (line_x_.empty()) line_x_.resize(static_cast<std::size_t>(columns_)), exact(first_, j, columns_, line_x_.data(), y);
    double any_x = 0;
    exact(first_, j, 1, &any_x, y);
    std::ranges::copy(line_x_, x);
    std::fill(y + 1, y + columns_, y[0]);
  } else if (placement_.plate()) {
    exact(first_, j, columns_, x, y);  // two multiplications
  } else {
    const std::int64_t row = j / patch::kCells, first = first_ / patch::kCells;
    if (row != band_row_) {
      band_row_ = row;
      band_.clear();
      const auto from_nodes = [this](std::int64_t c, std::int64_t r) { return make(c, r); };
      for (std::int64_t column = first; column <= (first_ + columns_ - 1) / patch::kCells; ++column)
        band_.push_back(known_.at(lattice_.finest_level, column, row, from_nodes));
    }
    for (std::int32_t c = 0; c < columns_;) {
      const std::int64_t i = first_ + c;
      const auto within = static_cast<std::int32_t>(i % patch::kCells);
      const std::int32_t count = std::min(patch::kCells - within, columns_ - c);
      const patch::Patch& here = band_[static_cast<std::size_t>(i / patch::kCells - first)];
      if (here.smooth) {
        here.places(static_cast<int>(j % patch::kCells), within, count, x + c, y + c);
      } else {
        exact(i, j, count, x + c, y + c);
      }
      c += count;
    }
  }
  for (std::int32_t c = 0; c < columns_; ++c) x[c] = stepped(x[c]), y[c] = stepped(y[c]);
}

}  // namespace cordillera::raster
