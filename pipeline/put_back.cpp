#include "pipeline/put_back.h"

#include <algorithm>
#include <cmath>

namespace cordillera::pipeline {
namespace {

/// Valid vertices by square, so that the nearest are found without looking at all.
class VertexSquares {
 public:
  explicit VertexSquares(const proto::TileMesh& mesh)
      : mesh_(mesh),
        across_(std::clamp(static_cast<int>(std::sqrt(static_cast<double>(mesh.vertices()) / kPerSquare)), 1, mesh.side)),
        size_(mesh.side / across_ + 1) {
    std::vector<std::uint32_t> count(static_cast<std::size_t>(across_) * static_cast<std::size_t>(across_) + 1, 0);
    for (std::size_t v = 0; v < mesh.vertices(); ++v) ++count[square(mesh.x[v], mesh.y[v]) + 1];
    for (std::size_t s = 1; s < count.size(); ++s) count[s] += count[s - 1];
    start_ = count;
    vertices_.resize(mesh.vertices());
    for (std::size_t v = 0; v < mesh.vertices(); ++v) vertices_[count[square(mesh.x[v], mesh.y[v])]++] = static_cast<std::uint32_t>(v);
  }

  /// Removable vertices around (x, y), nearest first, at most `most`. Looks two squares far.
  std::vector<std::uint32_t> nearest(std::int32_t x, std::int32_t y, std::size_t most) const {
    std::vector<std::pair<std::int64_t, std::uint32_t>> found;
    const int cx = x / size_, cy = y / size_;
    for (int sy = std::max(0, cy - 2); sy <= std::min(across_ - 1, cy + 2); ++sy) {
      for (int sx = std::max(0, cx - 2); sx <= std::min(across_ - 1, cx + 2); ++sx) {
        const std::size_t s = static_cast<std::size_t>(sy) * static_cast<std::size_t>(across_) + static_cast<std::size_t>(sx);
        for (std::uint32_t k = start_[s]; k < start_[s + 1]; ++k) {
          const std::uint32_t v = vertices_[k];
          if (mesh_.mark[v] & (proto::kVoid | proto::kKeep | proto::kRemove)) continue;
          const std::int64_t dx = mesh_.x[v] - x, dy = mesh_.y[v] - y;
          found.emplace_back(dx * dx + dy * dy, v);
        }
      }
    }
    const std::size_t wanted = std::min(most, found.size());
    std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(wanted), found.end());
    std::vector<std::uint32_t> result;
    for (std::size_t k = 0; k < wanted; ++k) result.push_back(found[k].second);
    return result;
  }

 private:
  static constexpr double kPerSquare = 6;  // vertices, on average
  std::size_t square(std::int32_t x, std::int32_t y) const {
    return static_cast<std::size_t>(y / size_) * static_cast<std::size_t>(across_) + static_cast<std::size_t>(x / size_);
  }
  const proto::TileMesh& mesh_;
  std::int32_t across_, size_;
  std::vector<std::uint32_t> start_, vertices_;
};

}  // namespace

std::uint32_t put_back(proto::TileMesh& input, const std::vector<gpu::SurfaceError::Worst>& samples, int attempt) {
  const VertexSquares squares(input);
  const std::size_t most = std::size_t{1} << std::min(attempt, 5);
  std::uint32_t marked = 0;
  for (const gpu::SurfaceError::Worst& worst : samples) {
    for (const std::uint32_t v : squares.nearest(worst.x, worst.y, most)) {
      if (input.mark[v] & proto::kKeep) continue;
      input.mark[v] |= proto::kKeep;
      ++marked;
    }
  }
  return marked;
}

std::uint32_t keep_support(proto::TileMesh& input, const proto::TileMesh& simplified, std::int32_t cell_units, int attempt) {
  std::uint32_t left = 0;
  const auto keep_nearest = [&](std::int64_t x, std::int64_t y) {
    if (x < 0 || y < 0 || x > input.side || y > input.side) return;
    std::int64_t least = INT64_MAX;
    std::size_t best = 0;
    for (std::size_t v = 0; v < input.vertices(); ++v) {
      const bool inside = input.x[v] > 0 && input.y[v] > 0 && input.x[v] < input.side && input.y[v] < input.side;
      const std::int64_t dx = input.x[v] - x, dy = input.y[v] - y;
      if (!inside || dx * dx + dy * dy >= least) continue;
      least = dx * dx + dy * dy;
      best = v;
    }
    if (least != INT64_MAX) input.mark[best] |= proto::kKeep;
  };
  for (std::size_t v = 0; v < simplified.vertices(); ++v) {
    if (!(simplified.mark[v] & proto::kRemove)) continue;
    ++left;
    const std::int64_t x = simplified.x[v], y = simplified.y[v];
    const std::int64_t in_x = x == 0 ? 1 : x == input.side ? -1 : 0, in_y = y == 0 ? 1 : y == input.side ? -1 : 0;
    // Not close by: what is kept there would stand in the way as well.
    for (std::int64_t d = std::int64_t{4} * cell_units << (attempt & 3); d < input.side; d *= 2) {
      for (int across = -1; across <= 1; ++across) keep_nearest(x + in_x * d + in_y * across * d, y + in_y * d + in_x * across * d);
    }
  }
  return left;
}

}  // namespace cordillera::pipeline
