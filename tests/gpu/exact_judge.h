#pragma once
// The judge of gpu/exact: doubles, every sample, nothing of what it judges.
#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "gpu/exact/simplify_block.h"

namespace cordillera::gpu::exact {

struct Verdict {
  double max_m = 0, rmse_m = 0;  ///< of valid samples under published triangles
  std::size_t uncovered = 0;     ///< samples that no triangle covers
  std::size_t hidden = 0;        ///< valid samples farther than a cell from a void one that no published triangle covers
  std::size_t invented = 0;      ///< void samples farther than a cell from a valid one that a published triangle covers
  std::size_t turned = 0;        ///< triangles without positive area
  std::size_t astride = 0;       ///< triangles across a line between tiles
  std::size_t mislabelled = 0;   ///< vertices whose label or height is not what it should be
  int valence = 0;               ///< greatest number of triangles at a vertex
  bool exact_area = false;       ///< areas add up to the rectangle's
  std::uint64_t hash = 14695981039346656037ull;

  void mix(std::uint64_t bits) {
    for (int k = 0; k < 64; k += 8) hash = (hash ^ (bits >> k & 255)) * 1099511628211ull;
  }
};

/// Tolerances that double from level to level, heights in steps of up to an eighth of them and up to 4 m.
inline std::vector<BlockLevel> doubling_levels(double finest_m, int count) {
  std::vector<BlockLevel> levels;
  for (int l = 0; l < count; ++l) {
    const double tolerance_m = finest_m * (1 << l);
    std::int32_t step = 4096;
    while (8 * step > tolerance_m * 1024 && step > 1) step /= 2;
    levels.push_back({tolerance_m, step, l});
  }
  return levels;
}

/// A block's rectangle of its samples.
class JudgedGround {
 public:
  explicit JudgedGround(const Block& block) : columns(block.columns), rows(block.rows), block_(block) {}
  std::int32_t at(int x, int y) const { return block_.samples->at(block_.west + x, block_.south + y); }
  bool is_void(int x, int y) const { return at(x, y) == proto::kNoHeight; }
  /// Is a sample of the other kind within `cell` in columns and in rows?
  bool near_rim(int x, int y, int cell) const {
    for (int v = std::max(0, y - cell); v <= std::min(rows - 1, y + cell); ++v) {
      for (int u = std::max(0, x - cell); u <= std::min(columns - 1, x + cell); ++u) {
        if (is_void(u, v) != is_void(x, y)) return true;
      }
    }
    return false;
  }
  const int columns, rows;

 private:
  const Block& block_;
};

enum class Measure { shape, samples };  ///< what a verdict is about: the triangles alone, or every sample as well

class Judge {
 public:
  Judge(const Block& block, const BlockPlan& plan, std::size_t level)
      : ground_(block), block_(block), plan_(plan), level_(level) {}

  Verdict judge(const BlockMesh& mesh, Measure measure) {
    seen_.assign(static_cast<std::size_t>(ground_.columns) * static_cast<std::size_t>(ground_.rows), 0);
    at_vertex_.assign(mesh.vertices(), 0);
    squares_ = 0;
    counted_ = 0;
    area_ = 0;
    verdict_ = {};
    for (std::size_t v = 0; v < mesh.vertices(); ++v) look_at_vertex(mesh, v);
    for (const auto& triangle : mesh.triangles) look_at_triangle(mesh, triangle, measure);
    for (const int n : at_vertex_) verdict_.valence = std::max(verdict_.valence, n);
    verdict_.exact_area = area_ == 2.0 * (ground_.columns - 1) * (ground_.rows - 1);
    if (measure == Measure::samples) look_at_samples();
    return verdict_;
  }

 private:
  enum Seen : std::uint8_t { kCovered = 1, kPublished = 2 };
  struct Plane {
    double x, y, z, dx, dy;
  };

