// Points: C. Lawson, "Software for C1 surface interpolation", 1977. Lines: S. Sloan, "A fast algorithm for generating constrained
// Delaunay triangulations", 1993.
#include "pipeline/faces/quantized_mesh/plane_triangulation.h"

#include <deque>

#include "gpu/mesh/mesh_point.h"
#include "gpu/mesh/triangle_neighbours.h"

namespace cordillera::pipeline::faces {
namespace {

using gpu::after;
using gpu::before;

}  // namespace

PlaneTriangulation::PlaneTriangulation(std::int32_t size)
    : points_{{0, 0}, {size, 0}, {size, size}, {0, size}}, face_at_{0, 0, 0, 1} {
  faces_ = {{{0, 1, 2}, {kNone, kNone, 1}, {}}, {{0, 2, 3}, {0, kNone, kNone}, {}}};
}

std::int64_t PlaneTriangulation::turn(std::uint32_t a, std::uint32_t b, Point p) const {
  return gpu::twice_area(points_[a], points_[b], p);
}

bool PlaneTriangulation::in_circle(std::uint32_t a, std::uint32_t b, std::uint32_t c, std::uint32_t d) const {
  const Point& o = points_[d];
  std::array<std::int64_t, 3> x{}, y{};
  std::array<__int128, 3> lift{};
  for (std::size_t k = 0; const std::uint32_t v : {a, b, c}) {
    x[k] = points_[v].x - o.x;
    y[k] = points_[v].y - o.y;
    lift[k] = x[k] * x[k] + y[k] * y[k];
    ++k;
  }
  return lift[0] * (x[1] * y[2] - x[2] * y[1]) + lift[1] * (x[2] * y[0] - x[0] * y[2]) + lift[2] * (x[0] * y[1] - x[1] * y[0]) >
         0;
}

PlaneTriangulation::Half PlaneTriangulation::twin(Half half) const {
  const std::uint32_t other = faces_[half.face].beside[half.edge];
  if (other == kNone) return {};
  const std::uint32_t end = faces_[half.face].vertex[after(half.edge)];
  for (std::uint32_t k = 0; k < 3; ++k) {
    if (faces_[other].vertex[k] == end) return {other, k};
  }
  return {};
}

// Across edges that have the point on their other side: in a Delaunay triangulation that comes to an end.
std::uint32_t PlaneTriangulation::locate(Point p) const {
  std::uint32_t face = last_;
  for (bool moved = true; moved;) {
    moved = false;
    for (std::uint32_t k = 0; k < 3 && !moved; ++k) {
      const Face& f = faces_[face];
      if (turn(f.vertex[k], f.vertex[after(k)], p) >= 0) continue;
      face = f.beside[k];
      moved = true;
    }
  }
  return last_ = face;
}

void PlaneTriangulation::link(std::uint32_t face, std::uint32_t edge, std::uint32_t other) {
  faces_[face].beside[edge] = other;
  if (other == kNone) return;
  const Half back = [&] {
    const std::uint32_t end = faces_[face].vertex[after(edge)];
    for (std::uint32_t k = 0; k < 2; ++k) {
      if (faces_[other].vertex[k] == end) return Half{other, k};
    }
    return Half{other, 2};
  }();
  faces_[other].beside[back.edge] = face;
}

std::uint32_t PlaneTriangulation::add(Point point) {
  const std::uint32_t face = locate(point);
  const Face f = faces_[face];
  for (const std::uint32_t v : f.vertex) {
    if (points_[v] == point) return v;
  }
  for (std::uint32_t k = 0; k < 3; ++k) {
    if (turn(f.vertex[k], f.vertex[after(k)], point) == 0) return split_edge({face, k}, point);
  }
  return split_face(face, point);
}

std::uint32_t PlaneTriangulation::split_face(std::uint32_t face, Point p) {
  const auto v = static_cast<std::uint32_t>(points_.size());
  const auto second = static_cast<std::uint32_t>(faces_.size()), third = second + 1;
  const Face old = faces_[face];
  points_.push_back(p);
  face_at_.push_back(face);
  faces_[face].vertex = {old.vertex[0], old.vertex[1], v};
  faces_.push_back({{old.vertex[1], old.vertex[2], v}, {kNone, third, face}, {}});
  faces_.push_back({{old.vertex[2], old.vertex[0], v}, {kNone, face, second}, {}});
  faces_[face].beside = {old.beside[0], second, third};
  link(second, 0, old.beside[1]);
  link(third, 0, old.beside[2]);
  face_at_[old.vertex[0]] = face_at_[old.vertex[1]] = face;
  face_at_[old.vertex[2]] = second;
  legalize({{face, 0}, {second, 0}, {third, 0}});
  return v;
}

std::uint32_t PlaneTriangulation::split_edge(Half half, Point p) {
  const auto v = static_cast<std::uint32_t>(points_.size());
  const Half other = twin(half);
  points_.push_back(p);
  face_at_.push_back(half.face);
  // One side: a, b, c with p on ab becomes a, p, c and p, b, c.
  const auto halve = [&](Half h) {
    const auto fresh = static_cast<std::uint32_t>(faces_.size());
    const Face old = faces_[h.face];
    const std::uint32_t a = old.vertex[h.edge], b = old.vertex[after(h.edge)], c = old.vertex[before(h.edge)];
    faces_[h.face] = {{a, v, c}, {kNone, fresh, old.beside[before(h.edge)]}, {}};
    faces_.push_back({{v, b, c}, {kNone, kNone, h.face}, {}});
    link(fresh, 1, old.beside[after(h.edge)]);
    face_at_[a] = face_at_[c] = h.face;
    face_at_[b] = fresh;
    return fresh;
  };
  const std::uint32_t fresh = halve(half);
  std::vector<Half> doubtful = {{half.face, 2}, {fresh, 1}};
  if (other.face != kNone) {
    const std::uint32_t opposite = halve(other);
    link(half.face, 0, opposite);
    link(fresh, 0, other.face);
    doubtful.insert(doubtful.end(), {{other.face, 2}, {opposite, 1}});
  }
  legalize(std::move(doubtful));
  return v;
}

// ab with c on this side and d on the other becomes cd.
void PlaneTriangulation::flip(Half half) {
  const Half other = twin(half);
  const Face f = faces_[half.face], g = faces_[other.face];
  const std::uint32_t k = half.edge, j = other.edge;
  const std::uint32_t a = f.vertex[k], b = f.vertex[after(k)], c = f.vertex[before(k)], d = g.vertex[before(j)];
  faces_[half.face] = {{c, a, d}, {kNone, kNone, other.face}, {f.fixed[before(k)], g.fixed[after(j)], false}};
  faces_[other.face] = {{d, b, c}, {kNone, kNone, half.face}, {g.fixed[before(j)], f.fixed[after(k)], false}};
  link(half.face, 0, f.beside[before(k)]);
  link(half.face, 1, g.beside[after(j)]);
  link(other.face, 0, g.beside[before(j)]);
  link(other.face, 1, f.beside[after(k)]);
  face_at_[a] = face_at_[c] = face_at_[d] = half.face;
  face_at_[b] = other.face;
}

void PlaneTriangulation::legalize(std::vector<Half> doubtful) {
  while (!doubtful.empty()) {
    const Half half = doubtful.back();
    doubtful.pop_back();
    const Half other = twin(half);
    if (other.face == kNone) continue;
    const Triangle& t = faces_[half.face].vertex;
    if (!in_circle(t[0], t[1], t[2], faces_[other.face].vertex[before(other.edge)])) continue;
    flip(half);
    // The edges of the quadrilateral that do not end in the new vertex, whichever it was, and for good measure those that do.
    doubtful.insert(doubtful.end(), {{half.face, 0}, {half.face, 1}, {other.face, 0}, {other.face, 1}});
  }
}

template <class Visit>
void PlaneTriangulation::around(std::uint32_t vertex, const Visit& visit) const {
  const auto place = [&](std::uint32_t face) {
    const Triangle& t = faces_[face].vertex;
    return t[0] == vertex ? 0U : t[1] == vertex ? 1U : 2U;
  };
  const std::uint32_t first = face_at_[vertex];
  std::uint32_t face = first;
  do {
    if (visit(Half{face, place(face)})) return;
    face = faces_[face].beside[before(place(face))];
  } while (face != first && face != kNone);
  if (face == first) return;
  for (face = faces_[first].beside[place(first)]; face != kNone; face = faces_[face].beside[place(face)]) {
    if (visit(Half{face, place(face)})) return;
  }
}

PlaneTriangulation::Half PlaneTriangulation::find_edge(std::uint32_t a, std::uint32_t b) const {
  Half found;
  around(a, [&](Half h) {
    const Triangle& t = faces_[h.face].vertex;
    if (t[after(h.edge)] == b) {
      found = h;
    } else if (t[before(h.edge)] == b)
      found = {h.face, before(h.edge)};
    return found.face != kNone;
  });
  return found;
}

void PlaneTriangulation::march(Half crossing, std::uint32_t from, std::uint32_t to, Step* step) const {
  while (true) {
    const Face& f = faces_[crossing.face];
    if (f.fixed[crossing.edge]) {
      step->met = Met::wall;
      return;
    }
    step->crossed.push_back({f.vertex[crossing.edge], f.vertex[after(crossing.edge)]});
    const Half other = twin(crossing);
    const std::uint32_t apex = faces_[other.face].vertex[before(other.edge)];
    const std::int64_t side = turn(from, to, apex);
    if (side == 0) {
      *step = {Met::crossing, apex, std::move(step->crossed)};
      return;
    }
    // The edge before the apex runs up to it, the one after away from it.
    crossing = {other.face, side > 0 ? after(other.edge) : before(other.edge)};
  }
}

// What lies first on the way: a vertex of the star, or edges up to the next vertex on the line.
PlaneTriangulation::Step PlaneTriangulation::look(std::uint32_t from, std::uint32_t to) const {
  Step step;
  const Point &o = points_[from], &q = points_[to];
  around(from, [&](Half h) {
    const Triangle& t = faces_[h.face].vertex;
    for (const std::uint32_t v : {t[after(h.edge)], t[before(h.edge)]}) {
      const Point& p = points_[v];
      const bool ahead = std::int64_t{q.x - o.x} * (p.x - o.x) + std::int64_t{q.y - o.y} * (p.y - o.y) > 0;
      if (!ahead || turn(from, to, v) != 0) continue;
      step = {Met::vertex, v, {}};
      return true;
    }
    if (turn(from, to, t[after(h.edge)]) >= 0 || turn(from, to, t[before(h.edge)]) <= 0) return false;
    march({h.face, after(h.edge)}, from, to, &step);
    return true;
  });
  return step;
}

void PlaneTriangulation::clear_way(std::uint32_t from, std::uint32_t to, std::vector<std::array<std::uint32_t, 2>> crossed) {
  std::deque<std::array<std::uint32_t, 2>> left(crossed.begin(), crossed.end());
  while (!left.empty()) {
    const auto [a, b] = left.front();
    left.pop_front();
    const Half half = find_edge(a, b), other = twin(half);
    const std::uint32_t c = faces_[half.face].vertex[before(half.edge)], d = faces_[other.face].vertex[before(other.edge)];
    const std::uint32_t start = faces_[half.face].vertex[half.edge], end = faces_[half.face].vertex[after(half.edge)];
    if (turn(d, c, start) <= 0 || turn(d, c, end) >= 0) {  // not convex yet
      left.push_back({a, b});
      continue;
    }
    flip(half);
    const std::int64_t of_c = turn(from, to, c), of_d = turn(from, to, d);
    if ((of_c > 0 && of_d < 0) || (of_c < 0 && of_d > 0)) left.push_back({c, d});
  }
}

void PlaneTriangulation::fix(std::uint32_t a, std::uint32_t b) {
  const Half half = find_edge(a, b);
  faces_[half.face].fixed[half.edge] = true;
  if (const Half other = twin(half); other.face != kNone) faces_[other.face].fixed[other.edge] = true;
}

void PlaneTriangulation::connect(std::uint32_t from, std::uint32_t to) {
  while (from != to) {
    Step step = look(from, to);
    if (step.met == Met::wall) return;
    if (step.met == Met::crossing) clear_way(from, step.vertex, std::move(step.crossed));
    fix(from, step.vertex);
    from = step.vertex;
  }
}

std::vector<PlaneTriangulation::Face> PlaneTriangulation::faces() const {
  // Depth first over common edges.
  std::vector<std::uint32_t> order, place(faces_.size(), kNone), open = {0};
  while (!open.empty()) {
    const std::uint32_t face = open.back();
    open.pop_back();
    if (place[face] != kNone) continue;
    place[face] = static_cast<std::uint32_t>(order.size());
    order.push_back(face);
    for (const std::uint32_t other : faces_[face].beside) {
      if (other != kNone && place[other] == kNone) open.push_back(other);
    }
  }
  std::vector<Face> out;
  out.reserve(order.size());
  for (const std::uint32_t face : order) {
    out.push_back(faces_[face]);
    for (std::uint32_t& other : out.back().beside) other = other == kNone ? kNone : place[other];
  }
  return out;
}

}  // namespace cordillera::pipeline::faces
