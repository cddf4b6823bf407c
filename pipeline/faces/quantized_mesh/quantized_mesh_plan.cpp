#include "pipeline/faces/quantized_mesh/quantized_mesh_plan.h"

#include <algorithm>
#include <map>

#include "gpu/mesh/mesh_point.h"

namespace cordillera::pipeline::faces {
namespace {

using Point = PlaneTriangulation::Point;

bool has_data(const SideLine& line, std::size_t k) { return line[k].data_after || (k > 0 && line[k - 1].data_after); }

class Planner {
 public:
  Planner(const QuantizedLevel& level, std::int32_t side, const MeshIndex* index, QuantizedPlan* plan)
      : level_(level), side_(side), index_(index), plan_(*plan) {}

  void fill() {
    if (index_ != nullptr) place_mesh();
    if (index_ != nullptr && keep_mesh()) return;
    add_sides();
    add_sea();
    cut_anew();
  }

 private:
  using Vertex = QuantizedPlan::Vertex;

  /// Where a mesh vertex goes: onto a side only where the side's line has data there.
  Point place(const std::array<std::int32_t, 3>& p) const {
    for (const MeshSide side : kSides) {
      const auto [across, along] = across_and_along(side, p);
      const bool far = side == MeshSide::east || side == MeshSide::north;
      if (across != (far ? side_ : 0)) continue;
      const SideLine& line = plan_.lines[static_cast<std::size_t>(side)];
      const std::int32_t at = quanta(along, side_);
      const auto found =
          std::lower_bound(line.begin(), line.end(), at, [](const SidePoint& a, std::int32_t b) { return a.at < b; });
      if (found == line.end() || found->at != at || !has_data(line, static_cast<std::size_t>(found - line.begin()))) continue;
      return {quanta(p[0], side_), quanta(p[1], side_)};
    }
    return {std::clamp(quanta(p[0], side_), 1, kMostQuanta - 1), std::clamp(quanta(p[1], side_), 1, kMostQuanta - 1)};
  }

  void place_mesh() {
    for (const auto& p : index_->mesh().points) places_.push_back(place(p));
  }

  /// The mesh as it is, where it covers the tile, goes on beyond all sides, and rounding turned nothing over.
  bool keep_mesh() {
    const LatticeMesh& mesh = index_->mesh();
    for (const SideLine& line : plan_.lines) {
      if (!std::all_of(line.begin(), line.end() - 1, [](const SidePoint& p) { return p.data_after; })) return false;
    }
    std::int64_t twice_area = 0;
    for (const Triangle& t : mesh.triangles) {
      const std::int64_t area = gpu::twice_area(places_[t[0]], places_[t[1]], places_[t[2]]);
      if (area <= 0) return false;
      twice_area += area;
    }
    if (twice_area != std::int64_t{2} * kMostQuanta * kMostQuanta) return false;
    for (std::uint32_t v = 0; v < places_.size(); ++v) {
      plan_.vertices.push_back({places_[v], {mesh.points[v][0], mesh.points[v][1]}, v});
    }
    // No edge of it has the sea beyond, so nobody asks what is beside.
    for (const Triangle& t : mesh.triangles) plan_.faces.push_back({t, {0, 0, 0}, true});
    return true;
  }

  void add_sides() {
    for (const MeshSide side : kSides) {
      const bool upright = side == MeshSide::west || side == MeshSide::east,
                 far = side == MeshSide::east || side == MeshSide::north;
      for (const SidePoint& p : plan_.lines[static_cast<std::size_t>(side)]) {
        const std::int32_t across = far ? kMostQuanta : 0, units = far ? side_ : 0;
        const Point at = upright ? Point{across, p.at} : Point{p.at, across};
        vertices_.try_emplace(
            at, Vertex{at, upright ? std::array{units, p.units} : std::array{p.units, units}, QuantizedPlan::kNone});
      }
    }
  }

