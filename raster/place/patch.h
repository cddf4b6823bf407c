#pragma once
// Places interpolated in patches of 64 x 64 steps: polynomials of degree four through 5 x 5 exact nodes. lattice_places.h says
// why that is near enough.
#include <array>
#include <cstddef>
#include <cstdint>
#include <map>
#include <span>
#include <tuple>

namespace cordillera::raster::patch {

inline constexpr int kCells = 64, kDegree = 4, kNodes = kDegree + 1, kStride = kCells / kDegree;

/// What each of the five nodes counts for at a step, by the step's distance from the patch's first node.
using Weights = std::array<double, kNodes>;
constexpr Weights weights_at(int cells) {
  Weights weights{};
  for (int k = 0; k <= kDegree; ++k) {
    double above = 1, below = 1;  // whole numbers below 2^53
    for (int m = 0; m <= kDegree; ++m) {
      if (m == k) continue;
      above *= cells - kStride * m;
      below *= kStride * (k - m);
    }
    weights[static_cast<std::size_t>(k)] = above / below;
  }
  return weights;
}
inline constexpr std::array<Weights, kCells> kWeights = [] {
  std::array<Weights, kCells> all{};
  for (int cells = 0; cells < kCells; ++cells) all[static_cast<std::size_t>(cells)] = weights_at(cells);
  return all;
}();

inline double weighted(const Weights& w, std::span<const double, kNodes> at) {
  return w[0] * at[0] + w[1] * at[1] + w[2] * at[2] + w[3] * at[3] + w[4] * at[4];
}

using Nodes = std::array<std::array<double, kNodes>, kNodes>;  ///< [row][column]

/// The polynomial along one row of steps: the nodes' columns, each taken to that row.
inline std::array<double, kNodes> along_row(const Nodes& nodes, const Weights& row) {
  std::array<double, kNodes> line{};
  for (std::size_t k = 0; k < kNodes; ++k)
    line[k] = row[0] * nodes[0][k] + row[1] * nodes[1][k] + row[2] * nodes[2][k] + row[3] * nodes[3][k] + row[4] * nodes[4][k];
  return line;
}

/// x and y at the nodes of a patch.
struct Patch {
  bool smooth = false;  ///< the polynomials are near enough everywhere
  Nodes x{}, y{};
  /// Places of count steps of a row, from step `first` on.
  void places(int row, int first, int count, double* to_x, double* to_y) const;
  /// From the places of 5 x 5 nodes and then of 4 x 4 points half way between them, by rows.
  Patch(std::span<const double> all_x, std::span<const double> all_y, double allowed);
};

/// Patches that were asked for lately: neighbouring windows share them. Of one placement, and not thread-safe.
class KnownPatches {
 public:
  template <class Make>
  const Patch& at(int level, std::int64_t column, std::int64_t row, const Make& make) {
    const auto key = std::tuple(level, column, row);
    auto found = known_.find(key);
    if (found != known_.end()) return found->second;
    if (known_.size() >= kMost) known_.clear();
    return known_.emplace(key, make(column, row)).first->second;
  }

 private:
  static constexpr std::size_t kMost = 2048;  // 0.9 MB
  std::map<std::tuple<int, std::int64_t, std::int64_t>, Patch> known_;
};

/// For every place to be asked about, column and row in steps from the patch's first node, in the order that Patch() wants.
template <class Ask>
void each_place(const Ask& ask) {
  for (int r = 0; r < kNodes; ++r)
    for (int c = 0; c < kNodes; ++c) ask(kStride * c, kStride * r);
  for (int r = 0; r < kDegree; ++r)
    for (int c = 0; c < kDegree; ++c) ask(kStride / 2 + kStride * c, kStride / 2 + kStride * r);
}

}  // namespace cordillera::raster::patch
