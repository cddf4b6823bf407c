#include "pipeline/encode/lit_mesh.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <stdexcept>

#include "gpu/measure/ecef_steps.h"
#include "pipeline/encode/draco_mesh.h"

namespace cordillera::pipeline {
namespace {

using proto::Vec3;

constexpr std::uint32_t kNone = UINT32_MAX;

Vec3 unit(Vec3 v, Vec3 fallback) {
  const double length = std::sqrt(dot(v, v));
  return length > 0 ? (1 / length) * v : fallback;
}

std::vector<std::int32_t> distinct(std::vector<std::int32_t> values) {
  std::sort(values.begin(), values.end());
  values.erase(std::unique(values.begin(), values.end()), values.end());
  return values;
}

// The ellipsoid at the rows and columns that a mesh uses: a coarse tile spans up to 2^30 of them and touches a few thousand.
class Ground {
 public:
  explicit Ground(const EncodeInput& input) : mesh_(*input.mesh), ys_(distinct(mesh_.y)), xs_(distinct(mesh_.x)) {
    const proto::Lattice& lattice = *input.lattice;
    for (const std::int32_t y : ys_) rows_.push_back(proto::row_frame(lattice, lattice.south(input.tile) + y));
    for (const std::int32_t x : xs_) columns_.push_back(proto::column_frame(lattice, lattice.west(input.tile) + x));
  }
  Vec3 point(std::uint32_t v, double lift_m) const {
    return proto::ecef(row(v), column(v), mesh_.height[v] * proto::kHeightStep_m + lift_m);
  }
  Vec3 up(std::uint32_t v) const { return proto::normal(row(v), column(v)); }
  Vec3 east(std::uint32_t v) const { return {-column(v).sin_lon, column(v).cos_lon, 0}; }
  std::array<double, 2> place(std::uint32_t v) const {
    const double side = mesh_.side;
    return {mesh_.x[v] / side, mesh_.y[v] / side};
  }

 private:
  static std::size_t place_of(const std::vector<std::int32_t>& values, std::int32_t value) {
    return static_cast<std::size_t>(std::lower_bound(values.begin(), values.end(), value) - values.begin());
  }
  const proto::RowFrame& row(std::uint32_t v) const { return rows_[place_of(ys_, mesh_.y[v])]; }
  const proto::ColumnFrame& column(std::uint32_t v) const { return columns_[place_of(xs_, mesh_.x[v])]; }

  const proto::TileMesh& mesh_;
  std::vector<std::int32_t> ys_, xs_;
  std::vector<proto::RowFrame> rows_;
  std::vector<proto::ColumnFrame> columns_;
};

// Weights of N. Max, "Weights for computing vertex normals from facet normals", 1999: exact on spheres, and slivers do not tilt
// them.
std::vector<Vec3> corner_sums(const std::vector<Vec3>& points, const std::vector<Triangle>& triangles) {
  std::vector<Vec3> sums(points.size());
  for (const Triangle& t : triangles) {
    for (int c = 0; c < 3; ++c) {
      const Vec3 a = points[t[(c + 1) % 3]] - points[t[c]], b = points[t[(c + 2) % 3]] - points[t[c]];
      const double weight = dot(a, a) * dot(b, b);
      if (weight > 0) sums[t[c]] = sums[t[c]] + (1 / weight) * cross(a, b);
    }
  }
  return sums;
}

bool on_one_side(const proto::TileMesh& mesh, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  const auto all_at = [](const std::vector<std::int32_t>& w, std::uint32_t p, std::uint32_t q, std::uint32_t r, std::int32_t at) {
    return w[p] == at && w[q] == at && w[r] == at;
  };
  return all_at(mesh.x, a, b, c, 0) || all_at(mesh.x, a, b, c, mesh.side) || all_at(mesh.y, a, b, c, 0) ||
         all_at(mesh.y, a, b, c, mesh.side);
}

// A tile that knows nothing of a neighbour shares the vertices of a common side with it and nothing else. A normal there is
// made perpendicular to the side's own direction, which both know exactly; only the slope across the side is left to what each
// tile sees. Where that would turn it down, there is none.
void agree_along_sides(const EncodeInput& input, const PublishedMesh& mesh, const std::vector<Vec3>& points, const Ground& ground,
                       std::vector<Vec3>& sums) {
  std::vector<std::uint32_t> before(points.size(), kNone), after(points.size(), kNone);
  for (const auto& [from, to] : mesh.boundary) {
    after[from] = to;
    before[to] = from;
  }
  for (std::uint32_t v = 0; v < points.size(); ++v) {
    if (before[v] == kNone || after[v] == kNone) continue;
    if (!on_one_side(*input.mesh, mesh.source[before[v]], mesh.source[v], mesh.source[after[v]])) continue;
    const Vec3 along = points[after[v]] - points[before[v]];
    const double length2 = dot(along, along);
    if (!(length2 > 0)) continue;
    const auto across = [&](const Vec3& normal) { return normal - (dot(normal, along) / length2) * along; };
    const Vec3 up = ground.up(mesh.source[v]), normal = across(sums[v]);
    sums[v] = dot(normal, up) > 0 ? normal : across(up);
  }
}

// All tiles there have added to them.
void agree_with_neighbours(const EncodeInput& input, const PublishedMesh& mesh, const SideNormals& sides,
                           std::vector<Vec3>& sums) {
  for (std::uint32_t v = 0; v < sums.size(); ++v) {
    const std::uint32_t source = mesh.source[v];
    const auto found = sides.find({input.mesh->x[source], input.mesh->y[source]});
    if (found != sides.end()) sums[v] = found->second;
  }
}

/// Of points.
struct Box {
  Vec3 low{INFINITY, INFINITY, INFINITY}, high{-INFINITY, -INFINITY, -INFINITY};