  void add_sea() {
    const std::int32_t step = side_ / level_.sea_cells;
    for (std::int32_t j = 1; j < level_.sea_cells; ++j) {
      for (std::int32_t i = 1; i < level_.sea_cells; ++i) {
        const std::array units = {i * step, j * step};
        if (index_ != nullptr && index_->triangle_at(units[0], units[1])) continue;
        const Point at{quanta(units[0], side_), quanta(units[1], side_)};
        vertices_.try_emplace(at, Vertex{at, units, QuantizedPlan::kNone});
      }
    }
  }

  /// Of mesh vertices that fall on one point, the one that a side's line names, else the first.
  void add_mesh_vertices() {
    const auto& points = index_->mesh().points;
    for (std::uint32_t v = 0; v < places_.size(); ++v) {
      const std::array units = {points[v][0], points[v][1]};
      Vertex& vertex = vertices_.try_emplace(places_[v], Vertex{places_[v], units, v}).first->second;
      const Point& at = places_[v];
      const bool on_side = at.x == 0 || at.y == 0 || at.x == kMostQuanta || at.y == kMostQuanta;
      if (vertex.source != QuantizedPlan::kNone || (on_side && vertex.units != units)) continue;
      vertex.source = v;
      vertex.units = units;
    }
  }

  /// Rims first: where rounding has made edges cross, those of the inside give way.
  void connect_mesh(PlaneTriangulation& cut, const std::map<Point, std::uint32_t>& number) const {
    std::map<std::array<std::uint32_t, 2>, int> edges;
    for (const Triangle& t : index_->mesh().triangles) {
      for (std::size_t k = 0; k < 3; ++k) {
        const std::uint32_t a = number.at(places_[t[k]]), b = number.at(places_[t[(k + 1) % 3]]);
        if (a != b) ++edges[{std::min(a, b), std::max(a, b)}];
      }
    }
    for (const bool rims : {true, false}) {
      for (const auto& [ends, triangles] : edges) {
        if ((triangles == 1) == rims) cut.connect(ends[0], ends[1]);
      }
    }
  }

  void cut_anew() {
    if (index_ != nullptr) add_mesh_vertices();
    std::vector<Point> order;
    for (const auto& [at, vertex] : vertices_) order.push_back(at);
    // Strips to and fro: each point is near the one before.
    const auto key = [](Point p) { return std::array{p.y >> 9, (p.y >> 9 & 1) != 0 ? -p.x : p.x, p.y}; };
    std::sort(order.begin(), order.end(), [&](Point a, Point b) { return key(a) < key(b); });
    PlaneTriangulation cut(kMostQuanta);
    std::map<Point, std::uint32_t> number;
    for (const Point& at : order) number[at] = cut.add(at);
    if (index_ != nullptr) connect_mesh(cut, number);
    for (std::uint32_t v = 0; v < cut.vertices(); ++v) plan_.vertices.push_back(vertices_.at(cut.point(v)));
    for (const PlaneTriangulation::Face& face : cut.faces()) {
      plan_.faces.push_back({face.vertex, face.beside, is_data(face.vertex)});
    }
  }

  bool is_data(const Triangle& t) const {
    double u = 0, v = 0;
    for (const std::uint32_t corner : t) {
      if (plan_.vertices[corner].source == QuantizedPlan::kNone) return false;
      u += plan_.vertices[corner].at.x;
      v += plan_.vertices[corner].at.y;
    }
    const double units = static_cast<double>(side_) / kMostQuanta / 3;
    return index_->triangle_at(u * units, v * units).has_value();
  }

  const QuantizedLevel& level_;
  std::int32_t side_;
  const MeshIndex* index_;
  QuantizedPlan& plan_;
  std::vector<Point> places_;  // indexed by mesh vertex
  std::map<Point, Vertex> vertices_;
};

}  // namespace

QuantizedPlan quantized_plan(const MeshGrid& grid, const QuantizedLevel& level, const proto::TileAddress& tile,
                             const MeshIndex* mesh) {
  QuantizedPlan plan;
  for (const MeshSide side : kSides) plan.lines[static_cast<std::size_t>(side)] = side_line(grid, level, tile, side);
  Planner(level, grid.side(tile.z), mesh, &plan).fill();
  return plan;
}

}  // namespace cordillera::pipeline::faces
