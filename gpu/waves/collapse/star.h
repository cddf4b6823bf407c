#pragma once
// The star of a vertex, and the best half-edge collapse out of it.
//
// Cost: the memoryless vertical quadric (Lindstrom & Turk 1998, "memoryless"; distance taken along the vertical): the sum over
// the star's triangles of area x (height difference)^2, evaluated at the target, plus what the vertex already carries. Validity:
// exact orientation. A straight-line triangulation whose triangles all keep positive plan area cannot get a doubled edge, so this
// replaces the link test.
//
// Holes are vertex labels: a triangle is published iff no corner is void. A valid vertex may only collapse onto a valid one, so
// what is published stays published and what is not stays not, whatever moves. A rim vertex moves along its rim, within the rim
// budget.
//
// A device walks around a star anew for every question, so that it needs few registers; a host core copies the corners once.
#include <cmath>

#include "gpu/mesh/vertical_quadric.h"
#include "gpu/waves/collapse/window.h"

namespace cordillera::gpu {

CORDILLERA_HD inline std::int64_t cross(std::int32_t ax, std::int32_t ay, std::int32_t bx, std::int32_t by) {
  return static_cast<std::int64_t>(ax) * by - static_cast<std::int64_t>(ay) * bx;
}
CORDILLERA_HD inline float cross(float ax, float ay, float bx, float by) { return ax * by - ay * bx; }

/// The star of u. Coordinate: see WindowVertex. Triangle i is (u, i, after(i)) for every i < triangles.
/// kInside: in a window of which WindowView::inside is true.
template <class Coordinate, bool kInside = false>
struct Star {
  /// A neighbour, relative to u.
  struct Corner {
    Coordinate x, y;
    float rise;  ///< metres above u
    VertexInfo info;
  };

  WindowView w;
  int u = 0;
  WindowVertex centre;
  float cells_per_unit = 1;
  int count = 0;
  int triangles = 0;
  std::uint32_t valid = 0;      ///< neighbours that are not void, a bit each
  std::uint32_t published = 0;  ///< triangles that exist, a bit each
  std::uint32_t rim = 0;        ///< neighbours at the end of a rim edge (tile border included), a bit each

  CORDILLERA_HD Star(const WindowView& window, int vertex, float scale)
      : w(window), u(vertex), centre(window.vertex[vertex]), cells_per_unit(scale), count(centre.info.valence()) {
    triangles = on_side() ? count - 1 : count;
#ifndef __CUDA_ARCH__
    for (int i = 0; i < count; ++i) corners[i] = look(i);
#endif
  }
#ifdef __CUDA_ARCH__
  CORDILLERA_HD Corner corner(int i) const { return look(i); }
#else
  Corner corner(int i) const { return corners[i]; }
  Corner corners[kRowWidth];
#endif
  CORDILLERA_HD Corner look(int i) const {
    const WindowVertex v = w.vertex[w.neighbour(u, i)];
    return {v.x<Coordinate>() - centre.x<Coordinate>(), v.y<Coordinate>() - centre.y<Coordinate>(),
            v.elevation - centre.elevation, v.info};
  }
  CORDILLERA_HD int after(int i) const { return i + 1 == count ? 0 : i + 1; }
  CORDILLERA_HD bool on_side() const { return !kInside && centre.info.has(kOnSide); }
  CORDILLERA_HD bool nowhere() const { return !kInside && centre.info.has(proto::kVoid); }
  CORDILLERA_HD bool is_published(int triangle) const { return kInside || ((published >> triangle) & 1u) != 0; }

  CORDILLERA_HD float cells(float c) const { return c; }
  CORDILLERA_HD float cells(std::int32_t units) const { return cells_per_unit * static_cast<float>(units); }
  CORDILLERA_HD float square_cells(float area) const { return area; }
  CORDILLERA_HD float square_cells(std::int64_t area) const { return cells_per_unit * cells_per_unit * static_cast<float>(area); }

