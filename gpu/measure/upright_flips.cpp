#include "gpu/measure/upright_flips.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>
#include <vector>

#include "gpu/mesh/mesh_point.h"
#include "gpu/mesh/tile_valence.h"
#include "gpu/mesh/triangle_neighbours.h"

namespace cordillera::gpu {
namespace {

class Flipper {
 public:
  Flipper(proto::TileMesh& mesh, const Upright& upright, const ErrorMeter& meter, double limit_m)
      : mesh_(mesh),
        upright_(upright),
        meter_(meter),
        limit_m_(limit_m),
        across_(neighbours(mesh.triangles)),
        around_(mesh.vertices()) {
    for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t)
      for (const std::uint32_t v : mesh.triangles[t]) around_[v].push_back(t);
  }

  // What turns or goes leaves upright triangles alone, so the list only gets shorter. A fan of needles goes from its ends.
  std::uint32_t run() {
    std::uint32_t steps = 0;
    turned_ = turned_triangles(upright_, mesh_);
    is_turned_.assign(mesh_.triangles.size(), 0);
    for (const std::uint32_t t : turned_) is_turned_[t] = 1;
    while (!turned_.empty()) {
      std::uint32_t now = each_turned([this](std::uint32_t t) { return flip_one(t); });
      if (now == 0) now = each_turned([this](std::uint32_t t) { return collapse_one(t); });
      steps += now;
      if (now == 0) break;
    }
    std::erase(mesh_.triangles, kGone);
    return steps + leave_out();
  }

 private:
  using Triangle = std::array<std::uint32_t, 3>;
  static constexpr Triangle kGone{0, 0, 0};

  /// How often step, asked for each triangle that is turned over, did something.
  template <class Step>
  std::uint32_t each_turned(const Step& step) {
    std::uint32_t done = 0;
    for (const std::uint32_t t : turned_) done += is_turned_[t] && step(t) ? 1 : 0;
    std::erase_if(turned_, [this](std::uint32_t t) { return is_turned_[t] == 0; });
    return done;
  }
  std::array<MeshPoint, 3> corners(const Triangle& t) const {
    const auto at = [&](std::uint32_t v) { return MeshPoint{mesh_.x[v], mesh_.y[v], mesh_.height[v]}; };
    return {at(t[0]), at(t[1]), at(t[2])};
  }
  bool is_published(const Triangle& t) const { return proto::is_published(mesh_, t); }
  bool fits(const Triangle& t) const {
    const auto c = corners(t);
    return twice_area(c[0], c[1], c[2]) > 0 && upright_.is(c) &&
           (std::isinf(limit_m_) || meter_.error_m(c, limit_m_) <= limit_m_);
  }
  /// Ascending.
  std::vector<std::uint32_t> neighbours_of(std::uint32_t v) const {
    std::vector<std::uint32_t> found;
    for (const std::uint32_t t : around_[v])
      for (const std::uint32_t u : mesh_.triangles[t])
        if (u != v) found.push_back(u);
    std::sort(found.begin(), found.end());
    found.erase(std::unique(found.begin(), found.end()), found.end());
    return found;
  }
  void put(std::uint32_t t, const Triangle& corners) {
    for (const std::uint32_t v : mesh_.triangles[t]) std::erase(around_[v], t);
    for (const std::uint32_t v : corners) around_[v].push_back(t);
    mesh_.triangles[t] = corners;
    is_turned_[t] = 0;
  }
  void take_out(std::uint32_t t) {
    for (const std::uint32_t v : mesh_.triangles[t]) std::erase(around_[v], t);
    mesh_.triangles[t] = kGone;
    is_turned_[t] = 0;
  }
  void relink(std::uint32_t t, std::uint32_t old, std::uint32_t now) {
    if (t != kNoTriangle) std::replace(across_[t].begin(), across_[t].end(), old, now);
  }

  /// With data all around.
  bool is_inside(std::uint32_t v) const {
    if (sides_of(mesh_, v) > 0) return false;
    const std::vector<std::uint32_t> beside = neighbours_of(v);
    return beside.size() == around_[v].size() &&
           std::none_of(beside.begin(), beside.end(), [this](std::uint32_t u) { return is_void(mesh_, u); });
  }

  /// A corner inside the mesh, with data all around, moves into a neighbour, the nearest first.
  bool collapse_one(std::uint32_t t) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> ways;
    for (const std::uint32_t corner : mesh_.triangles[t]) {
      if (!is_inside(corner)) continue;
      for (const std::uint32_t to : neighbours_of(corner)) ways.emplace_back(corner, to);
    }
    const auto apart2 = [&](const auto& way) {
      const double dx = mesh_.x[way.first] - mesh_.x[way.second], dy = mesh_.y[way.first] - mesh_.y[way.second];
      return dx * dx + dy * dy;
    };
    std::stable_sort(ways.begin(), ways.end(), [&](const auto& a, const auto& b) { return apart2(a) < apart2(b); });
    return std::any_of(ways.begin(), ways.end(), [&](const auto& way) { return collapse(way.first, way.second); });
  }
  bool collapse(std::uint32_t from, std::uint32_t to) {
    const std::vector<std::uint32_t> of_from = neighbours_of(from), of_to = neighbours_of(to);
    std::vector<std::uint32_t> moving, shared, both;
    for (const std::uint32_t t : around_[from]) {
      const Triangle& c = mesh_.triangles[t];
      (std::find(c.begin(), c.end(), to) != c.end() ? shared : moving).push_back(t);
    }
    std::set_intersection(of_from.begin(), of_from.end(), of_to.begin(), of_to.end(), std::back_inserter(both));
    if (shared.size() != 2 || both.size() != 2) return false;  // their fans meet in two neighbours alone
    if (!may_have(mesh_, to, of_from.size() + of_to.size() - 4)) return false;
    std::vector<Triangle> moved;
    for (const std::uint32_t t : moving) {
      moved.push_back(mesh_.triangles[t]);
      std::replace(moved.back().begin(), moved.back().end(), from, to);
      if (!fits(moved.back())) return false;
    }
    for (const std::uint32_t t : shared) {  // what lay beyond its two other edges meets
      std::array<std::uint32_t, 2> beyond{kNoTriangle, kNoTriangle};
      for (unsigned k = 0; k < 3; ++k) {
        const std::uint32_t a = mesh_.triangles[t][k], b = mesh_.triangles[t][after(k)];
        if (a != from && b != from) beyond[0] = across_[t][k];
        if (a != to && b != to) beyond[1] = across_[t][k];
      }
      relink(beyond[0], t, beyond[1]);
      relink(beyond[1], t, beyond[0]);
      take_out(t);
    }
    for (std::size_t k = 0; k < moving.size(); ++k) put(moving[k], moved[k]);
    return true;
  }

