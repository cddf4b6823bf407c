#include <algorithm>
#include <array>
#include <cstdint>
#include <iterator>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "gpu/refine/making.h"
#include "gpu/refine/refine.h"
#include "gpu/refine/side_points.h"

namespace cordillera::gpu {
namespace {

/// Triangles that are left, one after the other.
class Stuck {
 public:
  Stuck(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::span<const std::uint32_t> over)
      : mesh_(mesh), meter_(meter), limit_m_(limit_m), left_(over.rbegin(), over.rend()) {}

  Refined run() {
    while (!left_.empty()) {
      const Id t = left_.back();
      left_.pop_back();
      mend(t);
    }
    return all_;
  }

 private:
  using Id = Refinement::Id;
  using Corners = std::array<MeshPoint, 3>;
  /// What came of trying to mend a triangle.
  struct Tried {
    std::optional<Id> off;
    std::vector<Id> slivers;
    std::optional<MeshPoint> missing;
    bool lacks_vertex = false, is_crowded = false;
  };

  void mend(Id t) {
    const Refinement::Triangle& c = mesh_.triangles[t];
    const auto point = [&](std::uint32_t v) { return MeshPoint{mesh_.x[v], mesh_.y[v], mesh_.height[v]}; };
    const auto wanted = meter_.wanted({point(c[0]), point(c[1]), point(c[2])}, limit_m_);
    if (!wanted) return;
    if (are_corners(mesh_, c, *wanted)) {  // rounded points tilt it, and nothing helps
      ++all_.over;
      return;
    }
    tried_ = {};
    if (!make(t, *wanted)) leave(*wanted);
    if (tried_.off) {
      take_off(*tried_.off, t);
      return;
    }
    std::ranges::copy_if(tried_.slivers, std::back_inserter(left_), [&](Id s) { return std::ranges::count(left_, s) == 0; });
  }

  bool make(Id t, const Corners& wanted) {
    const auto make_triangle = [&](Making& making) { return making.make_triangle(t, wanted); };
    // A crowd may be in a place from which no edge can be turned away.
    if (made(make_triangle) || (tried_.is_crowded && made(make_triangle, 0))) return true;
    // Else with two corners on a side of the tile, whose vertices are not to be changed.
    for (const std::size_t step : {1, 2}) {
      for (std::size_t k = 0; k < 3; ++k) {
        const MeshPoint &inside = wanted[k], &on_side = wanted[(k + step) % 3];
        if (inside.height == proto::kNoHeight || is_on_side(mesh_, inside) || !is_on_side(mesh_, on_side)) continue;
        if (made([&](Making& making) { return making.make_triangle_on_side(t, inside, on_side); })) return true;
      }
    }
    // Or as much of it as does not lie beyond the mesh; a needle along the rim goes.
    return tried_.lacks_vertex && (made([&](Making& making) { return making.make_part(t, wanted); }) ||
                                   made([&](Making& making) { return making.take_off_needle(t); }));
  }

  /// On a copy of the mesh, which takes its place if that was of use.
  template <class Make>
  bool made(const Make& make, std::uint32_t crowd = Making::kCrowd) {
    proto::TileMesh trial = mesh_;
    Making making(trial, meter_, limit_m_, crowd);
    if (!make(making)) {
      if (making.missing_on_side()) tried_.missing = making.missing_on_side();
      tried_.lacks_vertex = tried_.lacks_vertex || making.lacks_vertex();
      tried_.is_crowded = tried_.is_crowded || making.is_crowded();
      return false;
    }
    all_.inserted += static_cast<std::uint32_t>(trial.vertices() - mesh_.vertices());
    tried_.off = making.taken_off();
    tried_.slivers = making.slivers();
    mesh_ = std::move(trial);
    return true;
  }

  /// Over the limit, as it is.
  void leave(const Corners& wanted) {
    ++all_.over;
    if (tried_.missing) all_.on_sides.push_back(*tried_.missing);
    for (const MeshPoint& p : wanted) {
      if (p.height != proto::kNoHeight && is_on_side(mesh_, p) && !vertex_at(mesh_, p)) all_.on_sides.push_back(p);
    }
  }

  /// For t, which is looked at again where it is another one.
  void take_off(Id off, Id t) {
    std::erase(left_, off);
    if (off != t) left_.push_back(t);
    const Refinement::Triangle gone = mesh_.triangles[off];
    const auto last = static_cast<Id>(mesh_.triangles.size() - 1);
    mesh_.triangles[off] = mesh_.triangles[last];
    mesh_.triangles.pop_back();
    for (const std::uint32_t v : gone) {
      if (std::none_of(mesh_.triangles.begin(), mesh_.triangles.end(),
                       [v](const auto& other) { return std::ranges::count(other, v) > 0; }))
        mesh_.mark[v] |= proto::kVoid;
    }
    std::replace(left_.begin(), left_.end(), last, off);
  }

  proto::TileMesh& mesh_;
  const ErrorMeter& meter_;
  const double limit_m_;
  std::vector<Id> left_;
  Tried tried_;
  Refined all_;
};

}  // namespace

Refined refine_stuck(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::span<const std::uint32_t> over) {
  return Stuck(mesh, meter, limit_m, over).run();
}

}  // namespace cordillera::gpu
