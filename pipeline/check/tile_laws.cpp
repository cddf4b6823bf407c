#include "pipeline/check/tile_laws.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "gpu/mesh/valence_limits.h"
#include "pipeline/encode/region.h"
#include "proto/mesh.h"

namespace cordillera::pipeline::check {
namespace {

using proto::Vec3;

constexpr double kMostHeight_m = 2 * proto::kMaxHeight_m;  // vertices may be above the raster's heights, by their level's target
constexpr double kSlack_m = 1e-4;                          // sines of another machine's library may differ in their last bits

std::string words(const std::array<std::int32_t, 3>& p) {
  return std::to_string(p[0]).insert(0, 1, '(') + ", " + std::to_string(p[1]) + ")";
}

/// What must hold before anything else may be asked of the mesh.
std::optional<std::string> misplaced(const DecodedDrc& mesh, const TileBytes& bytes) {
  const proto::Lattice lattice{bytes.finest_level};
  if (proto::TileAddress{mesh.z, mesh.x, mesh.y} != bytes.tile) return "its .drc is of " + name_of({mesh.z, mesh.x, mesh.y});
  if (mesh.side != lattice.tile_units(bytes.tile.z)) return "its side has " + std::to_string(mesh.side) + " units";
  const double steps = mesh.height_step / proto::kHeightStep_m;
  const bool of_the_level =
      bytes.height_step_m == 0 ? steps >= 1 && steps == std::floor(steps) : mesh.height_step == bytes.height_step_m;
  if (!of_the_level) return "its height step is not that of its level";
  for (const auto& p : mesh.points) {
    if (p[0] < 0 || p[1] < 0 || p[0] > mesh.side || p[1] > mesh.side) return "vertex " + words(p) + " is outside";
    if (std::abs(p[2] * mesh.height_step) > kMostHeight_m) return "vertex " + words(p) + " has an impossible height";
  }
  for (const Triangle& t : mesh.triangles) {
    for (const std::uint32_t v : t) {
      if (v >= mesh.points.size()) return "a triangle names a vertex that is not there";
    }
  }
  return std::nullopt;
}

void check_triangles(const DecodedDrc& mesh, const std::string& where, Findings& findings) {
  std::vector<std::array<std::uint32_t, 2>> edges;
  std::vector<std::uint32_t> around(mesh.points.size());
  double doubled = 0;
  for (const Triangle& t : mesh.triangles) {
    const auto &a = mesh.points[t[0]], &b = mesh.points[t[1]], &c = mesh.points[t[2]];
    const std::int64_t area =
        (std::int64_t{b[0]} - a[0]) * (std::int64_t{c[1]} - a[1]) - (std::int64_t{b[1]} - a[1]) * (std::int64_t{c[0]} - a[0]);
    if (area <= 0) findings.add(where, "the triangle at " + words(a) + " has no area or is upside down");
    doubled += static_cast<double>(area);
    for (unsigned k = 0; k < 3; ++k) {
      edges.push_back({t[k], t[(k + 1) % 3]});
      ++around[t[k]];
    }
  }
  const double side = mesh.side;
  if (doubled > 2 * side * side) findings.add(where, "its triangles cover more than the tile: some overlap");
  std::sort(edges.begin(), edges.end());
  const auto twice = std::adjacent_find(edges.begin(), edges.end());
  if (twice != edges.end())
    findings.add(where, "an edge at " + words(mesh.points[(*twice)[0]]) + " is used twice in one direction");
  for (std::size_t v = 0; v < around.size(); ++v) {
    if (around[v] > 0 && around[v] <= gpu::kMostValence) continue;
    findings.add(where, "vertex " + words(mesh.points[v]) + " has " + std::to_string(around[v]) + " triangles");
  }
}

void check_record(const DecodedDrc& mesh, const TileBytes& bytes, const std::string& where, Findings& findings) {
  const proto::TileRecord& record = *bytes.record;
  const auto [lowest, highest] =
      std::minmax_element(mesh.points.begin(), mesh.points.end(), [](const auto& a, const auto& b) { return a[2] < b[2]; });
  if (record.triangles() != mesh.triangles.size() || record.vertices() != mesh.points.size()) {
    findings.add(where, "its record counts " + std::to_string(record.vertices()) + " vertices and " +
                            std::to_string(record.triangles()) + " triangles, the tile has " +
                            std::to_string(mesh.points.size()) + " and " + std::to_string(mesh.triangles.size()));
  }
  if (lowest == mesh.points.end()) return;
  if (record.min_height() != (*lowest)[2] * mesh.height_step || record.max_height() != (*highest)[2] * mesh.height_step) {
    findings.add(where, "its record has other heights than the tile");
  }
  const bool glb_stored = record.glb_bytes() != 0;
  if (record.drc_bytes() != bytes.drc.size() || (glb_stored && record.glb_bytes() != bytes.glb.size()))
    findings.add(where, "its record has other sizes than the tile");
  if (!(record.max_error() >= 0) || !std::isfinite(record.max_error())) findings.add(where, "its stated error is no distance");
}

bool inside_region(const Vec3& point, const proto::TileRecord& record) {
  constexpr double kAngle = 1e-11;
  const Geodetic at = geodetic(point);
  const bool pole = std::hypot(point.x, point.y) < 1;  // all longitudes meet there
  // A point on the antimeridian has two longitudes.
  const bool east_west = pole || std::abs(std::abs(at.longitude) - std::numbers::pi) < kAngle ||
                         (at.longitude >= record.region(0) - kAngle && at.longitude <= record.region(2) + kAngle);
  return east_west && at.latitude >= record.region(1) - kAngle && at.latitude <= record.region(3) + kAngle &&
         at.height_m >= record.region(4) - kSlack_m && at.height_m <= record.region(5) + kSlack_m;
}

void check_region(const DecodedGlb& mesh, const proto::TileRecord& record, const std::string& where, Findings& findings) {
  if (record.region_size() != 6) return findings.add(where, "its record has no region");
  for (const auto* points : {&mesh.points, &mesh.skirt_points}) {
    const auto beyond = std::find_if(points->begin(), points->end(), [&](const Vec3& p) { return !inside_region(p, record); });
    if (beyond != points->end()) return findings.add(where, "its .glb reaches beyond the region that its record states");
  }
}

/// Finds the .glb's vertex at a place.
class GlbPoints {
 public:
  explicit GlbPoints(const DecodedGlb& mesh) : points_(mesh.points) {
    std::sort(points_.begin(), points_.end(), [](const Vec3& a, const Vec3& b) { return a.x < b.x; });
  }
  /// step_m: that the point was rounded to
  std::optional<Vec3> at(const Vec3& place, double step_m) const {
    const double reach_m = 0.51 * step_m + kSlack_m;
    auto p = std::lower_bound(points_.begin(), points_.end(), place.x - reach_m, [](const Vec3& a, double x) { return a.x < x; });
    std::optional<Vec3> nearest;
    double best = INFINITY;
    for (; p != points_.end() && p->x <= place.x + reach_m; ++p) {
      const Vec3 d = *p - place;
      if (std::abs(d.y) > reach_m || std::abs(d.z) > reach_m || dot(d, d) >= best) continue;
      best = dot(d, d);
      nearest = *p;
    }
    return nearest;
  }