  /// To be called with `valid` complete.
  CORDILLERA_HD void find_rim() {
    if (nowhere()) return;
    const bool open = on_side();
    const std::uint32_t wrap = open ? 0 : (valid & 1u) << (count - 1);
    published = valid & ((valid >> 1) | wrap) & ((1u << triangles) - 1);
    const std::uint32_t before = (published << 1) | (open ? 0 : (published >> (count - 1)) & 1u);
    rim = (published ^ before) & ((1u << count) - 1);
  }
};

/// Finds the labels of the star and the quadric of its published triangles.
template <class Coordinate, bool kInside>
CORDILLERA_HD inline VerticalQuadric survey(Star<Coordinate, kInside>& s) {
  VerticalQuadric q;
  typename Star<Coordinate, kInside>::Corner a = s.corner(0);
  for (int i = 0; i < s.count; ++i) {
    const bool here = kInside || !a.info.has(proto::kVoid);
    if (!kInside && here) s.valid |= 1u << i;
    if (i == s.triangles) break;
    const typename Star<Coordinate, kInside>::Corner b = s.corner(s.after(i));
    if (here && !s.nowhere() && (kInside || !b.info.has(proto::kVoid))) {
      q.add(s.cells(a.x), s.cells(a.y), a.rise, s.cells(b.x), s.cells(b.y), b.rise);
    }
    a = b;
  }
  if (kInside)
    s.valid = s.published = (1u << s.count) - 1;
  else
    s.find_rim();
  return q;
}

/// Neighbours that u may collapse onto, a bit each. Labels decide; on the tile's border, so does the straight side.
template <class Coordinate, bool kInside>
CORDILLERA_HD inline std::uint32_t allowed_targets(const Star<Coordinate, kInside>& s) {
  const std::uint32_t all = (1u << s.count) - 1;
  if (kInside) return all;
  const bool nowhere = s.nowhere();
  if (s.centre.info.has(kOnSide)) {
    const std::uint32_t along = 1u | (1u << (s.count - 1));
    const std::uint32_t same = along & (nowhere ? ~s.valid : s.valid);
    return same ? same : along;  // a run of one label that the chain dropped goes with its last vertex
  }
  if (nowhere) {
    const std::uint32_t voids = all & ~s.valid;
    return voids ? voids : all;  // the last void vertex of a hole: closing it is for the rim budget to allow
  }
  if (s.published == 0) return all;  // carries no triangle: nothing is lost with it
  return s.rim ? s.rim : all;
}

/// u moves onto neighbour b, triangle by triangle: do all of them keep positive area, and where in the new surface does u come to
/// lie?
template <class Coordinate, bool kInside>
struct Trial {
  using Corner = typename Star<Coordinate, kInside>::Corner;
  using Area = decltype(cross(Coordinate{}, Coordinate{}, Coordinate{}, Coordinate{}));

  int b = -1;  ///< -1: no neighbour
  int at = 0;  ///< triangle to look at
  Corner to, here;
  Area here_from_to;  ///< twice the area of (u, to, here): of one triangle it is one side's, of the next the other's
  // The new triangle over u is (b, i, after(i)): its weights at u and the rises of the last two. No weight: no published triangle
  // is.
  float weight_b = 0, weight_here = 0, weight_next = 0, rise_here = 0, rise_next = 0;

  CORDILLERA_HD Trial(const Star<Coordinate, kInside>& s, int slot)
      : b(slot), to(s.corner(slot < 0 ? 0 : slot)), here(s.corner(0)), here_from_to(cross(to.x, to.y, here.x, here.y)) {}

  /// False if the triangle turns over.
  CORDILLERA_HD bool step(const Star<Coordinate, kInside>& s) {
    const int after = s.after(at);
    const Corner next = s.corner(after);
    const bool vanishes = at == b || after == b;
    if (!vanishes && cross(here.x - to.x, here.y - to.y, next.x - to.x, next.y - to.y) <= 0) return false;
    const Area next_from_to = cross(to.x, to.y, next.x, next.y);
    if (s.is_published(at) && here_from_to >= 0 && next_from_to <= 0) {  // where two triangles share u, the last counts
      weight_b = static_cast<float>(cross(here.x, here.y, next.x, next.y));
      weight_here = static_cast<float>(-next_from_to);
      weight_next = static_cast<float>(here_from_to);
      rise_here = here.rise;
      rise_next = next.rise;
    }
    here = next;
    here_from_to = next_from_to;
    ++at;
    return true;
  }
  /// How far u lies, along the vertical, from the new surface. 0 where nothing published covers it any more.
  CORDILLERA_HD float height() const {
    const float lift = weight_b * to.rise + weight_here * rise_here + weight_next * rise_next;
    if (lift == 0) return 0;
    const float h = lift / (weight_b + weight_here + weight_next);
    return h < 0 ? -h : h;
  }
};

/// Distance in cells of u (the origin) from the segment between two neighbours.
template <class Coordinate, bool kInside>
CORDILLERA_HD inline float segment_distance(const Star<Coordinate, kInside>& s, int from, int to) {
  const typename Star<Coordinate, kInside>::Corner a = s.corner(from), b = s.corner(to);
  const float ax = s.cells(a.x), ay = s.cells(a.y), ex = s.cells(b.x - a.x), ey = s.cells(b.y - a.y);
  const float length2 = ex * ex + ey * ey;
  const float along = -(ax * ex + ay * ey);
  if (along <= 0) return sqrtf(ax * ax + ay * ay);
  if (along >= length2) {
    const float bx = s.cells(b.x), by = s.cells(b.y);
    return sqrtf(bx * bx + by * by);
  }
  const float area = s.square_cells(cross(a.x, a.y, b.x, b.y));
  return (area < 0 ? -area : area) / sqrtf(length2);
}

/// How far the rim moves, in cells, when u collapses onto b: its rim edges swing from u to b. A hole that closes moves by its
/// radius.
template <class Coordinate, bool kInside>
CORDILLERA_HD inline float rim_deviation(const Star<Coordinate, kInside>& s, int b) {
  float deviation = 0;
  const bool closes = s.centre.info.has(proto::kVoid);
  if (closes && !((s.valid >> b) & 1u)) return 0;
  for (int i = 0; i < s.count; ++i) {
    float distance = 0;
    if (closes) {
      const typename Star<Coordinate, kInside>::Corner a = s.corner(i);
      const float ax = s.cells(a.x), ay = s.cells(a.y);
      distance = sqrtf(ax * ax + ay * ay);
    } else if (((s.rim >> i) & 1u) && i != b) {
      distance = segment_distance(s, b, i);
    }
    deviation = distance > deviation ? distance : deviation;
  }
  return deviation;
}

/// Finds u's best collapse and writes its key, target and the budget the target would have spent.
template <class Coordinate, bool kInside = false>
struct Evaluate {
  struct Choice {
    int slot = -1;
    float cost = INFINITY;
  };

