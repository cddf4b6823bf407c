#include "gpu/measure/upright_flips.h"

#include <algorithm>
#include <iterator>
#include <utility>
#include <vector>

#include "gpu/mesh/mesh_point.h"
#include "gpu/mesh/rings.h"
#include "gpu/mesh/triangle_neighbours.h"

namespace cordillera::gpu {
namespace {

constexpr int kRounds = 32;  // a fan of needles goes from its ends

class Flipper {
 public:
  Flipper(proto::TileMesh& mesh, const Upright& upright, const ErrorMeter& meter, double limit_m)
      : mesh_(mesh), upright_(upright), meter_(meter), limit_m_(limit_m), valence_(mesh.vertices(), 0) {
    std::vector<std::pair<std::uint32_t, std::uint32_t>> edges;
    for (const auto& t : mesh.triangles) {
      for (unsigned k = 0; k < 3; ++k) edges.emplace_back(t[k], t[after(k)]), edges.emplace_back(t[after(k)], t[k]);
    }
    std::sort(edges.begin(), edges.end());
    edges.erase(std::unique(edges.begin(), edges.end()), edges.end());
    for (const auto& edge : edges) ++valence_[edge.first];
  }

  std::uint32_t run() {
    std::uint32_t flipped = 0;
    for (int round = 0; round < kRounds; ++round) {
      const std::vector<std::uint32_t> turned = turned_triangles(upright_, mesh_);
      std::uint32_t now = 0;
      for (const std::uint32_t t : turned) now += flip_one(t) ? 1 : 0;
      if (now == 0 && !turned.empty()) now = collapse_one(turned) ? 1 : 0;
      flipped += now;
      if (now == 0) break;
    }
    return flipped + leave_out();
  }

 private:
  using Triangle = std::array<std::uint32_t, 3>;
  std::array<MeshPoint, 3> corners(const Triangle& t) const {
    const auto at = [&](std::uint32_t v) { return MeshPoint{mesh_.x[v], mesh_.y[v], mesh_.height[v]}; };
    return {at(t[0]), at(t[1]), at(t[2])};
  }
  bool is_void(std::uint32_t v) const { return (mesh_.mark[v] & proto::kVoid) != 0; }
  bool is_published(const Triangle& t) const { return !is_void(t[0]) && !is_void(t[1]) && !is_void(t[2]); }
  bool fits(const Triangle& t) const {
    const auto c = corners(t);
    return twice_area(c[0], c[1], c[2]) > 0 && upright_.is(c) && meter_.error_m(c, limit_m_) <= limit_m_;
  }
  /// A corner inside the mesh moves into another one of its triangle, the nearest first.
  bool collapse_one(const std::vector<std::uint32_t>& turned) {
    if (std::any_of(mesh_.mark.begin(), mesh_.mark.end(), [](std::uint8_t mark) { return (mark & proto::kVoid) != 0; })) return false;
    for (const std::uint32_t t : turned) {
      const Triangle corner = mesh_.triangles[t];
      std::array<std::pair<std::uint32_t, std::uint32_t>, 6> ways;
      for (unsigned k = 0; k < 3; ++k) ways[2 * k] = {corner[k], corner[after(k)]}, ways[2 * k + 1] = {corner[after(k)], corner[k]};
      const auto apart2 = [&](const auto& way) {
        const double dx = mesh_.x[way.first] - mesh_.x[way.second], dy = mesh_.y[way.first] - mesh_.y[way.second];
        return dx * dx + dy * dy;
      };
      std::stable_sort(ways.begin(), ways.end(), [&](const auto& a, const auto& b) { return apart2(a) < apart2(b); });
      if (std::any_of(ways.begin(), ways.end(), [&](const auto& way) { return collapse(way.first, way.second); })) return true;
    }
    return false;
  }
  bool collapse(std::uint32_t from, std::uint32_t to) {
    if (sides_of(mesh_, from) > 0) return false;
    std::vector<std::uint32_t> around, shared;
    std::vector<std::uint32_t> next, of_from, of_to;  // neighbours
    for (std::uint32_t t = 0; t < mesh_.triangles.size(); ++t) {
      const Triangle& c = mesh_.triangles[t];
      const auto has = [&c](std::uint32_t v) { return c[0] == v || c[1] == v || c[2] == v; };
      if (has(to)) of_to.insert(of_to.end(), c.begin(), c.end());
      if (!has(from)) continue;
      of_from.insert(of_from.end(), c.begin(), c.end());
      (has(to) ? shared : around).push_back(t);
    }
    for (auto* list : {&of_from, &of_to}) {
      std::sort(list->begin(), list->end());
      list->erase(std::unique(list->begin(), list->end()), list->end());
    }
    std::set_intersection(of_from.begin(), of_from.end(), of_to.begin(), of_to.end(), std::back_inserter(next));
    // A closed fan, which meets that of the other in two neighbours alone (and the two themselves).
    if (shared.size() != 2 || next.size() != 4 || of_from.size() != around.size() + 3) return false;
    const std::size_t neighbours_after = of_from.size() + of_to.size() - next.size() - 1;
    if (neighbours_after > most_neighbours(mesh_, to, kWeldedCaps)) return false;
    std::vector<Triangle> moved;
    for (const std::uint32_t t : around) {
      Triangle c = mesh_.triangles[t];
      std::replace(c.begin(), c.end(), from, to);
      if (!fits(c)) return false;
      moved.push_back(c);
    }
    for (std::size_t k = 0; k < around.size(); ++k) mesh_.triangles[around[k]] = moved[k];
    for (auto t = shared.rbegin(); t != shared.rend(); ++t) mesh_.triangles.erase(mesh_.triangles.begin() + *t);
    valence_[to] = static_cast<std::uint32_t>(neighbours_after);
    for (const std::uint32_t v : next) valence_[v] -= v != from && v != to ? 1 : 0;
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
    return same(mesh_.x[a], mesh_.x[b], 0) || same(mesh_.x[a], mesh_.x[b], mesh_.side) || same(mesh_.y[a], mesh_.y[b], 0) || same(mesh_.y[a], mesh_.y[b], mesh_.side);
  }
  bool has_room(std::uint32_t v) const { return valence_[v] + 1 <= most_neighbours(mesh_, v, kWeldedCaps); }

