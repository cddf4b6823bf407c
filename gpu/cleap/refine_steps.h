#pragma once
// What section 6.2 would do to the mesh besides collapses: edges flipped until they are Delaunay in the plan (the library's own
// parallel flips, section 2.1.2), and Taubin's smoothing (section 2.1.1).
//
// A round of flips: edges that want to flip ask for their two triangles, the lowest number gets them; those that got both flip;
// then every edge looks whether what it says of its triangles is still so, and corrects itself. Rows of the table are not kept:
// it is made anew afterwards.
#include "gpu/cleap/integrity_tests.h"
#include "gpu/cleap/lock_down.h"

namespace cordillera::gpu::cleap {

struct FreeFlags {
  Arrays mesh;
  CORDILLERA_HD void operator()(std::size_t t) const { mesh.flag[t] = kFree; }
};

/// By edge.
struct WantFlip {
  Arrays mesh;
  std::uint8_t* wants;
  CORDILLERA_HD void operator()(std::size_t e) const {
    const Edge& edge = mesh.edge[e];
    wants[e] = edge.n[0] >= 0 && edge.b[0] >= 0 && would_gain(edge) ? 1 : 0;
    if (!wants[e]) return;
    lower_flag(mesh.flag + edge.a[0] / 3, static_cast<std::uint32_t>(e));
    lower_flag(mesh.flag + edge.b[0] / 3, static_cast<std::uint32_t>(e));
  }

 private:
  /// The corner opposite lies in the other triangle's circle, and the four corners are convex. Near ties stay as they are, lest
  /// two edges flip for ever.
  CORDILLERA_HD bool would_gain(const Edge& edge) const {
    const Position &p = mesh.vertex[edge.n[0]], &q = mesh.vertex[edge.n[1]];
    const Position &r = mesh.vertex[mesh.corner[edge.op[0]]], &s = mesh.vertex[mesh.corner[edge.op[1]]];
    const int side = turn_of(p, q, r);
    if (side == 0 || turn_of(p, s, r) != side || turn_of(q, r, s) != side) return false;
    const double px = p.x - s.x, py = p.y - s.y, qx = q.x - s.x, qy = q.y - s.y, rx = r.x - s.x, ry = r.y - s.y;
    const double p2 = px * px + py * py, q2 = qx * qx + qy * qy, r2 = rx * rx + ry * ry;
    const double one = p2 * (qx * ry - rx * qy), two = q2 * (px * ry - rx * py), three = r2 * (px * qy - qx * py);
    const double inside = (one - two + three) * side;
    constexpr double kTie = 1e-12;
    return inside > kTie * ((one < 0 ? -one : one) + (two < 0 ? -two : two) + (three < 0 ? -three : three));
  }
};

/// By edge, after all have asked. partner: indexed by triangle, the other one of its flip; -1: it is as it was.
struct Flip {
  Arrays mesh;
  const std::uint8_t* wants;
  std::int32_t* partner;
  std::uint32_t* flips;
  CORDILLERA_HD void operator()(std::size_t e) const {
    Edge& edge = mesh.edge[e];
    if (!wants[e]) return;
    const std::int32_t first = edge.a[0] / 3, second = edge.b[0] / 3;
    const auto me = static_cast<std::uint32_t>(e);
    if (mesh.flag[first] != me || mesh.flag[second] != me) return;
    const Edge old = edge;
    const std::int32_t r = mesh.corner[old.op[0]], s = mesh.corner[old.op[1]];
    mesh.corner[old.a[1]] = s;
    mesh.corner[old.b[0]] = r;
    edge = {{r, s}, {old.op[0], old.a[1]}, {old.b[0], old.op[1]}, {old.a[0], old.b[1]}};
    partner[first] = second;
    partner[second] = first;
    raise_to(flips, 1);
  }
};

/// By edge: sides that moved over with a flip. The one that flipped is right already.
struct FollowFlip {
  Arrays mesh;
  const std::int32_t* partner;
  CORDILLERA_HD void operator()(std::size_t e) const {
    Edge& edge = mesh.edge[e];
    if (edge.n[0] < 0) return;
    follow(edge, edge.a, edge.op);
    if (edge.b[0] >= 0) follow(edge, edge.b, edge.op + 1);
  }

 private:
  CORDILLERA_HD void follow(const Edge& edge, std::int32_t* side, std::int32_t* op) const {
    if (mesh.corner[side[0]] == edge.n[0] && mesh.corner[side[1]] == edge.n[1]) return;
    const std::int32_t triangle = partner[side[0] / 3], *const corner = mesh.corner + 3 * triangle;
    std::int32_t place[2] = {0, 0};
    for (int k = 0; k < 2; ++k) {
      while (corner[place[k]] != edge.n[k]) ++place[k];
      side[k] = 3 * triangle + place[k];
    }
    *op = 3 * triangle + 3 - place[0] - place[1];
  }
};
struct ForgetPartner {
  std::int32_t* partner;
  CORDILLERA_HD void operator()(std::size_t t) const { partner[t] = -1; }
};

/// By vertex: a step towards the mean of the neighbours, or away from it where factor is negative. The border stays.
struct Smooth {
  Arrays mesh;
  double factor;
  Position* to;
  CORDILLERA_HD void operator()(std::size_t at) const {
    const auto v = static_cast<std::int32_t>(at);
    const Position p = mesh.vertex[v];
    to[v] = p;
    if (mesh.border[v] || mesh.is_gone(v)) return;
    double x = 0, y = 0, z = 0, count = 0;
    all_triangles_at(mesh, v, [&](std::int32_t triangle) {
      for (int k = 0; k < 3; ++k) {
        const std::int32_t w = mesh.corner[3 * triangle + k];
        if (w == v) continue;
        x += mesh.vertex[w].x - p.x;
        y += mesh.vertex[w].y - p.y;
        z += mesh.vertex[w].z - p.z;
        count += 1;
      }
      return true;
    });
    if (count > 0) to[v] = {p.x + factor * x / count, p.y + factor * y / count, p.z + factor * z / count};
  }
};

}  // namespace cordillera::gpu::cleap