  WindowView w;
  Rules rules;

  CORDILLERA_HD void operator()(int u) const {
    const float carried = w.carried[u], spent = w.spent[u];  // far away on a device: asked for first
    Star<Coordinate, kInside> s(w, u, rules.cells_per_unit);
    w.key[u] = kBlocked;
    if (s.count == 0) return;
    const VerticalQuadric quadric = survey(s);
    Choice best, second;
    rank_targets(s, quadric, carried, best, second);
    const bool must = !kInside && s.centre.info.has(proto::kRemove);
    for (Trial<Coordinate, kInside> trial(s, best.slot); trial.b >= 0; trial = next(s, best, second)) {
      // Both choices in one loop: lanes of a warp that try again do so while others are at their first.
      while (trial.b >= 0 && trial.at < s.triangles) {
        if (!trial.step(s)) trial = next(s, best, second);
      }
      if (trial.b < 0) return;
      const float rim = rim_share(s, trial), after = spent + larger(rim, height_share(s, trial));
      // What must go need not spare the heights, but still the rims.
      if (after <= 1.0f || (must && rim <= 1.0f)) {
        // First of all, while the inside is still dense enough to close the gap; among themselves by cost.
        float cost = must ? 1e-6f * rules.cost * (best.cost / (best.cost + rules.cost)) : best.cost;
        // However large its star: what hardly moves the surface is never too costly.
        if (rules.inverse_guard > 0 && after < kFreeShare && cost > rules.cost) cost = rules.cost;
        w.key[u] = cost_key(cost) | s.centre.info.hash();
        w.target[u] = static_cast<std::uint16_t>(w.neighbour(u, trial.b));
        w.spent_after[u] = after;
        return;
      }
    }
  }

 private:
  /// The two cheapest targets; of equals the first. A third best hardly ever helps and costs every vertex.
  CORDILLERA_HD void rank_targets(const Star<Coordinate, kInside>& s, const VerticalQuadric& quadric, float carried, Choice& best,
                                  Choice& second) const {
    const std::uint32_t allowed = allowed_targets(s);
    const bool on_side = s.on_side();
    for (int i = 0; i < s.count; ++i) {
      const typename Star<Coordinate, kInside>::Corner c = s.corner(i);
      const float px = s.cells(c.x), py = s.cells(c.y);
      float cost = s.published ? quadric.at(px, py, c.rise) + carried : 0.0f;
      cost += 1e-6f * (px * px + py * py);  // among equals, the shortest edge
      // Both on the tile's border share one triangle, else two.
      const int gain = s.count - (on_side ? 3 : 4);
      const bool full = kInside ? gain > 0 && c.info.valence() + gain > kInnerValence : !has_room(c.info, gain);
      // What must go takes no more in: its own star must stay small enough to be closed.
      const bool leaving = !kInside && c.info.has(proto::kRemove) && !on_side;
      if ((!kInside && !((allowed >> i) & 1u)) || full || leaving) continue;
      if (cost < best.cost) {
        second = best;
        best = {i, cost};
      } else if (cost < second.cost) {
        second = {i, cost};
      }
    }
  }

  CORDILLERA_HD static Trial<Coordinate, kInside> next(const Star<Coordinate, kInside>& s, Choice& best, Choice& second) {
    best = second;
    second = {};
    return {s, best.slot};
  }
  CORDILLERA_HD static float larger(float a, float b) { return a > b ? a : b; }
  /// Shares of the budgets that the collapse would spend.
  CORDILLERA_HD float height_share(const Star<Coordinate, kInside>& s, const Trial<Coordinate, kInside>& trial) const {
    return rules.inverse_guard > 0 && s.published ? trial.height() * rules.inverse_guard : 0.0f;
  }
  CORDILLERA_HD float rim_share(const Star<Coordinate, kInside>& s, const Trial<Coordinate, kInside>& trial) const {
    if (kInside) return 0;
    const bool on_rim = s.rim != 0 || (s.centre.info.has(proto::kVoid) && s.valid != 0);
    return on_rim ? rim_deviation(s, trial.b) / rules.cells_per_unit * rules.inverse_rim : 0.0f;
  }
};

}  // namespace cordillera::gpu
