#pragma once
// The star of a vertex, and the best half-edge collapse out of it.
//
// Cost: the memoryless vertical quadric (Lindstrom & Turk 1998, "memoryless"; distance taken along the vertical): the sum over the
// star's triangles of area x (height difference)^2, evaluated at the target, plus what the vertex already carries. Validity: exact
// integer orientation. A straight-line triangulation whose triangles all keep positive plan area cannot get a doubled edge, so this
// replaces the link test.
//
// Holes are vertex labels: a triangle is published iff no corner is void. A valid vertex may only collapse onto a valid one, so what
// is published stays published and what is not stays not, whatever moves. A rim vertex moves along its rim, within the rim budget.
#include <cmath>

#include "gpu/window.h"

namespace cordillera::gpu {

CORDILLERA_HD inline std::int64_t cross(std::int32_t ax, std::int32_t ay, std::int32_t bx, std::int32_t by) {
  return static_cast<std::int64_t>(ax) * by - static_cast<std::int64_t>(ay) * bx;
}

/// The star of u, relative to u. Entry `count` repeats entry 0, so that triangle i is (u, i, i + 1) for every i < triangles.
struct Star {
  std::int32_t x[kRowWidth + 1];
  std::int32_t y[kRowWidth + 1];
  float rise[kRowWidth + 1];  ///< metres above u
  int count = 0;
  int triangles = 0;
  std::uint32_t valid = 0;      ///< neighbours that are not void, a bit each
  std::uint32_t published = 0;  ///< triangles that exist, a bit each
  std::uint32_t rim = 0;        ///< neighbours at the end of a rim edge (tile border included), a bit each
};

CORDILLERA_HD inline Star load_star(const WindowView& w, int u) {
  Star s;
  s.count = w.valence[u];
  const bool open = (w.mark[u] & kOnSide) != 0;
  s.triangles = open ? s.count - 1 : s.count;
  const std::int32_t ux = w.x[u], uy = w.y[u];
  const float uz = w.elevation[u];
  CORDILLERA_FOR_ROW(i, s.count) {
    const int v = w.neighbour(u, i);
    s.x[i] = w.x[v] - ux;
    s.y[i] = w.y[v] - uy;
    s.rise[i] = w.elevation[v] - uz;
    if (!(w.mark[v] & proto::kVoid)) s.valid |= 1u << i;
  }
  s.x[s.count] = s.x[0];
  s.y[s.count] = s.y[0];
  s.rise[s.count] = s.rise[0];
  if (w.mark[u] & proto::kVoid) return s;
  const std::uint32_t wrap = open ? 0 : (s.valid & 1u) << (s.count - 1);
  s.published = s.valid & ((s.valid >> 1) | wrap) & ((1u << s.triangles) - 1);
  const std::uint32_t before = (s.published << 1) | (open ? 0 : (s.published >> (s.count - 1)) & 1u);
  s.rim = (s.published ^ before) & ((1u << s.count) - 1);
  return s;
}

/// Sum over the published triangles of area x (distance to the triangle's plane along the vertical)^2, as a quadratic form.
struct Quadric {
  float xx = 0, xy = 0, yy = 0, x = 0, y = 0, one = 0;
  CORDILLERA_HD float at(float px, float py, float rise) const {
    const float cost = 0.5f * (xx * px * px + yy * py * py + one * rise * rise) + (xy * px * py + rise * (x * px + y * py));
    return cost < 0 ? 0 : cost;
  }
};

CORDILLERA_HD inline Quadric star_quadric(const Star& s, float scale) {
  Quadric q;
  CORDILLERA_FOR_ROW(i, s.triangles) {
    if (!((s.published >> i) & 1u)) continue;
    const float ax = scale * static_cast<float>(s.x[i]), ay = scale * static_cast<float>(s.y[i]), az = s.rise[i];
    const float bx = scale * static_cast<float>(s.x[i + 1]), by = scale * static_cast<float>(s.y[i + 1]), bz = s.rise[i + 1];
    const float twice_area = ax * by - ay * bx;
    const float nx = ay * bz - az * by, ny = az * bx - ax * bz;
    const float inverse = 1.0f / twice_area;
    q.xx += nx * nx * inverse;
    q.xy += nx * ny * inverse;
    q.yy += ny * ny * inverse;
    q.x += nx;
    q.y += ny;
    q.one += twice_area;
  }
  return q;
}

/// Neighbours that u may collapse onto, a bit each. Labels decide; on the tile's border, so does the straight side.
CORDILLERA_HD inline std::uint32_t allowed_targets(const Star& s, std::uint8_t mark) {
  const std::uint32_t all = (1u << s.count) - 1;
  if (mark & kOnSide) {
    const std::uint32_t along = 1u | (1u << (s.count - 1));
    const std::uint32_t same = along & ((mark & proto::kVoid) ? ~s.valid : s.valid);
    return same ? same : along;  // a run of one label that the chain dropped goes with its last vertex
  }
  if (mark & proto::kVoid) {
    const std::uint32_t voids = all & ~s.valid;
    return voids ? voids : all;  // the last void vertex of a hole: closing it is for the rim budget to allow
  }
  if (s.published == 0) return all;  // carries no triangle: nothing is lost with it
  return s.rim ? s.rim : all;
}

/// Do all triangles of the star keep positive area when u moves onto neighbour b?
CORDILLERA_HD inline bool keeps_orientation(const Star& s, int b) {
  const int last = s.count - 1;
  bool good = true;
  CORDILLERA_FOR_ROW(i, s.triangles) {
    const bool vanishes = i == b || (b == 0 ? (i == last) : i == b - 1);
    if (!vanishes && cross(s.x[i] - s.x[b], s.y[i] - s.y[b], s.x[i + 1] - s.x[b], s.y[i + 1] - s.y[b]) <= 0) good = false;
  }
  return good;
}

/// How far u lies, along the vertical, from the surface after the collapse onto b. 0 where nothing published covers u any more.
CORDILLERA_HD inline float height_deviation(const Star& s, int b) {
  float deviation = 0;
  CORDILLERA_FOR_ROW(i, s.triangles) {
    if (!((s.published >> i) & 1u)) continue;
    const std::int64_t at_next = cross(s.x[b], s.y[b], s.x[i], s.y[i]);
    const std::int64_t at_here = cross(s.x[i + 1], s.y[i + 1], s.x[b], s.y[b]);
    if (at_next < 0 || at_here < 0) continue;
    const float wb = static_cast<float>(cross(s.x[i], s.y[i], s.x[i + 1], s.y[i + 1]));
    const float wi = static_cast<float>(at_here), wn = static_cast<float>(at_next);
    const float height = (wb * s.rise[b] + wi * s.rise[i] + wn * s.rise[i + 1]) / (wb + wi + wn);
    deviation = height < 0 ? -height : height;
  }
  return deviation;
}

/// Distance in units of u (the origin) from the segment between two neighbours.
CORDILLERA_HD inline float segment_distance(const Star& s, int a, int b) {
  const float ax = static_cast<float>(s.x[a]), ay = static_cast<float>(s.y[a]);
  const float ex = static_cast<float>(s.x[b] - s.x[a]), ey = static_cast<float>(s.y[b] - s.y[a]);
  const float length2 = ex * ex + ey * ey;
  const float along = -(ax * ex + ay * ey);
  if (along <= 0) return sqrtf(ax * ax + ay * ay);
  if (along >= length2) {
    const float bx = static_cast<float>(s.x[b]), by = static_cast<float>(s.y[b]);
    return sqrtf(bx * bx + by * by);
  }
  const float area = static_cast<float>(cross(s.x[a], s.y[a], s.x[b], s.y[b]));
  return (area < 0 ? -area : area) / sqrtf(length2);
}

/// How far the rim moves, in units, when u collapses onto b: its rim edges swing from u to b. A hole that closes moves by its radius.
CORDILLERA_HD inline float rim_deviation(const Star& s, std::uint8_t mark, int b) {
  float deviation = 0;
  if (mark & proto::kVoid) {
    if (!((s.valid >> b) & 1u)) return 0;
    CORDILLERA_FOR_ROW(i, s.count) {
      const float px = static_cast<float>(s.x[i]), py = static_cast<float>(s.y[i]);
      const float distance = sqrtf(px * px + py * py);
      deviation = distance > deviation ? distance : deviation;
    }
    return deviation;
  }
  CORDILLERA_FOR_ROW(i, s.count) {
    if (!((s.rim >> i) & 1u) || i == b) continue;
    const float distance = segment_distance(s, b, i);
    deviation = distance > deviation ? distance : deviation;
  }
  return deviation;
}

/// Finds u's best collapse and writes its key, target and the budget the target would have spent.
struct Evaluate {
  static constexpr int kTries = 2;  // a third best target hardly ever helps and costs every vertex

