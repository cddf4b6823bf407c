// Right-triangulated irregular networks: W. Evans, D. Kirkpatrick, G. Townsend, "Right-triangulated irregular networks",
// Algorithmica 30(2), 2001; dependencies as in P. Lindstrom et al., "Real-time, continuous level of detail rendering of height
// fields", 1996.
//
// Every vertex but the corners is the middle of one longest edge: the centre of a square, whose diagonal the edge is, or the
// middle of a square's side. It can be left out if nothing speaks for it and none of the vertices is there that would cut the
// halves of its triangles.
#include "tests/gpu/sparse_grid.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <stdexcept>

namespace cordillera::test {
namespace {

class Sparse {
 public:
  Sparse(const proto::TileMesh& grid, std::span<const float> elevation, float tolerance_m)
      : grid_(grid),
        elevation_(elevation),
        tolerance_m_(tolerance_m),
        cells_(grid.side),
        across_(cells_ + 1),
        stays_(grid.vertices()) {
    for (std::size_t v = 0; v < stays_.size(); ++v) stays_[v] = (grid.mark[v] & proto::kKeep) != 0 ? 1 : 0;
    for (const std::int32_t v : {0, cells_, cells_ * across_, cells_ * across_ + cells_}) stays_[static_cast<std::size_t>(v)] = 1;
  }

  SparseGrid run() {
    if (has_voids(grid_)) choose_rims();
    for (std::int32_t half = 1; half <= cells_ / 2; half *= 2) {
      for (std::int32_t y = 0; y <= cells_; y += half) choose_sides(half, y);
      for (std::int32_t y = half; y < cells_; y += 2 * half) choose_centres(half, y);
    }
    take_vertices();
    const std::int32_t sw = 0, se = cells_, nw = cells_ * across_, ne = nw + cells_;
    const int splits = 2 * (std::bit_width(static_cast<std::uint32_t>(cells_)) - 1);
    cut(sw, ne, nw, splits);
    cut(ne, sw, se, splits);
    return std::move(result_);
  }

 private:
  bool stays(std::int32_t v) const { return stays_[static_cast<std::size_t>(v)] != 0; }
  float elevation(std::int32_t v) const { return elevation_[static_cast<std::size_t>(v)]; }
  int label(std::int32_t v) const { return grid_.mark[static_cast<std::size_t>(v)] & proto::kVoid; }

  /// Cells that are partly void keep their corners: no larger triangle is ever partly void.
  void choose_rims() {
    for (std::int32_t y = 0; y < cells_; ++y) {
      for (std::int32_t x = 0; x < cells_; ++x) {
        const std::int32_t sw = y * across_ + x;
        const int voids = label(sw) + label(sw + 1) + label(sw + across_) + label(sw + across_ + 1);
        if (voids == 0 || voids == 4 * proto::kVoid) continue;
        for (const std::int32_t v : {sw, sw + 1, sw + across_, sw + across_ + 1}) stays_[static_cast<std::size_t>(v)] = 1;
      }
    }
  }

  /// Is v, in the middle between a and b, off their edge? Where there is no data nothing is off.
  bool differs(std::int32_t v, std::int32_t a, std::int32_t b) const {
    if ((label(a) | label(v) | label(b)) != 0) return false;
    return !(std::abs(elevation(v) - 0.5f * (elevation(a) + elevation(b))) <= tolerance_m_);
  }
  /// step: from one end of v's edge to v.
  void choose(std::int32_t v, bool needed, std::int32_t step) {
    if (needed || differs(v, v - step, v + step)) stays_[static_cast<std::size_t>(v)] = 1;
  }

  /// Middles of the sides of squares of 2 * half cells, along row y. Their triangles' halves are cut by the centres of the
  /// squares half as large around them.
  void choose_sides(std::int32_t half, std::int32_t y) {
    const bool north = (y / half) % 2 != 0;  // the way the side runs; else east
    const std::int32_t quarter = half / 2;
    for (std::int32_t x = north ? 0 : half; x <= cells_; x += 2 * half) {
      const std::int32_t v = y * across_ + x;
      bool needed = false;
      if (quarter > 0) {
        for (const std::int32_t dy : {-quarter, quarter}) {
          if (y + dy < 0 || y + dy > cells_) continue;
          if (x > 0) needed |= stays(v + dy * across_ - quarter);
          if (x < cells_) needed |= stays(v + dy * across_ + quarter);
        }
      }
      choose(v, needed, north ? half * across_ : half);
    }
  }
  /// Centres of squares of 2 * half cells. Diagonals meet in the centres of the squares twice as large; the halves are cut by the
  /// sides' middles.
  void choose_centres(std::int32_t half, std::int32_t y) {
    for (std::int32_t x = half; x < cells_; x += 2 * half) {
      const std::int32_t v = y * across_ + x;
      const bool needed = stays(v - half) || stays(v + half) || stays(v - half * across_) || stays(v + half * across_);
      const bool rises = (x / (2 * half) + y / (2 * half)) % 2 == 0;  // from south-west to north-east
      choose(v, needed, rises ? half * across_ + half : half * across_ - half);
    }
  }

  void take_vertices() {
    const auto count = static_cast<std::size_t>(std::count(stays_.begin(), stays_.end(), 1));
    proto::TileMesh& mesh = result_.mesh;
    mesh.side = grid_.side;
    for (auto* list : {&mesh.x, &mesh.y, &mesh.height}) list->reserve(count);
    mesh.mark.reserve(count);
    mesh.triangles.reserve(2 * count);
    result_.elevation.reserve(count);
    number_.resize(stays_.size());
    for (std::size_t v = 0; v < stays_.size(); ++v) {
      if (stays_[v] == 0) continue;
      number_[v] = static_cast<std::uint32_t>(mesh.vertices());
      mesh.x.push_back(grid_.x[v]);
      mesh.y.push_back(grid_.y[v]);
      mesh.height.push_back(grid_.height[v]);
      mesh.mark.push_back(grid_.mark[v]);
      result_.elevation.push_back(elevation_[v]);
    }
  }
  std::uint32_t number(std::int32_t v) const { return number_[static_cast<std::size_t>(v)]; }

  /// a, b: the ends of the longest edge; c on its left. splits: how often such a triangle can be halved.
  void cut(std::int32_t a, std::int32_t b, std::int32_t c, int splits) {
    const std::int32_t middle = (a + b) / 2;
    if (splits == 0 || !stays(middle)) {
      result_.mesh.triangles.push_back({number(a), number(b), number(c)});
      return;
    }
    cut(c, a, middle, splits - 1);
    cut(b, c, middle, splits - 1);
  }

  const proto::TileMesh& grid_;
  std::span<const float> elevation_;
  float tolerance_m_;
  std::int32_t cells_, across_;
  std::vector<std::uint8_t> stays_;    ///< indexed by vertex of the grid
  std::vector<std::uint32_t> number_;  ///< indexed by vertex of the grid: its number in the result
  SparseGrid result_;
};

}  // namespace

SparseGrid sparse_grid(const proto::TileMesh& grid, std::span<const float> elevation, float tolerance_m) {
  const auto across = static_cast<std::size_t>(grid.side) + 1;
  if (!std::has_single_bit(static_cast<std::uint32_t>(grid.side)) || grid.vertices() != across * across ||
      elevation.size() != grid.vertices())
    throw std::invalid_argument("sparse_grid: no full grid of a power of two of cells");
  return Sparse(grid, elevation, tolerance_m).run();
}

}  // namespace cordillera::test
