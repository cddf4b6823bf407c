#include "pipeline/faces/mesh_normals.h"

#include <array>
#include <cmath>
#include <map>

namespace cordillera::pipeline::faces {
namespace {

using proto::Vec3;
using LatticeVertex = std::array<std::int64_t, 2>;  // column and row of the finest lattice

/// One tile's vertices on the ellipsoid.
class NormalGround {
 public:
  NormalGround(const proto::Lattice& lattice, const MeshIndex& index)
      : lattice_(lattice), mesh_(index.mesh()), west_(lattice.west(index.tile())), south_(lattice.south(index.tile())) {}

  LatticeVertex place(std::uint32_t v) const {
    return {(west_ + mesh_.points[v][0]) % lattice_.columns(), south_ + mesh_.points[v][1]};
  }
  bool on_side(std::uint32_t v) const {
    const auto& p = mesh_.points[v];
    return p[0] == 0 || p[0] == mesh_.side || p[1] == 0 || p[1] == mesh_.side;
  }
  Vec3 point(std::uint32_t v) { return proto::ecef(row(v), column(v), mesh_.points[v][2] * mesh_.height_step); }
  Vec3 up(std::uint32_t v) { return proto::normal(row(v), column(v)); }

 private:
  const proto::RowFrame& row(std::uint32_t v) {
    const auto [found, fresh] = rows_.try_emplace(mesh_.points[v][1]);
    if (fresh) found->second = proto::row_frame(lattice_, south_ + mesh_.points[v][1]);
    return found->second;
  }
  const proto::ColumnFrame& column(std::uint32_t v) {
    const auto [found, fresh] = columns_.try_emplace(mesh_.points[v][0]);
    if (fresh) found->second = proto::column_frame(lattice_, west_ + mesh_.points[v][0]);
    return found->second;
  }

  const proto::Lattice& lattice_;
  const LatticeMesh& mesh_;
  std::int64_t west_, south_;
  std::map<std::int32_t, proto::RowFrame> rows_;
  std::map<std::int32_t, proto::ColumnFrame> columns_;
};

/// What the triangles add to each of their corners. Weights of N. Max, "Weights for computing vertex normals from facet normals",
/// 1999.
template <class Wanted, class Add>
void each_corner(NormalGround& ground, const LatticeMesh& mesh, const Wanted& wanted, const Add& add) {
  for (const Triangle& t : mesh.triangles) {
    if (!wanted(t[0]) && !wanted(t[1]) && !wanted(t[2])) continue;
    const std::array at = {ground.point(t[0]), ground.point(t[1]), ground.point(t[2])};
    for (std::size_t k = 0; k < 3; ++k) {
      const Vec3 a = at[(k + 1) % 3] - at[k], b = at[(k + 2) % 3] - at[k];
      const double weight = dot(a, a) * dot(b, b);
      if (weight > 0 && wanted(t[k])) add(t[k], (1 / weight) * cross(a, b));
    }
  }
}

/// By place on the tile's sides: the sums of all tiles there that count, in the order of their addresses, which is the same seen
/// from each.
template <class Counts>
std::map<LatticeVertex, Vec3> side_sums(const Terrain& terrain, const proto::Lattice& lattice, const MeshIndex& own,
                                        const Counts& counts) {
  std::map<LatticeVertex, std::map<proto::TileAddress, Vec3>> parts;
  NormalGround ground(lattice, own);
  for (std::uint32_t v = 0; v < own.mesh().points.size(); ++v) {
    if (ground.on_side(v)) parts[ground.place(v)];
  }
  const auto [z, x, y] = own.tile();
  for (std::int32_t dy = -1; dy <= 1 && !parts.empty(); ++dy) {
    for (std::int32_t dx = -1; dx <= 1; ++dx) {
      if (dx == 1 && proto::tiles_across(z) == 2) continue;  // the one to the west once more
      const proto::TileAddress tile{z, (x + dx + proto::tiles_across(z)) % proto::tiles_across(z), y + dy};
      if (tile.y < 0 || tile.y >= proto::tiles_up(z)) continue;
      if (!counts(tile)) continue;
      const auto mesh = terrain.mesh(tile);
      if (!mesh) continue;
      NormalGround there(lattice, *mesh);
      each_corner(
          there, mesh->mesh(), [&](std::uint32_t v) { return there.on_side(v) && parts.contains(there.place(v)); },
          [&](std::uint32_t v, Vec3 part) {
            Vec3& sum = parts[there.place(v)][tile];
            sum = sum + part;
          });
    }
  }
  std::map<LatticeVertex, Vec3> sums;
  for (const auto& [place, by_tile] : parts) {
    for (const auto& [tile, part] : by_tile) sums[place] = sums[place] + part;
  }
  return sums;
}

}  // namespace

SideNormals side_normals(const Terrain& terrain, const MeshIndex& mesh) {
  const proto::Lattice lattice = terrain.lattice();
  const proto::TileAddress own = mesh.tile();
  const int blocks = terrain.store().block_level();
  // Above the blocks all tiles are made together.
  const auto counts = [&](const proto::TileAddress& tile) {
    return own.z < blocks || tile.at_level(blocks) == own.at_level(blocks);
  };
  const auto side_counts = [&](std::int32_t dx, std::int32_t dy) {
    const std::int32_t across = proto::tiles_across(own.z);
    return counts({own.z, (own.x + dx + across) % across, own.y + dy});
  };
  const bool west = side_counts(-1, 0), east = side_counts(1, 0), south = side_counts(0, -1), north = side_counts(0, 1);
  const NormalGround ground(lattice, mesh);
  const std::map<LatticeVertex, Vec3> sums = side_sums(terrain, lattice, mesh, counts);
  const std::int32_t side = mesh.mesh().side;
  SideNormals out;
  for (std::uint32_t v = 0; v < mesh.mesh().points.size(); ++v) {
    const auto& [x, y, height] = mesh.mesh().points[v];
    const bool inside = (x > 0 || west) && (x < side || east) && (y > 0 || south) && (y < side || north);
    const auto found = inside ? sums.find(ground.place(v)) : sums.end();
    if (found != sums.end()) out[{x, y}] = found->second;
  }
  return out;
}

std::vector<Vec3> mesh_normals(const Terrain& terrain, const MeshIndex& mesh) {
  const proto::Lattice lattice = terrain.lattice();
  NormalGround ground(lattice, mesh);
  std::vector<Vec3> out(mesh.mesh().points.size());
  each_corner(
      ground, mesh.mesh(), [](std::uint32_t) { return true; }, [&](std::uint32_t v, Vec3 part) { out[v] = out[v] + part; });
  std::map<LatticeVertex, Vec3> sides = side_sums(terrain, lattice, mesh, [](const proto::TileAddress&) { return true; });
  for (std::uint32_t v = 0; v < out.size(); ++v) {
    if (ground.on_side(v)) out[v] = sides[ground.place(v)];
    const double length = std::sqrt(dot(out[v], out[v]));
    out[v] = length > 0 ? (1 / length) * out[v] : ground.up(v);
  }
  return out;
}

}  // namespace cordillera::pipeline::faces