  WindowView w;
  Rules rules;

  CORDILLERA_HD void operator()(int u) const {
    const Star s = load_star(w, u);
    const std::uint8_t mark = w.mark[u];
    float cost[kRowWidth];
    rank_targets(s, u, cost);
    for (int attempt = 0; attempt < kTries; ++attempt) {
      int best = -1;
      float least = INFINITY;
      CORDILLERA_FOR_ROW(i, s.count) {
        if (cost[i] < least) {
          least = cost[i];
          best = i;
        }
      }
      if (best < 0) break;
      const float rim = rim_share(s, mark, best), after = w.spent[u] + larger(rim, height_share(s, best));
      // What must go need not spare the heights, but still the rims.
      if (keeps_orientation(s, best) && (after <= 1.0f || ((mark & proto::kRemove) && rim <= 1.0f))) {
        // First of all, while the inside is still dense enough to close the gap; among themselves by cost.
        if (mark & proto::kRemove) least = 1e-6f * rules.first_cost * (least / (least + rules.first_cost));
        // However large its star: what hardly moves the surface is never too costly.
        if (rules.inverse_guard > 0 && after < kFreeShare && least > rules.last_cost) least = rules.last_cost;
        w.key[u] = vertex_key(least, w.x[u], w.y[u]);
        w.target[u] = static_cast<std::uint16_t>(w.neighbour(u, best));
        w.spent_after[u] = after;
        return;
      }
      CORDILLERA_FOR_ROW(i, s.count) {
        if (i == best) cost[i] = INFINITY;
      }
    }
    w.key[u] = kBlocked;
  }