  void add(const Vec3& p) {
    low = {std::min(low.x, p.x), std::min(low.y, p.y), std::min(low.z, p.z)};
    high = {std::max(high.x, p.x), std::max(high.y, p.y), std::max(high.z, p.z)};
  }
  Vec3 middle() const { return low + 0.5 * (high - low); }
  /// The greatest distance of a point from there, along an axis.
  double reach_m(const Vec3& from) const {
    const Vec3 below = from - low, above = high - from;
    return std::max({below.x, below.y, below.z, above.x, above.y, above.z});
  }
};

/// That hold any coordinate, from a translation that is so far away at the most.
int bits_of(double reach_m, double step_m) {
  int bits = 2;
  while (bits <= kMaxGridBits && reach_m / step_m > std::ldexp(1, bits - 1) - 1) ++bits;
  return bits;
}

/// Rounds a tile's points, and finds the translation from which Draco can tell them.
class Rounding {
 public:
  explicit Rounding(const gpu::EcefSteps& steps) : steps_(steps) {}

  Vec3 rounded(const Vec3& p, double height_m) {
    const double step_m = steps_.at(p, height_m);
    const Vec3 at = gpu::round_to(p, step_m);
    boxes_[step_m].add(at);
    return at;
  }

  /// The middle of all points, if the bits reach that far. Else that of the points with the finest step: Draco's whole numbers go
  /// on beyond its bits, and there a float32 holds the multiples of greater steps.
  void centre(LitMesh& mesh) const {
    const auto& [finest_m, inner] = *boxes_.begin();
    Box all = inner;
    for (const auto& [step_m, box] : boxes_) {
      all.add(box.low);
      all.add(box.high);
    }
    mesh.step_m = finest_m;
    mesh.translation = gpu::round_to(all.middle(), finest_m);
    mesh.bits = bits_of(all.reach_m(mesh.translation), finest_m);
    if (mesh.bits > kMaxGridBits && boxes_.size() > 1) {
      mesh.translation = gpu::round_to(inner.middle(), boxes_.rbegin()->first);
      mesh.bits = std::max(kMaxGridBits, bits_of(inner.reach_m(mesh.translation), finest_m));
      for (const auto& [step_m, box] : boxes_) {
        if (box.reach_m(mesh.translation) >= std::ldexp(step_m, kMaxGridBits)) mesh.bits = kMaxGridBits + 1;
      }
    }
    if (mesh.bits > kMaxGridBits) throw std::invalid_argument("ecef_steps are too fine for a tile of this size");
  }

