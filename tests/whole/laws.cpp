#include "tests/whole/laws.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <sstream>

namespace cordillera::whole {
namespace {

using Triangle = std::array<std::uint32_t, 3>;
using Place = std::pair<std::int64_t, std::int64_t>;  ///< lattice column (modulo the circle) and row

std::string name(const DecodedTile& t) {
  return "tile " + std::to_string(t.tile.z) + "/" + std::to_string(t.tile.x) + "/" + std::to_string(t.tile.y);
}

std::string words(const DecodedTile& t, const Triangle& c) {
  std::ostringstream s;
  for (const std::uint32_t k : c) s << " (" << t.u[k] << ", " << t.v[k] << ")";
  return s.str();
}

/// Twice the signed area of corners a, b and place (u, v).
std::int64_t turn(const DecodedTile& t, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return (std::int64_t{t.u[b]} - t.u[a]) * (std::int64_t{t.v[c]} - t.v[a]) -
         (std::int64_t{t.v[b]} - t.v[a]) * (std::int64_t{t.u[c]} - t.u[a]);
}

/// Whether (u, v) is in the triangle, its edges included.
bool holds(const DecodedTile& t, const Triangle& c, std::int64_t u, std::int64_t v) {
  for (unsigned k = 0; k < 3; ++k) {
    const std::uint32_t a = c[k], b = c[(k + 1) % 3];
    if ((std::int64_t{t.u[b]} - t.u[a]) * (v - t.v[a]) - (std::int64_t{t.v[b]} - t.v[a]) * (u - t.u[a]) < 0) return false;
  }
  return true;
}

Violation broken_index(const DecodedTile& t) {
  if (t.side <= 0 || t.u.size() != t.v.size() || t.u.size() != t.h.size()) return name(t) + ": arrays do not agree";
  for (const Triangle& c : t.triangles)
    for (const std::uint32_t k : c)
      if (k >= t.u.size()) return name(t) + ": corner " + std::to_string(k) + " of " + std::to_string(t.u.size());
  for (std::size_t k = 0; k < t.u.size(); ++k)
    if (t.u[k] < 0 || t.v[k] < 0 || t.u[k] > t.side || t.v[k] > t.side)
      return name(t) + ": vertex (" + std::to_string(t.u[k]) + ", " + std::to_string(t.v[k]) + ") is outside";
  return std::nullopt;
}

/// Convex sets are apart if and only if an edge of one of them parts them.
bool apart(const DecodedTile& t, const Triangle& a, const Triangle& b) {
  const auto parts = [&](const Triangle& p, const Triangle& q) {
    for (unsigned k = 0; k < 3; ++k) {
      const std::uint32_t i = p[k], j = p[(k + 1) % 3];
      if (turn(t, i, j, q[0]) <= 0 && turn(t, i, j, q[1]) <= 0 && turn(t, i, j, q[2]) <= 0) return true;
    }
    return false;
  };
  return parts(a, b) || parts(b, a);
}

/// Pairs are looked for in a grid of bins; only pairs that meet in a bin can overlap.
Violation overlap(const DecodedTile& t) {
  const auto across = static_cast<std::int64_t>(std::clamp(std::sqrt(static_cast<double>(t.triangles.size())), 1.0, 512.0));
  const auto bin_of = [&](std::int32_t at) { return std::min<std::int64_t>(at * across / t.side, across - 1); };
  std::vector<std::vector<std::uint32_t>> bins(static_cast<std::size_t>(across * across));
  for (std::uint32_t k = 0; k < t.triangles.size(); ++k) {
    const Triangle& c = t.triangles[k];
    const auto [west, east] = std::minmax({t.u[c[0]], t.u[c[1]], t.u[c[2]]});
    const auto [south, north] = std::minmax({t.v[c[0]], t.v[c[1]], t.v[c[2]]});
    for (std::int64_t j = bin_of(south); j <= bin_of(north); ++j) {
      for (std::int64_t i = bin_of(west); i <= bin_of(east); ++i) {
        auto& bin = bins[static_cast<std::size_t>(j * across + i)];
        for (const std::uint32_t other : bin)
          if (!apart(t, c, t.triangles[other]))
            return name(t) + ": triangles" + words(t, t.triangles[other]) + " and" + words(t, c) + " overlap";
        bin.push_back(k);
      }
    }
  }
  return std::nullopt;
}

bool on_side(const DecodedTile& t, std::uint32_t a, std::uint32_t b) {
  return (t.u[a] == t.u[b] && (t.u[a] == 0 || t.u[a] == t.side)) || (t.v[a] == t.v[b] && (t.v[a] == 0 || t.v[a] == t.side));
}

/// One vertex's triangles, as (next, previous) corners: followed from neighbour to neighbour, do they make one fan?
bool one_fan(const std::vector<std::pair<std::uint32_t, std::uint32_t>>& around) {
  std::map<std::uint32_t, std::uint32_t> next;
  for (const auto& [from, to] : around) next[from] = to;
  if (next.size() != around.size()) return false;
  std::uint32_t start = around.front().first;
  for (const auto& [from, to] : around)  // an open fan begins where nobody arrives
    if (std::none_of(around.begin(), around.end(), [f = from](const auto& other) { return other.second == f; })) start = from;
  std::size_t steps = 0;
  for (std::uint32_t at = start; steps < around.size(); ++steps) {
    const auto found = next.find(at);
    if (found == next.end()) return false;
    at = found->second;
    if (at == start && steps + 1 < around.size()) return false;
  }
  return true;
}

/// Vertices of a tile by place on the earth. Columns modulo the circle.
std::map<Place, std::int32_t> places(const DecodedTile& t) {
  std::map<Place, std::int32_t> found;
  const std::int64_t circle = std::int64_t{t.side} * proto::tiles_across(t.tile.z);
  for (std::size_t k = 0; k < t.u.size(); ++k) {
    const std::int64_t i = (std::int64_t{t.tile.x} * t.side + t.u[k]) % circle, j = std::int64_t{t.tile.y} * t.side + t.v[k];
    const bool border = t.u[k] == 0 || t.v[k] == 0 || t.u[k] == t.side || t.v[k] == t.side;
    if (border) found.emplace(Place{i, j}, t.h[k]);
  }
  return found;
}

/// Is the place on the tile's rectangle?
bool touches(const DecodedTile& t, const Place& p) {
  const std::int64_t circle = std::int64_t{t.side} * proto::tiles_across(t.tile.z);
  const std::int64_t i = ((p.first - std::int64_t{t.tile.x} * t.side) % circle + circle) % circle,
                     j = p.second - std::int64_t{t.tile.y} * t.side;
  return i <= t.side && j >= 0 && j <= t.side;
}

std::string words(const Place& p) {
  std::ostringstream s;
  s << "(" << p.first << ", " << p.second << ")";
  return s.str();
}

/// A vertex of b strictly inside an edge of a on the tile's side.
Violation inside_edge(const DecodedTile& a, const DecodedTile& b) {
  const std::int64_t circle = std::int64_t{a.side} * proto::tiles_across(a.tile.z);
  for (const auto& [place, height] : places(b)) {
    if (!touches(a, place)) continue;
    const std::int64_t u = ((place.first - std::int64_t{a.tile.x} * a.side) % circle + circle) % circle;
    const std::int64_t v = place.second - std::int64_t{a.tile.y} * a.side;
    for (const Triangle& c : a.triangles) {
      for (unsigned k = 0; k < 3; ++k) {
        const std::uint32_t p = c[k], q = c[(k + 1) % 3];
        if (!on_side(a, p, q)) continue;
        const bool upright = a.u[p] == a.u[q] && a.u[p] == u && v > std::min(a.v[p], a.v[q]) && v < std::max(a.v[p], a.v[q]);
        const bool level = a.v[p] == a.v[q] && a.v[p] == v && u > std::min(a.u[p], a.u[q]) && u < std::max(a.u[p], a.u[q]);
        if (upright || level) return "vertex " + words(place) + " of " + name(b) + " is inside an edge of " + name(a);
      }
    }
  }
  return std::nullopt;
}

Violation missing(const std::map<Place, std::int32_t>& from, const DecodedTile& a, const std::map<Place, std::int32_t>& in,
                  const DecodedTile& b) {
  for (const auto& [place, height] : from)
    if (touches(b, place) && !in.contains(place))
      return "vertex " + words(place) + " of " + name(a) + " is missing in " + name(b);
  return std::nullopt;
}

/// Points of a .glb near a place in space, sorted.
std::vector<Point> near(const std::vector<Point>& points, const Point& place, double within_m) {
  std::vector<Point> found;
  for (const Point& p : points)
    if (std::abs(p[0] - place[0]) <= within_m && std::abs(p[1] - place[1]) <= within_m && std::abs(p[2] - place[2]) <= within_m)
      found.push_back(p);
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

}  // namespace

Violation plan_violation(const DecodedTile& t, Holes holes, std::optional<std::int64_t> doubled_area) {
  if (Violation broken = broken_index(t)) return broken;
  std::int64_t sum = 0;
  for (const Triangle& c : t.triangles) {
    const std::int64_t area = turn(t, c[0], c[1], c[2]);
    if (area <= 0) return name(t) + ": triangle" + words(t, c) + " has doubled area " + std::to_string(area);
    sum += area;
  }
  if (Violation overlapping = overlap(t)) return overlapping;
  const std::int64_t whole = 2 * std::int64_t{t.side} * t.side;
  const std::int64_t expected = holes == Holes::none ? whole : doubled_area.value_or(std::min(sum, whole));
  if (sum != expected) return name(t) + ": doubled areas add up to " + std::to_string(sum) + ", not " + std::to_string(expected);
  return std::nullopt;
}

Violation manifold_violation(const DecodedTile& t, Holes holes) {
  if (Violation broken = broken_index(t)) return broken;
  std::map<std::pair<std::uint32_t, std::uint32_t>, std::size_t> edges;
  std::vector<std::vector<std::pair<std::uint32_t, std::uint32_t>>> around(t.u.size());
  for (const Triangle& c : t.triangles) {
    for (unsigned k = 0; k < 3; ++k) {
      const std::uint32_t p = c[k], q = c[(k + 1) % 3];
      if (++edges[{p, q}] > 1) return name(t) + ": an edge of triangle" + words(t, c) + " is used twice in one direction";
      around[p].emplace_back(q, c[(k + 2) % 3]);
    }
  }
  if (holes == Holes::none)
    for (const auto& [edge, uses] : edges)
      if (!edges.contains({edge.second, edge.first}) && !on_side(t, edge.first, edge.second))
        return name(t) + ": edge" + words(t, {edge.first, edge.second, edge.second}) + " inside the tile has no partner";
  for (std::uint32_t v = 0; v < around.size(); ++v) {
    const std::string at = name(t) + ": vertex (" + std::to_string(t.u[v]) + ", " + std::to_string(t.v[v]) + ") ";
    if (around[v].empty()) return at + "has no triangle";
    if (around[v].size() > kMostTriangles) return at + "has " + std::to_string(around[v].size()) + " triangles";
    if (!one_fan(around[v])) return at + "has triangles in more than one fan";
  }
  return std::nullopt;
}

Violation space_violation(const DecodedSurface& surface) {
  std::size_t turned = 0;
  for (const auto& c : surface.triangles) {
    std::array<Point, 3> p;
    int at_pole = 0;
    for (unsigned k = 0; k < 3; ++k) {
      p[k] = surface.points[c[k]];
      at_pole += std::hypot(p[k][0], p[k][1]) == 0 ? 1 : 0;
    }
    if (at_pole > 1) return "a triangle has two corners at a pole";
    const Point a{p[1][0] - p[0][0], p[1][1] - p[0][1], p[1][2] - p[0][2]},
        b{p[2][0] - p[0][0], p[2][1] - p[0][1], p[2][2] - p[0][2]};
    const Point n{a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    bool front = true;
    for (const Point& corner : p) {
      const Point up = up_at(corner);
      front = front && n[0] * up[0] + n[1] * up[1] + n[2] * up[2] > 0;
    }
    turned += front ? 0 : 1;
  }
  if (turned > 0) return std::to_string(turned) + " triangles are upside down in space";
  return std::nullopt;
}

Violation cover_violation(const DecodedTile& tile, const Shown& shown) {
  if (shown.west > shown.east || shown.south > shown.north) return std::nullopt;
  const std::int64_t columns = shown.east - shown.west + 1;
  std::vector<bool> seen(static_cast<std::size_t>(columns * (shown.north - shown.south + 1)), false);
  for (const Triangle& c : tile.triangles) {
    const auto [west, east] = std::minmax({tile.u[c[0]], tile.u[c[1]], tile.u[c[2]]});
    const auto [south, north] = std::minmax({tile.v[c[0]], tile.v[c[1]], tile.v[c[2]]});
    for (std::int64_t v = std::max<std::int64_t>(south, shown.south); v <= std::min<std::int64_t>(north, shown.north); ++v)
      for (std::int64_t u = std::max<std::int64_t>(west, shown.west); u <= std::min<std::int64_t>(east, shown.east); ++u)
        if (holds(tile, c, u, v)) seen[static_cast<std::size_t>((v - shown.south) * columns + u - shown.west)] = true;
  }
  std::size_t missing = 0;
  std::string where;
  for (std::int64_t v = shown.south; v <= shown.north; ++v)
    for (std::int64_t u = shown.west; u <= shown.east; ++u)
      if (!seen[static_cast<std::size_t>((v - shown.south) * columns + u - shown.west)] && shown.must(u, v) && ++missing == 1)
        where = "(" + std::to_string(u) + ", " + std::to_string(v) + ")";
  if (missing == 0) return std::nullopt;
  return name(tile) + ": " + std::to_string(missing) + " samples well inside the data are uncovered, one at " + where;
}

Violation neighbour_violation(const DecodedTile& a, const DecodedTile& b, Holes holes) {
  if (a.tile.z != b.tile.z || a.side != b.side) return name(a) + " and " + name(b) + " are not of one level";
  const auto pa = places(a), pb = places(b);
  for (const auto& [place, height] : pa) {
    const auto other = pb.find(place);
    if (other != pb.end() && other->second != height)
      return "vertex " + words(place) + ": height " + std::to_string(height) + " in " + name(a) + ", " +
             std::to_string(other->second) + " in " + name(b);
  }
  if (Violation inside = inside_edge(a, b)) return inside;
  if (Violation inside = inside_edge(b, a)) return inside;
  if (holes == Holes::allowed) return std::nullopt;
  if (Violation one = missing(pa, a, pb, b)) return one;
  return missing(pb, b, pa, a);
}

Violation glb_neighbour_violation(const BothFaces& a, const BothFaces& b, const StepOf& step_of, double height_step_m) {
  const auto pb = places(b.drc);
  const auto& t = a.drc;
  const std::int64_t circle = std::int64_t{t.side} * proto::tiles_across(t.tile.z);
  for (const auto& [place, height] : places(t)) {
    if (!pb.contains(place)) continue;
    const double lon = -180 + 360.0 * static_cast<double>(place.first) / static_cast<double>(circle);
    const double lat = -90 + 360.0 * static_cast<double>(place.second) / static_cast<double>(circle);
    const Point expected = ecef_point(lon, lat, height * height_step_m);
    const double reach_m = 0.51 * step_of(height * height_step_m) + 1e-4;
    // Half a step for rounding; the rest for sines that differ in the last bits. Near a pole other vertices may be as near.
    const auto in_a = near(a.points, expected, reach_m), in_b = near(b.points, expected, reach_m);
    if (in_a.empty()) return "vertex " + words(place) + " is not in the .glb of " + name(t);
    if (in_b.empty()) return "vertex " + words(place) + " is not in the .glb of " + name(b.drc);
    const auto in_both = [&](const Point& p) { return std::find(in_b.begin(), in_b.end(), p) != in_b.end(); };
    if (std::none_of(in_a.begin(), in_a.end(), in_both))
      return "vertex " + words(place) + ": the .glb files of " + name(t) + " and " + name(b.drc) + " differ";
  }
  return std::nullopt;
}

}  // namespace cordillera::whole
