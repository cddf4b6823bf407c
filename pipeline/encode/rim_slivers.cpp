#include "pipeline/encode/rim_slivers.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdlib>

#include "gpu/mesh/triangle_neighbours.h"

namespace cordillera::pipeline {
namespace {

using Triangle = std::array<std::uint32_t, 3>;

std::int32_t extent(const std::vector<std::int32_t>& at, const Triangle& t) {
  const auto [low, high] = std::minmax({at[t[0]], at[t[1]], at[t[2]]});
  return high - low;
}

/// How far the corner opposite to an edge lies above or below it, in height steps; 0 where it lies beside the edge's ends. along:
/// the coordinate that says where.
double lean(const proto::TileMesh& mesh, const std::vector<std::int32_t>& along, std::uint32_t from, std::uint32_t to,
            std::uint32_t opposite) {
  const auto [low, high] = std::minmax(along[from], along[to]);
  if (low == high || along[opposite] < low || along[opposite] > high) return 0;
  const double share = static_cast<double>(along[opposite] - along[from]) / (along[to] - along[from]);
  return std::abs(mesh.height[opposite] - (mesh.height[from] + share * (mesh.height[to] - mesh.height[from])));
}

class Slivers {
 public:
  Slivers(const proto::TileMesh& mesh, double limit_steps) : mesh_(mesh), limit_(limit_steps) {
    for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
      if (is_published(mesh, mesh.triangles[t]) && may_lean(mesh.triangles[t])) candidates_.push_back(t);
    }
  }

  std::vector<std::uint8_t> found() {
    if (candidates_.empty()) return {};
    look_at_neighbours();
    // Beside one that is left out another may be the outermost.
    for (bool more = true; more;) {
      more = false;
      for (const std::size_t t : candidates_) more |= leave_out(t);
    }
    return any_ ? left_out_ : std::vector<std::uint8_t>();
  }

 private:
  bool is_thin(const std::vector<std::int32_t>& at, const Triangle& t) const { return extent(at, t) <= 1; }
  bool may_lean(const Triangle& t) const {
    return (is_thin(mesh_.x, t) || is_thin(mesh_.y, t)) && extent(mesh_.height, t) > limit_;
  }
  bool is_void(const Triangle& t) const { return !is_published(mesh_, t); }

  void look_at_neighbours() {
    twin_ = gpu::twin_edges(mesh_.triangles);
    left_out_.assign(mesh_.triangles.size(), 0);
    uses_.assign(mesh_.x.size(), 0);
    for (const Triangle& t : mesh_.triangles) {
      if (is_void(t)) continue;
      for (const std::uint32_t v : t) ++uses_[v];
    }
  }

  /// No published triangle of the tile on its other side. One on a side of the tile is never aslant, and with another rim beside
  /// it the triangle stays.
  bool is_rim(std::size_t edge) const {
    const std::uint32_t twin = twin_[edge];
    return twin == gpu::kNoEdge || left_out_[twin / 3] != 0 || is_void(mesh_.triangles[twin / 3]);
  }

  bool leave_out(std::size_t t) {
    if (left_out_[t] != 0) return false;
    const Triangle& corners = mesh_.triangles[t];
    int rims = 0, rim = 0;
    for (int c = 0; c < 3; ++c) {
      if (uses_[corners[static_cast<std::size_t>(c)]] < 2) return false;
      if (is_rim(3 * t + static_cast<std::size_t>(c))) ++rims, rim = c;
    }
    if (rims != 1) return false;
    const std::uint32_t from = corners[static_cast<std::size_t>(rim)], to = corners[static_cast<std::size_t>((rim + 1) % 3)],
                        opposite = corners[static_cast<std::size_t>((rim + 2) % 3)];
    if (!leans(corners, from, to, opposite)) return false;
    left_out_[t] = 1, any_ = true;
    for (const std::uint32_t v : corners) --uses_[v];
    return true;
  }
  /// An edge within a row of samples has samples on it.
  bool leans(const Triangle& corners, std::uint32_t from, std::uint32_t to, std::uint32_t opposite) const {
    const auto aslant = [&](const std::vector<std::int32_t>& across, const std::vector<std::int32_t>& along) {
      return is_thin(across, corners) && across[from] != across[to] && lean(mesh_, along, from, to, opposite) > limit_;
    };
    return aslant(mesh_.y, mesh_.x) || aslant(mesh_.x, mesh_.y);
  }

  const proto::TileMesh& mesh_;
  const double limit_;
  std::vector<std::size_t> candidates_;
  std::vector<std::uint32_t> twin_;     ///< indexed by edge
  std::vector<std::uint32_t> uses_;     ///< published triangles, indexed by vertex
  std::vector<std::uint8_t> left_out_;  ///< indexed by triangle
  bool any_ = false;
};

}  // namespace

std::vector<std::uint8_t> rim_slivers(const proto::TileMesh& mesh, double limit_m) {
  return Slivers(mesh, limit_m / proto::kHeightStep_m).found();
}

}  // namespace cordillera::pipeline
