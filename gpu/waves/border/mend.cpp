#include "gpu/waves/border/mend.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdlib>
#include <utility>
#include <vector>

#include "gpu/waves/border/polygon_fill.h"

namespace cordillera::gpu {
namespace {

using proto::TileMesh;

// How much the mend may change, in the order in which it gives in.
struct Licence {
  std::uint32_t inside = 0;  // cap of inner valences; 0: as asked
  int flips = 0;             // for one border vertex; bounded because flips may go to and fro
  int removals = 0;          // of inner vertices, for one border vertex
  int rings = 0;             // how far from it
};
// No further: taking out all that stands in the way would destroy terrain for the sake of one vertex. Who asked can keep more of
// the surroundings and simplify again.
constexpr std::array<Licence, 4> kLicences{{{0, 0, 0, 0}, {0, 12, 0, 0}, {0, 12, 32, 1}, {kMostValence, 12, 32, 1}}};

class Mender {
 public:
  Mender(Rings& rings, const TileMesh& mesh, const ValenceCaps& caps, float rim_units)
      : rings_(rings), mesh_(mesh), caps_(caps), rim_units_(rim_units) {}

  std::uint32_t run() {
    std::vector<std::uint32_t> left = wanted();
    for (const Licence& licence : kLicences) {
      caps_.inside = std::max(caps_.inside, licence.inside);
      // A vertex that went makes room for others.
      for (std::size_t before = left.size() + 1; !left.empty() && left.size() < before;) {
        before = left.size();
        std::erase_if(left, [&](std::uint32_t v) { return remove_with_relief(v, licence); });
      }
    }
    relax();
    return static_cast<std::uint32_t>(left.size());
  }

 private:
  using Joined = std::array<std::uint32_t, kRowWidth>;  // by sides of a polygon or by diagonals: a bit for each other end

  bool is_void(std::uint32_t v) const { return proto::is_void(mesh_, v); }
  std::uint32_t cap(std::uint32_t v) const { return most_neighbours(mesh_, v, caps_); }

  // Finest positions first, so that the border thins evenly and no star grows long.
  std::vector<std::uint32_t> wanted() const {
    std::vector<std::uint32_t> found;
    for (std::uint32_t v = 0; v < rings_.vertices(); ++v)
      if (rings_.valence[v] > 0 && (mesh_.mark[v] & proto::kRemove) && sides_of(mesh_, v) == 1) found.push_back(v);
    const auto along = [&](std::uint32_t v) {
      return std::countr_zero(static_cast<std::uint32_t>(on_upright(v) ? mesh_.y[v] : mesh_.x[v]));
    };
    std::stable_sort(found.begin(), found.end(), [&](std::uint32_t a, std::uint32_t b) { return along(a) < along(b); });
    return found;
  }
  bool on_upright(std::uint32_t v) const { return mesh_.x[v] == 0 || mesh_.x[v] == mesh_.side; }

  Polygon star_of(std::uint32_t v) const {
    Polygon star;
    const auto ring = rings_.ring(v);
    star.count = static_cast<std::uint32_t>(ring.size());
    for (std::uint32_t k = 0; k < star.count; ++k) {
      star.x[k] = mesh_.x[ring[k]];
      star.y[k] = mesh_.y[ring[k]];
      // The neighbour loses v; the two on the border get each other instead.
      const bool end = rings_.open[v] && (k == 0 || k + 1 == star.count);
      star.budget[k] = static_cast<std::int32_t>(cap(ring[k])) - rings_.valence[ring[k]] + (end ? 0 : 1);
    }
    return star;
  }

  // Collapses along the border keep the labels of the border as they are: those first.
  bool fill(std::uint32_t v, const Polygon& star, Diagonals& diagonals) const {
    const auto ring = rings_.ring(v);
    if (rings_.open[v]) {
      const std::uint32_t last = star.count - 1;
      const bool swap = is_void(ring[0]) != is_void(v) && is_void(ring[last]) == is_void(v);
      if (fill_from(star, swap ? last : 0, diagonals) == Filled::yes && spares_rims(v, star, diagonals)) return true;
      if (fill_from(star, swap ? 0 : last, diagonals) == Filled::yes && spares_rims(v, star, diagonals)) return true;
    }
    return fill_any(star, diagonals) == Filled::yes && spares_rims(v, star, diagonals);
  }