 private:
  CORDILLERA_HD void rank_targets(const Star& s, int u, float* cost) const {
    const Quadric q = star_quadric(s, rules.cells_per_unit);
    const std::uint32_t allowed = allowed_targets(s, w.mark[u]);
    const float carried = w.carried[u];
    CORDILLERA_FOR_ROW(i, s.count) {
      const float px = rules.cells_per_unit * static_cast<float>(s.x[i]), py = rules.cells_per_unit * static_cast<float>(s.y[i]);
      float c = s.published ? q.at(px, py, s.rise[i]) + carried : 0.0f;
      c += 1e-6f * (px * px + py * py);  // among equals, the shortest edge
      const int v = w.neighbour(u, i);
      // Both on the tile's border share one triangle, else two.
      const bool full = !has_room(w.mark[v], w.valence[v], s.count - ((w.mark[u] & kOnSide) ? 3 : 4));
      // What must go takes no more in: its own star must stay small enough to be closed.
      const bool leaving = (w.mark[v] & proto::kRemove) && !(w.mark[u] & kOnSide);
      cost[i] = (((allowed >> i) & 1u) && !full && !leaving) ? c : INFINITY;
    }
  }

  CORDILLERA_HD static float larger(float a, float b) { return a > b ? a : b; }
  /// Shares of the budgets that the collapse spends.
  CORDILLERA_HD float height_share(const Star& s, int b) const {
    return rules.inverse_guard > 0 && s.published ? height_deviation(s, b) * rules.inverse_guard : 0.0f;
  }
  CORDILLERA_HD float rim_share(const Star& s, std::uint8_t mark, int b) const {
    const bool on_rim = s.rim != 0 || ((mark & proto::kVoid) && s.valid != 0);
    return on_rim ? rim_deviation(s, mark, b) * rules.inverse_rim : 0.0f;
  }
};

}  // namespace cordillera::gpu
