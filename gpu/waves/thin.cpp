#include "gpu/waves/thin.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <queue>
#include <stdexcept>
#include <utility>
#include <vector>

#include "gpu/mesh/refine_shape.h"
#include "gpu/mesh/rings.h"

namespace cordillera::gpu {
namespace {

constexpr std::size_t kMostTries =
    2;                               // neighbours to collapse onto: those that leave the vertex itself least far from the surface
constexpr double kSightShare = 1.1;  // of the limit; what is farther off at the vertex, on a flat earth, need not be measured
constexpr int kHeightSteps = 5;      // of a search for the best height: each half as long as the one before

class Thinner {
 public:
  Thinner(proto::TileMesh& mesh, const ErrorMeter& meter, const Thinning& how)
      : mesh_(mesh),
        meter_(meter),
        limit_m_(how.limit_m),
        height_step_(how.height_step),
        rings_(rings_of(mesh)),
        round_(mesh.vertices(), 0) {
    for (std::uint32_t v = 0; v < mesh.vertices(); ++v) {
      if (is_void(mesh, v)) continue;
      low_ = std::min(low_, mesh.height[v]);
      high_ = std::max(high_, mesh.height[v]);
    }
  }

  std::uint32_t run(int height_rounds) {
    std::uint32_t gone = collapse_all();
    for (int round = 0; round < height_rounds; ++round) {
      for (std::uint32_t v = 0; v < mesh_.vertices(); ++v) fit_height(v);
      gone += collapse_all();
    }
    mesh_ = mesh_from_rings(mesh_, rings_);
    return gone;
  }

 private:
  struct Collapse {
    double error_m = 0;
    std::uint32_t from = 0, onto = 0, round = 0;
    /// Of a queue whose top does least harm.
    bool operator<(const Collapse& o) const { return std::pair(error_m, from) > std::pair(o.error_m, o.from); }
  };

  static Rings rings_of(const proto::TileMesh& mesh) {
    proto::Result<Rings> rings = rings_from_triangles(mesh);
    if (!rings.ok()) throw std::logic_error("thin: " + rings.problem().detail);
    return std::move(*rings);
  }

  MeshPoint point(std::uint32_t v) const { return {mesh_.x[v], mesh_.y[v], mesh_.height[v]}; }

  /// An inner vertex with data all around.
  bool is_free(std::uint32_t v) const {
    if (rings_.valence[v] == 0 || rings_.open[v] || (mesh_.mark[v] & proto::kKeep)) return false;
    const auto ring = rings_.ring(v);
    return !is_void(mesh_, v) && std::none_of(ring.begin(), ring.end(), [&](std::uint32_t u) { return is_void(mesh_, u); });
  }

  // The star of v collapsed onto its neighbour k: f(a, b, c) for each triangle, until it returns false.
  template <class F>
  bool each_new_triangle(std::uint32_t v, std::uint32_t k, F f) const {
    const auto ring = rings_.ring(v);
    const auto count = static_cast<std::uint32_t>(ring.size());
    for (std::uint32_t i = 1; i + 1 < count; ++i)
      if (!f(point(ring[k]), point(ring[(k + i) % count]), point(ring[(k + i + 1) % count]))) return false;
    return true;
  }

  // May onto have the neighbours of v as well?
  bool has_room(std::uint32_t v, std::uint32_t onto) const {
    return may_have(mesh_, onto, rings_.valence[onto] + rings_.valence[v] - 4u);
  }

  // How far v is from the surface without it; nullopt where a law forbids the collapse.
  std::optional<double> distance_m(std::uint32_t v, std::uint32_t k) const {
    if (!has_room(v, rings_.ring(v)[k])) return std::nullopt;
    const MeshPoint at = point(v);
    double height = at.height;
    const bool lawful = each_new_triangle(v, k, [&](const MeshPoint& a, const MeshPoint& b, const MeshPoint& c) {
      const std::int64_t area = twice_area(a, b, c), wa = twice_area(at, b, c), wb = twice_area(a, at, c),
                         wc = twice_area(a, b, at);
      if (area <= 0 || !has_body(a, b, c)) return false;
      const auto share = [&](std::int64_t w, const MeshPoint& p) {
        return static_cast<double>(w) / static_cast<double>(area) * p.height;
      };
      if (wa >= 0 && wb >= 0 && wc >= 0) height = share(wa, a) + share(wb, b) + share(wc, c);
      return true;
    });
    if (!lawful) return std::nullopt;
    return std::abs(height - at.height) * proto::kHeightStep_m;
  }

  // The greatest error of the triangles that the collapse makes; anything above the bound once it is passed.
  double cost_m(std::uint32_t v, std::uint32_t k, double bound_m) const {
    double greatest = 0;
    each_new_triangle(v, k, [&](const MeshPoint& a, const MeshPoint& b, const MeshPoint& c) {
      greatest = std::max(greatest, meter_.error_m({a, b, c}, {bound_m, greatest, mesh_.y[v]}));
      return greatest <= bound_m;
    });
    return greatest;
  }