  /// Of what is left, needles along a rim, which moves by their width then; each corner keeps another triangle.
  std::uint32_t leave_out() {
    std::vector<std::uint32_t> uses(mesh_.vertices(), 0);
    for (const Triangle& t : mesh_.triangles)
      for (const std::uint32_t v : t) ++uses[v];
    const auto across = neighbours(mesh_.triangles);
    std::vector<std::uint32_t> gone;
    for (const std::uint32_t t : turned_triangles(upright_, mesh_)) {
      const Triangle& corners = mesh_.triangles[t];
      bool rim = false, used = true;
      for (unsigned k = 0; k < 3; ++k) {
        rim = rim || (across[t][k] == kNoTriangle && !on_one_side(corners[k], corners[after(k)]));
        used = used && uses[corners[k]] > 1;
      }
      if (!rim || !used || !is_published(corners)) continue;
      for (const std::uint32_t v : corners) --uses[v];
      gone.push_back(t);
    }
    for (auto t = gone.rbegin(); t != gone.rend(); ++t) mesh_.triangles.erase(mesh_.triangles.begin() + *t);
    return static_cast<std::uint32_t>(gone.size());
  }
  bool on_one_side(std::uint32_t a, std::uint32_t b) const {
    const auto same = [](std::int32_t p, std::int32_t q, std::int32_t line) { return p == line && q == line; };
    return same(mesh_.x[a], mesh_.x[b], 0) || same(mesh_.x[a], mesh_.x[b], mesh_.side) || same(mesh_.y[a], mesh_.y[b], 0) ||
           same(mesh_.y[a], mesh_.y[b], mesh_.side);
  }
  std::size_t valence(std::uint32_t v) const { return around_[v].size() + (sides_of(mesh_, v) > 0 ? 1 : 0); }
  bool has_room(std::uint32_t v) const { return may_have(mesh_, v, valence(v) + 1); }

  /// The first of its edges that may be turned, the longest first.
  bool flip_one(std::uint32_t t) {
    const auto c = corners(mesh_.triangles[t]);
    std::array<unsigned, 3> edge{0, 1, 2};
    const auto long2 = [&](unsigned k) {
      const double dx = c[k].x - c[after(k)].x, dy = c[k].y - c[after(k)].y;
      return dx * dx + dy * dy;
    };
    std::sort(edge.begin(), edge.end(), [&](unsigned a, unsigned b) { return long2(a) > long2(b); });
    return std::any_of(edge.begin(), edge.end(), [&](unsigned k) { return flip(t, k); });
  }
  bool flip(std::uint32_t t, unsigned k) {
    const std::uint32_t other = across_[t][k];
    if (other == kNoTriangle) return false;
    const Triangle here = mesh_.triangles[t], there = mesh_.triangles[other];
    const std::uint32_t a = here[k], b = here[after(k)], apex = here[before(k)];
    const unsigned j = there[0] == b ? 0 : there[1] == b ? 1 : 2;  // it runs from b to a, then to what is beyond
    const std::uint32_t beyond = there[before(j)];
    const Triangle first{apex, a, beyond}, second{beyond, b, apex};
    if (!is_published(here) || !is_published(there) || !is_published(first) || !is_published(second)) return false;
    if (!has_room(apex) || !has_room(beyond) || valence(a) <= 3 || valence(b) <= 3 || !fits(first) || !fits(second)) return false;
    const std::uint32_t b_apex = across_[t][after(k)], apex_a = across_[t][before(k)];
    const std::uint32_t a_beyond = across_[other][after(j)], beyond_b = across_[other][before(j)];
    put(t, first);
    put(other, second);
    across_[t] = {apex_a, a_beyond, other};
    across_[other] = {beyond_b, b_apex, t};
    relink(a_beyond, other, t);
    relink(b_apex, t, other);
    return true;
  }

  proto::TileMesh& mesh_;
  const Upright& upright_;
  const ErrorMeter& meter_;
  const double limit_m_;
  std::vector<std::array<std::uint32_t, 3>> across_;  ///< indexed by triangle: see neighbours()
  std::vector<std::vector<std::uint32_t>> around_;    ///< indexed by vertex: its triangles
  std::vector<std::uint32_t> turned_;                 ///< triangles that are, ascending
  std::vector<std::uint8_t> is_turned_;               ///< indexed by triangle
};

}  // namespace

std::uint32_t flip_turned(proto::TileMesh& mesh, const Upright& upright, const ErrorMeter& meter, double limit_m) {
  return turned_triangles(upright, mesh).empty() ? 0 : Flipper(mesh, upright, meter, limit_m).run();
}

}  // namespace cordillera::gpu