  // Does what is published end where it did before, but for what rims may move? By area over the star's width, and what was
  // published around a vertex with data stays so to the line between the ends of its rim: without that, a slit as long as the
  // star is wide would do.
  bool spares_rims(std::uint32_t v, const Polygon& star, const Diagonals& diagonals) const {
    const auto ring = rings_.ring(v);
    std::uint32_t voids = is_void(v) ? 1 : 0;
    for (const std::uint32_t u : ring) voids += is_void(u) ? 1 : 0;
    if (voids == 0 || voids == ring.size() + 1 || std::isinf(rim_units_)) return true;
    const Joined joined = joined_by(star, diagonals);
    if (!is_void(v) && !keeps_runs(v, star, joined)) return false;
    const std::int64_t before = is_void(v) ? 0 : published_around(v, star);
    const std::int64_t after = published_by(ring, star, joined);
    const auto [west, east] = std::minmax_element(star.x.begin(), star.x.begin() + star.count);
    const auto [south, north] = std::minmax_element(star.y.begin(), star.y.begin() + star.count);
    const double width = static_cast<double>(std::max(*east - *west, *north - *south));
    return static_cast<double>(std::abs(after - before)) <= 2.0 * static_cast<double>(rim_units_) * width;
  }
  // Of every run of published triangles around v: are its ends joined, and v no farther from the line between them than rims may
  // move?
  bool keeps_runs(std::uint32_t v, const Polygon& star, const Joined& joined) const {
    const auto ring = rings_.ring(v);
    const std::uint32_t triangles = star.count - (rings_.open[v] ? 1 : 0);
    const auto published = [&](std::uint32_t k) { return !is_void(ring[k]) && !is_void(ring[(k + 1) % star.count]); };
    for (std::uint32_t k = 0; k < triangles; ++k) {
      const bool starts = published(k) && (k == 0 ? rings_.open[v] != 0 || !published(triangles - 1) : !published(k - 1));
      if (!starts) continue;
      std::uint32_t end = (k + 1) % star.count;
      while ((rings_.open[v] == 0 || end < triangles) && published(end)) end = (end + 1) % star.count;
      const bool side_by_side = ((joined[k] >> end) & 1u) != 0;
      if (!side_by_side || distance_from(v, star, k, end) > static_cast<double>(rim_units_)) return false;
    }
    return true;
  }
  double distance_from(std::uint32_t v, const Polygon& star, std::uint32_t a, std::uint32_t b) const {
    const auto ex = static_cast<double>(star.x[b] - star.x[a]), ey = static_cast<double>(star.y[b] - star.y[a]);
    const auto px = static_cast<double>(mesh_.x[v] - star.x[a]), py = static_cast<double>(mesh_.y[v] - star.y[a]);
    const double along = std::clamp((px * ex + py * ey) / (ex * ex + ey * ey), 0.0, 1.0), dx = px - along * ex,
                 dy = py - along * ey;
    return std::sqrt(dx * dx + dy * dy);
  }
  std::int64_t published_around(std::uint32_t v, const Polygon& star) const {
    const auto ring = rings_.ring(v);
    std::int64_t sum = 0;
    for (std::uint32_t k = 0; k + (rings_.open[v] ? 1 : 0) < star.count; ++k) {
      const std::uint32_t n = (k + 1) % star.count;
      if (is_void(ring[k]) || is_void(ring[n])) continue;
      const std::int64_t x = mesh_.x[v], y = mesh_.y[v];
      sum += (star.x[k] - x) * (star.y[n] - y) - (star.y[k] - y) * (star.x[n] - x);
    }
    return sum;
  }
  static Joined joined_by(const Polygon& star, const Diagonals& diagonals) {
    Joined joined{};
    const auto join = [&](std::uint32_t a, std::uint32_t b) {
      joined[a] |= 1u << b;
      joined[b] |= 1u << a;
    };
    for (std::uint32_t k = 0; k < star.count; ++k) join(k, (k + 1) % star.count);
    for (std::uint32_t d = 0; d < diagonals.count; ++d) join(diagonals.at[d].from, diagonals.at[d].to);
    return joined;
  }
  // Triangles k < m < n of the polygon whose three sides are sides of it or diagonals.
  std::int64_t published_by(std::span<const std::uint32_t> ring, const Polygon& star, const Joined& joined) const {
    std::int64_t sum = 0;
    for (std::uint32_t k = 0; k < star.count; ++k) {
      for (std::uint32_t m = k + 1; m < star.count; ++m) {
        if (!((joined[k] >> m) & 1u)) continue;
        for (std::uint32_t n = m + 1; n < star.count; ++n) {
          if (((joined[k] & joined[m]) >> n & 1u) && !is_void(ring[k]) && !is_void(ring[m]) && !is_void(ring[n]))
            sum += twice_area(star, k, m, n);
        }
      }
    }
    return sum;
  }