 private:
  std::vector<Vec3> points_;
};

/// Of each triangle of the .drc, whether two of its corners are at a pole: it is a line in space.
std::vector<bool> lines_at_pole(const DecodedDrc& mesh, const TileBytes& bytes) {
  const proto::Lattice lattice{bytes.finest_level};
  const std::int64_t south = lattice.south(bytes.tile);
  const auto at_pole = [&](std::uint32_t v) {
    return south + mesh.points[v][1] == 0 || south + mesh.points[v][1] == lattice.rows();
  };
  std::vector<bool> lines;
  for (const Triangle& t : mesh.triangles) lines.push_back(at_pole(t[0]) + at_pole(t[1]) + at_pole(t[2]) > 1);
  return lines;
}

/// Of each vertex, whether it is a corner of a triangle that the .glb has, too.
std::vector<bool> shown_vertices(const DecodedDrc& mesh, const TileBytes& bytes) {
  const std::vector<bool> lines = lines_at_pole(mesh, bytes);
  const bool all = std::find(lines.begin(), lines.end(), false) == lines.end();
  std::vector<bool> shown(mesh.points.size(), all);
  for (std::size_t t = 0; t < lines.size() && !all; ++t) {
    for (const std::uint32_t v : mesh.triangles[t]) shown[v] = shown[v] || !lines[t];
  }
  return shown;
}

/// Where the .drc's vertices are in the .glb, or would be; empty after a finding.
std::vector<Vec3> matched(const DecodedDrc& drc, const DecodedGlb& glb, const TileBytes& bytes, const std::string& where,
                          Findings& findings) {
  const proto::Lattice lattice{bytes.finest_level};
  const std::int64_t west = lattice.west(bytes.tile), south = lattice.south(bytes.tile);
  const GlbPoints points(glb);
  const std::vector<bool> shown = shown_vertices(drc, bytes);
  std::vector<Vec3> out;
  for (std::size_t v = 0; v < drc.points.size(); ++v) {
    const auto& p = drc.points[v];
    const double height_m = p[2] * drc.height_step;
    const Vec3 place = proto::ecef(proto::row_frame(lattice, south + p[1]), proto::column_frame(lattice, west + p[0]), height_m);
    const auto found =
        shown[v] ? points.at(place, bytes.ecef_steps.at(place, height_m)) : bytes.ecef_steps.rounded(place, height_m);
    if (!found) {
      findings.add(where, "vertex " + words(drc.points[v]) + " of its .drc is not in its .glb");
      return {};
    }
    out.push_back(*found);
  }
  return out;
}

/// Seen along the ellipsoid's normal at each corner every triangle is the right way up, but for those within a pole's own row of
/// the level's cells, where columns may be closer than any step. None has two corners at a pole, unless the tile has no other.
void check_orientation(const DecodedGlb& mesh, const proto::TileAddress& tile, Findings& findings) {
  const double cell_rad = std::numbers::pi / (static_cast<double>(proto::kTileCells) * proto::tiles_up(tile.z));
  std::vector<Vec3> up;
  std::vector<std::uint8_t> in_pole_row;
  for (const Vec3& p : mesh.points) {
    const Geodetic at = geodetic(p);
    up.push_back(
        {std::cos(at.latitude) * std::cos(at.longitude), std::cos(at.latitude) * std::sin(at.longitude), std::sin(at.latitude)});
    in_pole_row.push_back(std::numbers::pi / 2 - std::abs(at.latitude) < 1.001 * cell_rad ? 1 : 0);
  }
  std::size_t turned = 0, lines = 0;
  for (const Triangle& t : mesh.triangles) {
    const auto at_pole = [&](std::uint32_t v) { return mesh.points[v].x == 0 && mesh.points[v].y == 0; };
    if (at_pole(t[0]) + at_pole(t[1]) + at_pole(t[2]) > 1) ++lines;
    if (std::all_of(t.begin(), t.end(), [&](std::uint32_t v) { return in_pole_row[v] != 0; })) continue;
    const Vec3 normal = cross(mesh.points[t[1]] - mesh.points[t[0]], mesh.points[t[2]] - mesh.points[t[0]]);
    if (std::any_of(t.begin(), t.end(), [&](std::uint32_t v) { return !(dot(normal, up[v]) > 0); })) ++turned;
  }
  const std::string where = name_of(tile);
  if (turned > 0) findings.add(where, std::to_string(turned) + " triangles of its .glb are upside down, seen along the normal");
  if (lines > 0 && lines < mesh.triangles.size())
    findings.add(where, std::to_string(lines) + " triangles of its .glb have two corners at a pole");
}

bool finite(const DecodedGlb& mesh) {
  const auto good = [](const Vec3& p) { return std::isfinite(p.x) && std::isfinite(p.y) && std::isfinite(p.z); };
  return std::all_of(mesh.points.begin(), mesh.points.end(), good) &&
         std::all_of(mesh.skirt_points.begin(), mesh.skirt_points.end(), good) &&
         std::all_of(mesh.normals.begin(), mesh.normals.end(), good);
}

void collect_sides(CheckedTile& tile, const std::vector<Vec3>& points) {
  const DecodedDrc& mesh = tile.drc;
  const std::array<std::pair<int, std::int32_t>, 4> lines = {{{0, 0}, {0, mesh.side}, {1, 0}, {1, mesh.side}}};
  for (const Triangle& t : mesh.triangles) {
    for (unsigned k = 0; k < 3; ++k) {
      std::uint32_t a = t[k], b = t[(k + 1) % 3];
      for (std::size_t s = 0; s < 4; ++s) {
        const auto [axis, at] = lines[s];
        const auto across = static_cast<std::size_t>(axis), along = 1 - across;
        if (mesh.points[a][across] != at || mesh.points[b][across] != at) continue;
        if (mesh.points[a][along] > mesh.points[b][along]) std::swap(a, b);
        SideEdge edge{mesh.points[a][along], mesh.points[b][along], mesh.points[a][2], mesh.points[b][2], {}, {}};
        if (!points.empty()) edge.from_point = points[a], edge.to_point = points[b];
        tile.sides[s].push_back(edge);
      }
    }
  }
  for (auto& side : tile.sides)
    std::sort(side.begin(), side.end(), [](const SideEdge& a, const SideEdge& b) { return a.from < b.from; });
}

}  // namespace

std::optional<CheckedTile> check_tile(const TileBytes& bytes, Findings& findings) {
  const std::string where = name_of(bytes.tile);
  auto drc = decode_drc(bytes.drc);
  if (!drc) findings.add(where, "its .drc: " + drc.problem().detail);
  const auto glb = decode_glb(bytes.glb);
  if (!glb) findings.add(where, "its .glb: " + glb.problem().detail);
  if (!drc || !glb) return std::nullopt;
  if (const auto wrong = misplaced(*drc, bytes)) {
    findings.add(where, *wrong);
    return std::nullopt;
  }
  *drc = in_mesh_steps(std::move(*drc));
  check_triangles(*drc, where, findings);
  if (!finite(*glb)) findings.add(where, "its .glb has a coordinate that is no number");
  const std::vector<bool> at_pole = lines_at_pole(*drc, bytes);
  const auto lines = static_cast<std::size_t>(std::count(at_pole.begin(), at_pole.end(), true));
  const std::size_t shown = lines < drc->triangles.size() ? drc->triangles.size() - lines : lines;
  if (glb->triangles.size() != shown) findings.add(where, "its .glb has another number of triangles than its .drc");
  check_orientation(*glb, bytes.tile, findings);
  if (bytes.record != nullptr) {
    check_record(*drc, bytes, where, findings);
    check_region(*glb, *bytes.record, where, findings);
  }
  CheckedTile tile{bytes.tile, std::move(*drc), {}};
  collect_sides(tile, bytes.ecef_steps.finest_m > 0 ? matched(tile.drc, *glb, bytes, where, findings) : std::vector<Vec3>{});
  return tile;
}

}  // namespace cordillera::pipeline::check
