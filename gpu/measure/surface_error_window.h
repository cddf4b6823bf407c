#pragma once
// What a tile's measurement reads besides its triangles: the samples under the tile, and the rims of its holes.
#include <algorithm>
#include <array>
#include <cstdint>
#include <vector>

#include "gpu/measure/surface_error.h"
#include "gpu/measure/surface_error_plan.h"
#include "proto/integers.h"

namespace cordillera::gpu {

/// Where the tile's samples lie in the window given. A window that ends inside the tile, or that meets it on both sides of the
/// antimeridian, leaves up to two stretches of columns.
class SampleWindow {
 public:
  struct Stretch {
    Span columns;            ///< tile-local
    std::int64_t shift = 0;  ///< sample column = tile-local column + shift
  };

  SampleWindow(const SurfaceErrorInput& in, std::int64_t side) : samples_(*in.samples) {
    const std::int64_t circle = in.lattice->columns();
    const std::int64_t base = proto::modulo(in.lattice->west(in.tile) - samples_.west, circle);
    const Span first{0, std::min<std::int64_t>(side, samples_.columns - 1 - base)};
    const std::int64_t seam = std::max(circle - base, first.last + 1);
    const Span second{seam, std::min<std::int64_t>(side, samples_.columns - 1 + circle - base)};
    stretches_ = {Stretch{first, base}, Stretch{second, base - circle}};
    row_shift_ = in.lattice->south(in.tile) - samples_.south;
    rows_ = {std::max<std::int64_t>(0, -row_shift_), std::min<std::int64_t>(side, samples_.rows - 1 - row_shift_)};
  }

  const Span& rows() const { return rows_; }
  const std::array<Stretch, 2>& stretches() const { return stretches_; }
  /// Sample row = tile-local row + row_shift().
  std::int64_t row_shift() const { return row_shift_; }
  /// First sample of tile-local row y; y in rows().
  const std::int32_t* row(std::int64_t y) const {
    return samples_.height.data() + static_cast<std::size_t>((y + row_shift_) * samples_.columns);
  }
  std::int32_t at(std::int64_t x, std::int64_t y) const {
    if (y < rows_.first || y > rows_.last) return proto::kNoHeight;
    for (const Stretch& s : stretches_)
      if (x >= s.columns.first && x <= s.columns.last) return row(y)[x + s.shift];
    return proto::kNoHeight;
  }

 private:
  const proto::Samples& samples_;
  std::array<Stretch, 2> stretches_;
  std::int64_t row_shift_ = 0;
  Span rows_;
};

CORDILLERA_HD inline Span intersection(const Span& a, const Span& b) {
  return {std::max(a.first, b.first), std::min(a.last, b.last)};
}
CORDILLERA_HD inline std::uint64_t length(const Span& s) {
  return s.last < s.first ? 0 : static_cast<std::uint64_t>(s.last - s.first + 1);
}

inline std::uint64_t count_valid(const std::int32_t* heights, std::size_t n) {
  std::uint64_t valid = 0;
  for (std::size_t k = 0; k < n; ++k) valid += heights[k] != proto::kNoHeight ? 1 : 0;
  return valid;
}

/// Edges of void triangles whose ends both have data: the published triangle across must count their samples.
class Rims {
 public:
  explicit Rims(const proto::TileMesh& mesh) {
    if (!has_voids(mesh)) return;
    on_rim_.assign(mesh.vertices(), 0);
    for (const auto& t : mesh.triangles) {
      for (int k = 0; k < 3; ++k) {
        const std::uint32_t a = t[k], b = t[(k + 1) % 3], other = t[(k + 2) % 3];
        if (is_void(mesh, a) || is_void(mesh, b) || !is_void(mesh, other)) continue;
        edges_.push_back(std::uint64_t{b} << 32 | a);
        on_rim_[a] = on_rim_[b] = 1;
      }
    }
    std::sort(edges_.begin(), edges_.end());
  }
  bool contains(std::uint32_t from, std::uint32_t to) const {
    return !edges_.empty() && on_rim_[from] != 0 && on_rim_[to] != 0 &&
           std::binary_search(edges_.begin(), edges_.end(), std::uint64_t{from} << 32 | to);
  }

 private:
  std::vector<std::uint64_t> edges_;  ///< from << 32 | to, as the triangle across runs along them; ascending
  std::vector<std::uint8_t> on_rim_;
};

}  // namespace cordillera::gpu
