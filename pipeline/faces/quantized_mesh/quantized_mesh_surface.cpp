#include "pipeline/faces/quantized_mesh/quantized_mesh_surface.h"

#include <algorithm>
#include <cmath>

#include "pipeline/faces/quantized_mesh/quantized_mesh_plan.h"

namespace cordillera::pipeline::faces {
namespace {

enum class Kind : std::uint8_t { data, sea };
constexpr std::uint32_t kNone = QuantizedPlan::kNone;

Kind kind_of(bool data) { return data ? Kind::data : Kind::sea; }

class SurfaceMaker {
 public:
  SurfaceMaker(const MeshGrid& grid, const QuantizedLevel& level, const proto::TileAddress& tile)
      : grid_(grid),
        tile_(tile),
        level_(level),
        mesh_(grid.mesh(tile)),
        plan_(quantized_plan(grid, level, tile, mesh_.get())),
        number_(plan_.vertices.size(), {kNone, kNone}) {
    out_.angles = grid.angles(tile);
    out_.step_m = level.step_m;
    if (mesh_) normals_ = grid.normals(tile);
  }

  QuantizedSurface make() {
    for (const QuantizedPlan::Face& face : plan_.faces) {
      const Kind kind = kind_of(face.data);
      const auto& [a, b, c] = face.vertex;
      out_.triangles.push_back({vertex(a, kind), vertex(b, kind), vertex(c, kind)});
      for (std::uint32_t k = 0; k < 3; ++k) add_wall(face, k);
    }
    for (std::size_t side = 0; side < 4; ++side) out_.sides[side] = side_vertices(kSides[side]);
    return std::move(out_);
  }

 private:
  std::uint32_t add(const QuantizedPlan::Vertex& v, std::int32_t height, proto::Vec3 normal) {
    out_.vertices.push_back({v.at.x, v.at.y, height, normal});
    return static_cast<std::uint32_t>(out_.vertices.size() - 1);
  }

  /// The vertex of one kind over a place of the plan; the data's serves both where they are equally high.
  std::uint32_t vertex(std::uint32_t at, Kind kind) {
    const QuantizedPlan::Vertex& v = plan_.vertices[at];
    const auto data_steps = [&] { return steps(mesh_->mesh().points[v.source][2] * mesh_->mesh().height_step); };
    std::uint32_t& sea = number_[at][1];
    std::uint32_t& data = number_[at][0];
    if (kind == Kind::sea && sea == kNone) {
      const std::int32_t height = steps(grid_.beside_m(tile_, v.units, level_));
      if (v.source == kNone || data_steps() != height) {
        sea = add(v, height, grid_.up_at(tile_, v.units));
      } else
        kind = Kind::data;
    }
    if (kind == Kind::data && data == kNone) data = add(v, data_steps(), normals_[v.source]);
    return kind == Kind::data ? data : sea;
  }
  std::int32_t steps(double height_m) const {
    return static_cast<std::int32_t>(std::lround(std::clamp(height_m, level_.low_m, level_.high_m) / level_.step_m));
  }

  const SideLine* side_of(const PlaneTriangulation::Point& a, const PlaneTriangulation::Point& b, std::int32_t* at) const {
    const bool upright = a.x == b.x;
    const MeshSide side = upright ? (a.x == 0 ? MeshSide::west : MeshSide::east) : (a.y == 0 ? MeshSide::south : MeshSide::north);
    *at = upright ? std::min(a.y, b.y) : std::min(a.x, b.x);
    return &plan_.lines[static_cast<std::size_t>(side)];
  }

  /// Where data ends, at the sea of this tile or of the next one.
  void add_wall(const QuantizedPlan::Face& face, std::uint32_t k) {
    const std::uint32_t from = face.vertex[k], to = face.vertex[(k + 1) % 3];
    if (face.beside[k] != kNone) {
      if (face.data && !plan_.faces[face.beside[k]].data) wall(from, to);
      return;
    }
    std::int32_t at = 0;
    const SideLine* line = side_of(plan_.vertices[from].at, plan_.vertices[to].at, &at);
    const auto piece =
        std::lower_bound(line->begin(), line->end(), at, [](const SidePoint& p, std::int32_t value) { return p.at < value; });
    if (face.data && !piece->data_after) wall(from, to);
    if (!face.data && piece->data_after) wall(to, from);
  }

  /// Data is to the left of the way. Seen from the lower side it is counter-clockwise, whichever side that is.
  void wall(std::uint32_t from, std::uint32_t to) {
    const std::uint32_t d = vertex(from, Kind::sea), c = vertex(to, Kind::sea), b = vertex(to, Kind::data),
                        a = vertex(from, Kind::data);
    if (c != b) out_.triangles.push_back({d, c, b});
    if (a != d) out_.triangles.push_back({d, b, a});
  }

  /// Where data and sea are above each other, first what the piece before ends with: the list is then one line without jumps
  /// back. The western side goes north and the northern one east, the eastern one south and the southern one west: CesiumJS sorts
  /// them so, by u or v alone, before it hangs skirts on them, and what is at one place stays as it comes.
  std::vector<std::uint32_t> side_vertices(MeshSide side) const {
    const bool far = side == MeshSide::east || side == MeshSide::north;
    const SideLine& line = plan_.lines[static_cast<std::size_t>(side)];
    struct Entry {
      std::int32_t at = 0;
      int rank = 0;
      std::uint32_t number = 0;
      auto operator<=>(const Entry&) const = default;
    };
    std::vector<Entry> found;
    for (std::size_t v = 0; v < number_.size(); ++v) {
      const auto [across, along] = across_and_along(side, {plan_.vertices[v].at.x, plan_.vertices[v].at.y, 0});
      if (across != (far ? kMostQuanta : 0)) continue;
      const auto here =
          std::lower_bound(line.begin(), line.end(), along, [](const SidePoint& p, std::int32_t value) { return p.at < value; });
      const bool data_first = here == line.begin() ? !here->data_after : std::prev(here)->data_after;
      const auto [data, sea] = number_[v];
      if (data != kNone) found.push_back({along, data_first ? 0 : 1, data});
      if (sea != kNone && sea != data) found.push_back({along, data_first ? 1 : 0, sea});
    }
    std::sort(found.begin(), found.end());
    if (side == MeshSide::south || side == MeshSide::east) std::reverse(found.begin(), found.end());
    std::vector<std::uint32_t> out;
    for (const Entry& entry : found) out.push_back(entry.number);
    return out;
  }

  const MeshGrid& grid_;
  proto::TileAddress tile_;
  QuantizedLevel level_;
  std::shared_ptr<const MeshIndex> mesh_;
  QuantizedPlan plan_;
  std::vector<std::array<std::uint32_t, 2>> number_;  // indexed by vertex of the plan: its data's and its sea's vertex
  std::vector<proto::Vec3> normals_;                  // indexed by vertex of the mesh
  QuantizedSurface out_;
};

}  // namespace

bool has_quantized_tile(const MeshGrid& grid, const proto::TileAddress& tile) {
  if (tile.z > grid.finest()) return false;
  if (tile.z == 0) return true;
  const std::int32_t x = tile.x & ~1, y = tile.y & ~1;
  return !grid.under(tile.z, {x, y, x + 1, y + 1}).empty();
}

QuantizedSurface quantized_surface(const MeshGrid& grid, const proto::TileAddress& tile) {
  return SurfaceMaker(grid, grid.quantized(tile.z), tile).make();
}

}  // namespace cordillera::pipeline::faces