  bool remove(std::uint32_t v) {
    const Polygon star = star_of(v);
    Diagonals diagonals;
    if (!fill(v, star, diagonals)) return false;
    const std::vector<std::uint32_t> ring(rings_.ring(v).begin(), rings_.ring(v).end());
    if (rings_.open[v]) diagonals.at[diagonals.count++] = {0, static_cast<std::uint8_t>(star.count - 1)};
    for (std::uint32_t k = 0; k < star.count; ++k) replace(ring, k, v, diagonals);
    rings_.valence[v] = 0;
    return true;
  }

  // In the row of ring[k], v gives way to the other ends of the diagonals at k; seen from there they follow the ring.
  void replace(const std::vector<std::uint32_t>& ring, std::uint32_t k, std::uint32_t v, const Diagonals& diagonals) {
    const auto count = static_cast<std::uint32_t>(ring.size());
    std::array<std::uint32_t, kRowWidth> ends{};
    std::uint32_t found = 0;
    for (std::uint32_t d = 0; d < diagonals.count; ++d) {
      const Diagonal& diagonal = diagonals.at[d];
      if (diagonal.from == k) ends[found++] = (diagonal.to + count - k) % count;
      if (diagonal.to == k) ends[found++] = (diagonal.from + count - k) % count;
    }
    std::sort(ends.begin(), ends.begin() + found);
    for (std::uint32_t e = 0; e < found; ++e) ends[e] = ring[(ends[e] + k) % count];
    put(ring[k], v, {ends.data(), found});
  }

  // Puts others (possibly none) at the place of old in the row of u.
  void put(std::uint32_t u, std::uint32_t old, std::span<const std::uint32_t> others) {
    std::array<std::uint32_t, 2 * kRowWidth> row{};
    std::uint32_t count = 0;
    for (const std::uint32_t w : rings_.ring(u)) {
      if (w != old)
        row[count++] = w;
      else
        count = static_cast<std::uint32_t>(std::copy(others.begin(), others.end(), row.begin() + count) - row.begin());
    }
    std::copy(row.begin(), row.begin() + count, rings_.row(u).begin());
    rings_.valence[u] = static_cast<std::uint8_t>(count);
  }

  bool positive(std::uint32_t a, std::uint32_t b, std::uint32_t c) const {
    const std::int64_t bx = mesh_.x[b] - mesh_.x[a], by = mesh_.y[b] - mesh_.y[a];
    const std::int64_t cx = mesh_.x[c] - mesh_.x[a], cy = mesh_.y[c] - mesh_.y[a];
    return bx * cy - by * cx > 0;
  }

  // The other end of the edge from a to the k-th of its ring, and the corners opposite.
  struct OfEdge {
    std::uint32_t b, c, d;
  };
  OfEdge of_edge(std::uint32_t a, std::uint32_t k) const {
    const auto ring = rings_.ring(a);
    const auto count = static_cast<std::uint32_t>(ring.size());
    return {ring[k], ring[(k + 1) % count], ring[(k + count - 1) % count]};
  }

  // May the edge from a to the k-th of its ring become the other diagonal of its two triangles? Not if other area would be
  // published.
  bool may_flip(std::uint32_t a, std::uint32_t k) const {
    if (rings_.open[a] && (k == 0 || k + 1 == rings_.ring(a).size())) return false;
    const auto [b, c, d] = of_edge(a, k);
    if (!positive(a, d, c) || !positive(d, b, c)) return false;
    if (rings_.valence[c] >= cap(c) || rings_.valence[d] >= cap(d)) return false;
    return int{is_void(a)} + int{is_void(b)} + int{is_void(c)} + int{is_void(d)} != 1;
  }
  bool flip(std::uint32_t a, std::uint32_t k) {
    if (!may_flip(a, k)) return false;
    const auto [b, c, d] = of_edge(a, k);
    put(a, b, {});
    put(b, a, {});
    const std::array<std::uint32_t, 2> at_c{a, d}, at_d{b, c};  // c sees a, then b; d sees b, then a
    put(c, a, at_c);
    put(d, b, at_d);
    return true;
  }

