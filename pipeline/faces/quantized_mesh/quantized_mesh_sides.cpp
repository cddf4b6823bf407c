#include "pipeline/faces/quantized_mesh/quantized_mesh_sides.h"

#include <algorithm>
#include <iterator>
#include <map>

namespace cordillera::pipeline::faces {
namespace {

struct SidePiece {
  std::int32_t from = 0, to = 0;                // units
  std::int32_t from_height = 0, to_height = 0;  // steps
  friend auto operator<=>(const SidePiece&, const SidePiece&) = default;
};

bool vertical(MeshSide side) { return side == MeshSide::west || side == MeshSide::east; }

std::vector<SidePiece> pieces_of(const MeshIndex* index, MeshSide side) {
  std::vector<SidePiece> out;
  if (index == nullptr) return out;
  const LatticeMesh& mesh = index->mesh();
  const std::int32_t line = side == MeshSide::east || side == MeshSide::north ? mesh.side : 0;
  for (const Triangle& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      const auto &p = mesh.points[t[k]], &q = mesh.points[t[(k + 1) % 3]];
      const auto a = across_and_along(side, p), b = across_and_along(side, q);
      if (a[0] != line || b[0] != line) continue;
      if (a[1] < b[1]) {
        out.push_back({a[1], b[1], p[2], q[2]});
      } else
        out.push_back({b[1], a[1], q[2], p[2]});
    }
  }
  std::sort(out.begin(), out.end());
  return out;
}

std::vector<SidePiece> common_pieces(const MeshGrid& grid, const proto::TileAddress& tile, MeshSide side) {
  proto::TileAddress other = tile;
  const std::int32_t across = grid.across(tile.z);
  other.x = (tile.x + (side == MeshSide::east ? 1 : side == MeshSide::west ? -1 : 0) + across) % across;
  other.y += side == MeshSide::north ? 1 : side == MeshSide::south ? -1 : 0;
  const auto own = grid.mesh(tile);
  std::vector<SidePiece> mine = pieces_of(own.get(), side);
  if (mine.empty() || other.y < 0 || other.y >= grid.up(tile.z)) return mine;
  constexpr std::array<MeshSide, 4> kOpposite = {MeshSide::east, MeshSide::north, MeshSide::west, MeshSide::south};
  const auto neighbour = grid.mesh(other);
  const std::vector<SidePiece> theirs = pieces_of(neighbour.get(), kOpposite[static_cast<std::size_t>(side)]);
  std::vector<SidePiece> both;
  std::set_intersection(mine.begin(), mine.end(), theirs.begin(), theirs.end(), std::back_inserter(both));
  return both;
}

/// Of vertices that fall on one quantum the nearest to it counts: a corner always does, whichever side it is seen from.
class Line {
 public:
  explicit Line(std::int32_t side) : side_(side) {}

  void add(std::int32_t units, std::int32_t height) {
    const std::int32_t at = quanta(units, side_);
    const auto [found, fresh] = points_.try_emplace(at, SidePoint{at, units, height, false});
    if (!fresh && distance(units, at) < distance(found->second.units, at)) {
      found->second = {at, units, height, found->second.data_after};
    }
  }
  void add_sea(std::int32_t units) {
    const std::int32_t at = quanta(units, side_);
    auto after = points_.upper_bound(at);
    if (after != points_.begin() && (std::prev(after)->first == at || std::prev(after)->second.data_after)) return;
    points_.try_emplace(at, SidePoint{at, units, 0, false});
  }
  void mark_data(std::int32_t from, std::int32_t to) {
    if (quanta(from, side_) < quanta(to, side_)) points_.at(quanta(from, side_)).data_after = true;
  }
  SideLine points() const {
    SideLine out;
    for (const auto& [at, point] : points_) out.push_back(point);
    return out;
  }
  /// What is no end of a piece any more, since all of its pieces were shorter than a quantum.
  void drop_single_points() {
    bool before = false;
    for (auto it = points_.begin(); it != points_.end();) {
      const bool after = it->second.data_after;
      it = before || after ? std::next(it) : points_.erase(it);
      before = after;
    }
  }

 private:
  std::int64_t distance(std::int32_t units, std::int32_t at) const {
    const std::int64_t d = std::int64_t{units} * kMostQuanta - std::int64_t{at} * side_;
    return d < 0 ? -d : d;
  }
  std::int32_t side_;
  std::map<std::int32_t, SidePoint> points_;
};

}  // namespace

std::array<std::int32_t, 2> across_and_along(MeshSide side, const std::array<std::int32_t, 3>& point) {
  return vertical(side) ? std::array{point[0], point[1]} : std::array{point[1], point[0]};
}

SideLine side_line(const MeshGrid& grid, const QuantizedLevel& level, const proto::TileAddress& tile, MeshSide side) {
  const std::int32_t units = grid.side(tile.z);
  Line line(units);
  const std::vector<SidePiece> pieces = common_pieces(grid, tile, side);
  for (const SidePiece& piece : pieces) {
    line.add(piece.from, piece.from_height);
    line.add(piece.to, piece.to_height);
  }
  for (const SidePiece& piece : pieces) line.mark_data(piece.from, piece.to);
  line.drop_single_points();
  for (std::int32_t k = 0; k <= level.sea_cells; ++k) line.add_sea(units / level.sea_cells * k);
  return line.points();
}

}  // namespace cordillera::pipeline::faces