  // Queues the best collapse of v, if one is within the limit.
  void consider(std::uint32_t v) {
    ++round_[v];
    if (!is_free(v)) return;
    std::array<std::pair<double, std::uint32_t>, kRowWidth> tries;
    std::size_t count = 0;
    for (std::uint32_t k = 0; k < rings_.valence[v]; ++k) {
      const std::optional<double> far_m = distance_m(v, k);
      if (far_m && *far_m <= kSightShare * limit_m_) tries[count++] = {*far_m, k};
    }
    std::sort(tries.begin(), tries.begin() + static_cast<std::ptrdiff_t>(count));
    std::optional<Collapse> best;
    for (std::size_t n = 0; n < std::min(count, kMostTries); ++n) {
      const double bound_m = best ? best->error_m : limit_m_;
      const double now_m = cost_m(v, tries[n].second, bound_m);
      if (now_m < bound_m || (!best && now_m <= bound_m)) best = {now_m, v, rings_.ring(v)[tries[n].second], round_[v]};
    }
    if (best) queue_.push(*best);
  }

  std::uint32_t collapse_all() {
    for (std::uint32_t v = 0; v < mesh_.vertices(); ++v) consider(v);
    std::uint32_t gone = 0;
    while (!queue_.empty()) {
      const Collapse next = queue_.top();
      queue_.pop();
      if (next.round != round_[next.from]) continue;  // its star is another by now
      if (!has_room(next.from, next.onto)) {
        consider(next.from);
        continue;
      }
      const auto ring = rings_.ring(next.from);
      const std::vector<std::uint32_t> around(ring.begin(), ring.end());
      collapse(next.from, next.onto);
      ++gone;
      for (const std::uint32_t w : around) consider(w);
    }
    return gone;
  }

  // Puts others into the row of w in the place of old.
  void replace(std::uint32_t w, std::uint32_t old, std::span<const std::uint32_t> others) {
    const auto row = rings_.row(w);
    const auto end = row.begin() + rings_.valence[w], at = std::find(row.begin(), end, old);
    std::array<std::uint32_t, kRowWidth> after;
    const auto rest = std::copy(at + 1, end, after.begin());
    std::copy(after.begin(), rest, std::copy(others.begin(), others.end(), at));
    rings_.valence[w] = static_cast<std::uint8_t>(rings_.valence[w] + others.size() - 1);
  }

  void collapse(std::uint32_t v, std::uint32_t onto) {
    const auto ring = rings_.ring(v);
    std::vector<std::uint32_t> around(ring.begin(), ring.end());
    std::rotate(around.begin(), std::find(around.begin(), around.end(), onto), around.end());
    // onto, next to it, ..., before it: the two beside it lose v, the rest get onto for v.
    replace(around[1], v, {});
    replace(around.back(), v, {});
    const std::span<const std::uint32_t> between(around.data() + 2, around.size() - 3);
    for (const std::uint32_t w : between) replace(w, v, {&onto, 1});
    replace(onto, v, between);
    rings_.valence[v] = 0;
    ++round_[v];
  }

  double star_m(std::uint32_t v, double bound_m) const {
    const auto ring = rings_.ring(v);
    double greatest = 0;
    for (std::size_t i = 0; i < ring.size() && greatest < bound_m; ++i)
      greatest = std::max(greatest, meter_.error_m({point(v), point(ring[i]), point(ring[(i + 1) % ring.size()])},
                                                   {bound_m, greatest, mesh_.y[v]}));
    return greatest;
  }

  // The greatest error around is a convex function of the height, so a search that halves its steps comes near the least.
  void fit_height(std::uint32_t v) {
    if (!is_free(v)) return;
    std::int32_t best = mesh_.height[v];
    double least_m = star_m(v, INFINITY);
    const auto improves = [&](std::int32_t height) {
      if (height < low_ || height > high_) return false;  // what the meter was made for
      mesh_.height[v] = height;
      const double now_m = star_m(v, least_m);
      if (now_m >= least_m) return false;
      least_m = now_m;
      best = height;
      return true;
    };
    auto steps = static_cast<std::int32_t>(least_m / proto::kHeightStep_m / 2 / height_step_);
    for (int n = 0; n < kHeightSteps && steps > 0; ++n, steps /= 2) {
      const std::int32_t from = best;
      if (!improves(from + steps * height_step_)) improves(from - steps * height_step_);
    }
    mesh_.height[v] = best;
  }

  proto::TileMesh& mesh_;
  const ErrorMeter& meter_;
  double limit_m_;
  std::int32_t height_step_;
  Rings rings_;
  std::int32_t low_ = INT32_MAX, high_ = INT32_MIN;  // of the mesh as it came
  std::vector<std::uint32_t> round_;                 // indexed by vertex: what was queued in an earlier round no longer counts
  std::priority_queue<Collapse> queue_;
};

}  // namespace

std::uint32_t thin(proto::TileMesh& mesh, const ErrorMeter& meter, const Thinning& how) {
  return Thinner(mesh, meter, how).run(how.height_rounds);
}

}  // namespace cordillera::gpu