  /// The first of its edges that may be turned, the longest first.
  bool flip_one(std::uint32_t t) {
    const auto across = neighbours(mesh_.triangles);
    const auto c = corners(mesh_.triangles[t]);
    std::array<unsigned, 3> edge{0, 1, 2};
    const auto long2 = [&](unsigned k) {
      const double dx = c[k].x - c[after(k)].x, dy = c[k].y - c[after(k)].y;
      return dx * dx + dy * dy;
    };
    std::sort(edge.begin(), edge.end(), [&](unsigned a, unsigned b) { return long2(a) > long2(b); });
    return std::any_of(edge.begin(), edge.end(), [&](unsigned k) { return flip(t, k, across[t][k]); });
  }
  bool flip(std::uint32_t t, unsigned k, std::uint32_t other) {
    if (other == kNoTriangle) return false;
    const Triangle here = mesh_.triangles[t], there = mesh_.triangles[other];
    const std::uint32_t a = here[k], b = here[after(k)], apex = here[before(k)];
    const std::uint32_t beyond = there[0] != a && there[0] != b ? there[0] : there[1] != a && there[1] != b ? there[1] : there[2];
    const Triangle first{apex, a, beyond}, second{beyond, b, apex};
    if (!is_published(here) || !is_published(there) || !is_published(first) || !is_published(second)) return false;
    if (!has_room(apex) || !has_room(beyond) || valence_[a] <= 3 || valence_[b] <= 3 || !fits(first) || !fits(second)) return false;
    mesh_.triangles[t] = first;
    mesh_.triangles[other] = second;
    --valence_[a], --valence_[b], ++valence_[apex], ++valence_[beyond];
    return true;
  }

  proto::TileMesh& mesh_;
  const Upright& upright_;
  const ErrorMeter& meter_;
  const double limit_m_;
  std::vector<std::uint32_t> valence_;
};

}  // namespace

std::uint32_t flip_turned(proto::TileMesh& mesh, const Upright& upright, const ErrorMeter& meter, double limit_m) {
  return Flipper(mesh, upright, meter, limit_m).run();
}

}  // namespace cordillera::gpu
