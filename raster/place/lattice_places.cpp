#include "raster/place/lattice_places.h"

#include <algorithm>

#include "proto/integers.h"

namespace cordillera::raster {
namespace {

constexpr double kAllowed_px = kPlaceError_px / 16;

using proto::modulo;

}  // namespace

LatticePlaces::LatticePlaces(const Placement& placement, const proto::Lattice& lattice, std::int64_t west, std::int32_t columns,
                             patch::KnownPatches& known)
    : placement_(placement), lattice_(lattice), west_(modulo(west, lattice.columns())), columns_(columns), known_(known) {}

void LatticePlaces::exact(std::int64_t i, std::int64_t j, std::int32_t count, double* x, double* y) const {
  for (std::int32_t c = 0; c < count; ++c) x[c] = lattice_.longitude_deg(modulo(i + c, lattice_.columns()));
  std::fill(y, y + count, lattice_.latitude_deg(j));
  placement_.to_pixels(x, y, static_cast<std::size_t>(count));
}

LatticePlaces::Patch LatticePlaces::make(std::int64_t column, std::int64_t row) const {
  std::vector<double> x, y;
  patch::each_place([&](int c, int r) {
    x.push_back(lattice_.longitude_deg(patch::kCells * column + c));
    y.push_back(lattice_.latitude_deg(patch::kCells * row + r));
  });
  placement_.to_pixels(x.data(), y.data(), x.size());
  return {x, y, kAllowed_px};
}

void LatticePlaces::row(std::int64_t j, double* x, double* y) {
  if (placement_.straight_plate()) {
    if (line_x_.empty()) line_x_.resize(static_cast<std::size_t>(columns_)), exact(west_, j, columns_, line_x_.data(), y);
    double any_x = 0;
    exact(west_, j, 1, &any_x, y);
    std::ranges::copy(line_x_, x);
    return std::fill(y + 1, y + columns_, y[0]);
  }
  if (placement_.plate()) return exact(west_, j, columns_, x, y);  // two multiplications
  const std::int64_t row = std::min(j, lattice_.rows() - 1) / patch::kCells;
  const std::int64_t first = west_ / patch::kCells, around = lattice_.columns() / patch::kCells;
  if (row != band_row_) {
    band_row_ = row;
    band_.clear();
    const std::int64_t last = (west_ + columns_ - 1) / patch::kCells;
    const auto from_nodes = [this](std::int64_t c, std::int64_t r) { return make(c, r); };
    for (std::int64_t column = first; column <= last; ++column)
      band_.push_back(known_.at(lattice_.finest_level, column % around, row, from_nodes));
  }
  for (std::int32_t c = 0; c < columns_;) {
    const std::int64_t i = west_ + c;
    const auto within = static_cast<std::int32_t>(i % patch::kCells);
    const std::int32_t count = std::min(patch::kCells - within, columns_ - c);
    const Patch& here = band_[static_cast<std::size_t>(i / patch::kCells - first)];
    if (here.smooth) {
      here.places(static_cast<int>(j - patch::kCells * row), within, count, x + c, y + c);
    } else {
      exact(i, j, count, x + c, y + c);
    }
    c += count;
  }
}

}  // namespace cordillera::raster