 private:
  const gpu::EcefSteps steps_;
  std::map<double, Box> boxes_;  ///< of the points that have a step
};

// A strip hung from every boundary edge on a side of the tile, facing outward. Rims have no neighbour whose other level could
// leave a crack.
LitMesh::Surface skirts(const EncodeInput& input, const PublishedMesh& mesh, const Ground& ground,
                        const LitMesh::Surface& terrain, Rounding& rounding) {
  LitMesh::Surface out;
  std::vector<std::uint32_t> top(terrain.points.size(), kNone);
  const auto hang = [&](std::uint32_t v) {
    if (top[v] != kNone) return top[v];
    top[v] = static_cast<std::uint32_t>(out.points.size());
    out.points.push_back(terrain.points[v]);
    const double height_m = input.mesh->height[mesh.source[v]] * proto::kHeightStep_m;
    const double depth_m = std::min(input.skirts.depth_m, height_m - input.skirts.floor_m);
    out.points.push_back(rounding.rounded(ground.point(mesh.source[v], -depth_m), height_m - depth_m));
    if (!terrain.normals.empty()) out.normals.insert(out.normals.end(), 2, terrain.normals[v]);
    if (!terrain.east.empty()) out.east.insert(out.east.end(), 2, terrain.east[v]);
    if (!terrain.places.empty()) out.places.insert(out.places.end(), 2, terrain.places[v]);
    return top[v];
  };
  for (const auto& [from, to] : mesh.boundary) {
    if (!on_one_side(*input.mesh, mesh.source[from], mesh.source[to], mesh.source[to])) continue;
    const Vec3 along = terrain.points[to] - terrain.points[from];
    if (dot(along, along) == 0) continue;  // on a pole row
    const std::uint32_t a = hang(from), b = hang(to);
    out.triangles.push_back({a, a + 1, b});
    out.triangles.push_back({b, a + 1, b + 1});
  }
  return out;
}

// The frame that a normal map's pixels are meant in. It depends on the place alone, so tiles that share a vertex share it, too.
void stand_upright(const PublishedMesh& mesh, const Ground& ground, LitMesh::Surface& terrain) {
  for (const std::uint32_t v : mesh.source) {
    terrain.normals.push_back(ground.up(v));
    terrain.east.push_back(ground.east(v));
  }
}

void lean_on_triangles(const EncodeInput& input, const PublishedMesh& mesh, const Ground& ground, LitMesh::Surface& terrain) {
  std::vector<Vec3> sums = corner_sums(terrain.points, mesh.triangles);
  agree_along_sides(input, mesh, terrain.points, ground, sums);
  if (input.shading.sides != nullptr) agree_with_neighbours(input, mesh, *input.shading.sides, sums);
  for (std::size_t v = 0; v < sums.size(); ++v) terrain.normals.push_back(unit(sums[v], ground.up(mesh.source[v])));
}

bool touches_pole(const EncodeInput& input) { return input.tile.y == 0 || input.tile.y + 1 == proto::tiles_up(input.tile.z); }

// Vertices of a pole's row are one point in space: a triangle with two of them is a line there, and goes. The .drc keeps it, for
// in plan the tile would have a gap.
proto::TileMesh without_lines_at_pole(const EncodeInput& input) {
  proto::TileMesh mesh = *input.mesh;
  const std::int64_t south = input.lattice->south(input.tile), rows = input.lattice->rows();
  const auto at_pole = [&](std::uint32_t v) { return south + mesh.y[v] == 0 || south + mesh.y[v] == rows; };
  std::erase_if(mesh.triangles, [&](const Triangle& t) { return at_pole(t[0]) + at_pole(t[1]) + at_pole(t[2]) > 1; });
  return mesh;
}

}  // namespace

LitMesh lit_mesh(const EncodeInput& input, const PublishedMesh& published) {
  LitMesh out;
  const PublishedMesh at_pole = touches_pole(input) ? published_mesh(without_lines_at_pole(input)) : PublishedMesh();
  const PublishedMesh& mesh = at_pole.empty() ? published : at_pole;  // of nothing but lines, too: a tile has a point at least
  if (mesh.empty()) return out;
  const Ground ground(input);
  Rounding rounding(input.ecef_steps);
  for (const std::uint32_t v : mesh.source)
    out.terrain.points.push_back(rounding.rounded(ground.point(v, 0), input.mesh->height[v] * proto::kHeightStep_m));
  if (input.shading.normals == Normals::texture)
    stand_upright(mesh, ground, out.terrain);
  else if (input.shading.normals == Normals::vertex)
    lean_on_triangles(input, mesh, ground, out.terrain);
  if (input.shading.has_places())
    for (const std::uint32_t v : mesh.source) out.terrain.places.push_back(ground.place(v));
  if (input.skirts.depth_m > 0) out.skirts = skirts(input, mesh, ground, out.terrain, rounding);
  out.terrain.triangles = mesh.triangles;
  rounding.centre(out);
  return out;
}

}  // namespace cordillera::pipeline