  void look_at_vertex(const BlockMesh& mesh, std::size_t v) {
    for (const std::int64_t n :
         {std::int64_t{mesh.x[v]}, std::int64_t{mesh.y[v]}, std::int64_t{mesh.height[v]}, std::int64_t{mesh.is_void[v]}}) {
      verdict_.mix(static_cast<std::uint64_t>(n));
    }
    const bool is_void = ground_.is_void(mesh.x[v], mesh.y[v]);
    const std::int32_t step = plan_.levels[level_].height_step;
    if (is_void != (mesh.is_void[v] != 0) || mesh.height[v] % step != 0 || (is_void && mesh.height[v] != 0))
      ++verdict_.mislabelled;
  }
  bool is_astride(const std::array<double, 3>& at, std::int64_t origin) const {
    const std::int64_t side = std::int64_t{plan_.tile_side} << level_;
    const auto low = origin + static_cast<std::int64_t>(*std::min_element(at.begin(), at.end()));
    const auto high = origin + static_cast<std::int64_t>(*std::max_element(at.begin(), at.end()));
    const auto floor_of = [side](std::int64_t n) { return n >= 0 ? n / side : -((-n + side - 1) / side); };
    return floor_of(low) != floor_of(high - 1);
  }
  void look_at_triangle(const BlockMesh& mesh, const std::array<std::uint32_t, 3>& corner, Measure measure) {
    std::array<double, 3> x{}, y{};
    bool published = true;
    for (std::size_t k = 0; k < 3; ++k) {
      verdict_.mix(corner[k]);
      x[k] = mesh.x[corner[k]];
      y[k] = mesh.y[corner[k]];
      published = published && !mesh.is_void[corner[k]];
      ++at_vertex_[corner[k]];
    }
    const double area = (x[1] - x[0]) * (y[2] - y[0]) - (y[1] - y[0]) * (x[2] - x[0]);
    area_ += area;
    if (area <= 0) {
      ++verdict_.turned;
      return;
    }
    if (is_astride(x, block_.west) || is_astride(y, block_.south)) ++verdict_.astride;
    if (measure == Measure::shape) return;
    const double z0 = mesh.height[corner[0]], z1 = mesh.height[corner[1]] - z0, z2 = mesh.height[corner[2]] - z0;
    const Plane plane{x[0], y[0], z0, (z1 * (y[2] - y[0]) - z2 * (y[1] - y[0])) / area,
                      (z2 * (x[1] - x[0]) - z1 * (x[2] - x[0])) / area};
    for (int row = static_cast<int>(*std::min_element(y.begin(), y.end()));
         row <= static_cast<int>(*std::max_element(y.begin(), y.end())); ++row) {
      measure_row(x, y, row, plane, published);
    }
  }
  void measure_row(const std::array<double, 3>& x, const std::array<double, 3>& y, int row, const Plane& plane, bool published) {
    double low = *std::min_element(x.begin(), x.end()), high = *std::max_element(x.begin(), x.end());
    for (std::size_t k = 0; k < 3; ++k) {
      const double rise = y[(k + 1) % 3] - y[k];
      if (rise == 0) continue;
      const double at = x[k] + (x[(k + 1) % 3] - x[k]) * (row - y[k]) / rise;
      if (rise > 0)
        high = std::min(high, at);
      else
        low = std::max(low, at);
    }
    for (int column = static_cast<int>(std::ceil(low - 1e-9)); column <= static_cast<int>(std::floor(high + 1e-9)); ++column) {
      std::uint8_t& seen =
          seen_[static_cast<std::size_t>(row) * static_cast<std::size_t>(ground_.columns) + static_cast<std::size_t>(column)];
      const bool counted = (seen & kPublished) != 0;
      seen = static_cast<std::uint8_t>(seen | kCovered | (published ? kPublished : 0));
      if (!published || ground_.is_void(column, row)) continue;
      const double off =
          (plane.z + plane.dx * (column - plane.x) + plane.dy * (row - plane.y) - ground_.at(column, row)) * proto::kHeightStep_m;
      verdict_.max_m = std::max(verdict_.max_m, std::abs(off));
      if (counted) continue;
      squares_ += off * off;
      ++counted_;
    }
  }
  void look_at_samples() {
    const int cell = 1 << level_;
    for (int y = 0; y < ground_.rows; ++y) {
      for (int x = 0; x < ground_.columns; ++x) {
        const std::uint8_t seen =
            seen_[static_cast<std::size_t>(y) * static_cast<std::size_t>(ground_.columns) + static_cast<std::size_t>(x)];
        if (!(seen & kCovered)) ++verdict_.uncovered;
        const bool is_void = ground_.is_void(x, y), published = (seen & kPublished) != 0;
        if (is_void != published || ground_.near_rim(x, y, cell)) continue;
        ++(is_void ? verdict_.invented : verdict_.hidden);
      }
    }
    verdict_.rmse_m = counted_ ? std::sqrt(squares_ / static_cast<double>(counted_)) : 0;
  }

  const JudgedGround ground_;
  const Block& block_;
  const BlockPlan& plan_;
  const std::size_t level_;
  std::vector<std::uint8_t> seen_;
  std::vector<int> at_vertex_;
  double squares_ = 0, area_ = 0;
  std::size_t counted_ = 0;
  Verdict verdict_;
};

}  // namespace cordillera::gpu::exact