  // How far apart the two diagonals of the quadrilateral around an edge are where they cross in plan, in height steps.
  double apart(std::uint32_t a, std::uint32_t k) const {
    const auto [b, c, d] = of_edge(a, k);
    if (is_void(a) || is_void(b) || is_void(c) || is_void(d)) return 0;  // nobody sees it
    const auto cross = [&](std::uint32_t p, std::uint32_t q, std::uint32_t r) {
      const double qx = mesh_.x[q] - mesh_.x[p], qy = mesh_.y[q] - mesh_.y[p];
      const double rx = mesh_.x[r] - mesh_.x[p], ry = mesh_.y[r] - mesh_.y[p];
      return qx * ry - qy * rx;
    };
    const double along_ab = cross(c, d, a) / (cross(c, d, a) - cross(c, d, b)),
                 along_cd = cross(a, b, c) / (cross(a, b, c) - cross(a, b, d));
    const auto between = [&](std::uint32_t p, std::uint32_t q, double t) {
      return mesh_.height[p] + t * (mesh_.height[q] - mesh_.height[p]);
    };
    return std::abs(between(a, b, along_ab) - between(c, d, along_cd));
  }

  // Turns edges away from vertices with data that have more neighbours than the contract allows, as a weld may leave them: those
  // that change the surface least.
  void relax() {
    for (std::uint32_t v = 0; v < rings_.vertices(); ++v) {
      while (!is_void(v) && rings_.valence[v] > kMostValence) {
        std::vector<std::pair<double, std::uint32_t>> edges;
        for (std::uint32_t k = 0; k < rings_.valence[v]; ++k)
          if (may_flip(v, k)) edges.emplace_back(apart(v, k), k);
        if (edges.empty()) break;
        flip(v, std::min_element(edges.begin(), edges.end())->second);
      }
    }
  }

  // Edges of the full neighbours of v that do not end in v.
  bool flip_near(std::uint32_t v) {
    std::array<std::uint32_t, kRowWidth> ring;  // a copy: a flip may change the row
    const std::size_t count = rings_.valence[v];
    std::copy_n(rings_.ring(v).begin(), count, ring.begin());
    for (std::size_t n = 0; n < count; ++n) {
      const std::uint32_t u = ring[n];
      if (rings_.valence[u] < cap(u)) continue;
      for (std::uint32_t k = 0; k < rings_.valence[u]; ++k)
        if (rings_.ring(u)[k] != v && flip(u, k)) return true;
    }
    return false;
  }

  bool same_label_around(std::uint32_t w) const {
    const auto ring = rings_.ring(w);
    return std::all_of(ring.begin(), ring.end(), [&](std::uint32_t u) { return is_void(u) == is_void(w); });
  }

  bool may_go(std::uint32_t w) const { return !rings_.open[w] && !(mesh_.mark[w] & proto::kKeep) && same_label_around(w); }

  // How far w is inside the side that v is on.
  std::int32_t depth(std::uint32_t v, std::uint32_t w) const {
    return on_upright(v) ? std::abs(mesh_.x[w] - mesh_.x[v]) : std::abs(mesh_.y[w] - mesh_.y[v]);
  }

  // One inner vertex around v, those next to the border first: they stand between the border's far vertices. Where none can go,
  // one around its neighbours, and so on.
  bool remove_inner_near(std::uint32_t v, const Licence& licence) {
    std::vector<std::uint32_t> near{v};
    for (int ring = 0; ring < licence.rings; ++ring) {
      const std::size_t count = near.size();
      for (std::size_t k = 0; k < count; ++k) {
        const auto around = rings_.ring(near[k]);
        near.insert(near.end(), around.begin(), around.end());
      }
      std::sort(near.begin(), near.end(),
                [&](std::uint32_t a, std::uint32_t b) { return std::pair(depth(v, a), a) < std::pair(depth(v, b), b); });
      near.erase(std::unique(near.begin(), near.end()), near.end());
      for (const std::uint32_t w : near)
        if (may_go(w) && remove(w)) return true;
    }
    return false;
  }

  // Ends because every round but the flips takes a vertex away.
  bool remove_with_relief(std::uint32_t v, const Licence& licence) {
    int flips = 0, removals = 0;
    while (!remove(v)) {
      if (flips < licence.flips && flip_near(v))
        ++flips;
      else if (removals < licence.removals && remove_inner_near(v, licence))
        ++removals;
      else
        return false;
    }
    return true;
  }

  Rings& rings_;
  const TileMesh& mesh_;
  ValenceCaps caps_;
  float rim_units_;
};

}  // namespace

std::uint32_t mend(Rings& rings, const TileMesh& mesh, const ValenceCaps& caps, float rim_units) {
  return Mender(rings, mesh, caps, rim_units).run();
}

}  // namespace cordillera::gpu
