#include "raster/lattice_places.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "raster/raster_source.h"

namespace cordillera::raster {
namespace {

constexpr int kPatchCells = 64, kDegree = 4, kStride = kPatchCells / kDegree;
constexpr double kAllowed_px = kPlaceError_px / 16;

/// What each of the five nodes counts for at a vertex, by its distance from the patch's first node in cells.
using Weights = std::array<double, kDegree + 1>;
constexpr Weights weights_at(int cells) {
  Weights weights{};
  for (int k = 0; k <= kDegree; ++k) {
    double above = 1, below = 1;  // whole numbers below 2^53
    for (int m = 0; m <= kDegree; ++m) {
      if (m == k) continue;
      above *= cells - kStride * m;
      below *= kStride * (k - m);
    }
    weights[k] = above / below;
  }
  return weights;
}
constexpr std::array<Weights, kPatchCells> kWeights = [] {
  std::array<Weights, kPatchCells> all{};
  for (int cells = 0; cells < kPatchCells; ++cells) all[cells] = weights_at(cells);
  return all;
}();

double weighted(const Weights& w, std::span<const double, kDegree + 1> at) {
  return w[0] * at[0] + w[1] * at[1] + w[2] * at[2] + w[3] * at[3] + w[4] * at[4];
}

/// The polynomial along one row of vertices: the nodes' columns, each taken to that row.
template <class Nodes>
std::array<double, kDegree + 1> along_row(const Nodes& nodes, const Weights& row) {
  std::array<double, kDegree + 1> line{};
  for (int k = 0; k <= kDegree; ++k)
    line[k] = row[0] * nodes[0][k] + row[1] * nodes[1][k] + row[2] * nodes[2][k] + row[3] * nodes[3][k] + row[4] * nodes[4][k];
  return line;
}

}  // namespace

LatticePlaces::LatticePlaces(const Placement& placement, const proto::Lattice& lattice, std::int64_t west, std::int32_t columns)
    : placement_(placement), lattice_(lattice), west_(modulo(west, lattice.columns())), columns_(columns) {}

void LatticePlaces::exact(std::int64_t i, std::int64_t j, std::int32_t count, double* x, double* y) const {
  for (std::int32_t c = 0; c < count; ++c) x[c] = lattice_.longitude_deg(modulo(i + c, lattice_.columns()));
  std::fill(y, y + count, lattice_.latitude_deg(j));
  placement_.to_pixels(x, y, static_cast<std::size_t>(count));
}

LatticePlaces::Patch LatticePlaces::make(std::int64_t column, std::int64_t row) const {
  std::vector<double> x, y;
  const auto ask = [&](int first, int count) {
    for (int r = 0; r < count; ++r) {
      for (int c = 0; c < count; ++c) {
        x.push_back(lattice_.longitude_deg(kPatchCells * column + first + kStride * c));
        y.push_back(lattice_.latitude_deg(kPatchCells * row + first + kStride * r));
      }
    }
  };
  ask(0, kNodes);
  ask(kStride / 2, kDegree);
  placement_.to_pixels(x.data(), y.data(), x.size());
  Patch patch;
  for (int n = 0; n < kNodes * kNodes; ++n) {
    patch.x[n / kNodes][n % kNodes] = x[n];
    patch.y[n / kNodes][n % kNodes] = y[n];
  }
  patch.smooth = true;
  for (int n = 0; n < kDegree * kDegree; ++n) {
    const Weights &along = kWeights[kStride / 2 + kStride * (n % kDegree)], &up = kWeights[kStride / 2 + kStride * (n / kDegree)];
    const double off_x = weighted(along, along_row(patch.x, up)) - x[kNodes * kNodes + n];
    const double off_y = weighted(along, along_row(patch.y, up)) - y[kNodes * kNodes + n];
    patch.smooth = patch.smooth && std::abs(off_x) <= kAllowed_px && std::abs(off_y) <= kAllowed_px;  // false for NaN, too
  }
  return patch;
}

void LatticePlaces::row(std::int64_t j, double* x, double* y) {
  if (placement_.plate()) return exact(west_, j, columns_, x, y);  // two multiplications
  const std::int64_t row = std::min(j, lattice_.rows() - 1) / kPatchCells;
  const std::int64_t first = west_ / kPatchCells, around = lattice_.columns() / kPatchCells;
  if (row != band_row_) {
    band_row_ = row;
    band_.clear();
    const std::int64_t last = (west_ + columns_ - 1) / kPatchCells;
    for (std::int64_t column = first; column <= last; ++column) band_.push_back(make(column % around, row));
  }
  const Weights& up = kWeights[j - kPatchCells * row];
  for (std::int32_t c = 0; c < columns_;) {
    const std::int64_t i = west_ + c;
    const auto within = static_cast<std::int32_t>(i % kPatchCells);
    const std::int32_t count = std::min(kPatchCells - within, columns_ - c);
    const Patch& patch = band_[static_cast<std::size_t>(i / kPatchCells - first)];
    if (patch.smooth) {
      const auto line_x = along_row(patch.x, up), line_y = along_row(patch.y, up);
      for (std::int32_t k = 0; k < count; ++k) {
        x[c + k] = weighted(kWeights[within + k], line_x);
        y[c + k] = weighted(kWeights[within + k], line_y);
      }
    } else {
      exact(i, j, count, x + c, y + c);
    }
    c += count;
  }
}

}  // namespace cordillera::raster
