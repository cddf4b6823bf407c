#pragma once
// One mesh from the tiles of a level: vertices on common sides are one.
#include <array>
#include <functional>
#include <optional>
#include <span>
#include <unordered_map>

#include "pipeline/encode/draco_mesh.h"
#include "pipeline/exports/mesh/mesh_clip.h"
#include "proto/ellipsoid.h"
#include "proto/mesh_file/triangle_mesh.h"

namespace cordillera::pipeline::exports {

/// In place, from degrees and metres above the ellipsoid to a map's coordinates. All as long as each other.
using ToMap = std::function<void(std::span<double> x, std::span<double> y, std::span<double> height)>;

class MeshWelder {
 public:
  /// middle: column and row of the lattice's vertex that local coordinates count from. to_map: of frame map.
  MeshWelder(const proto::Lattice& lattice, const MeshWindow& window, MeshFrame frame, std::array<std::int64_t, 2> middle,
             ToMap to_map);

  /// x: the tile's column, which may lie beyond the circle.
  void add(const LatticeMesh& tile, std::int64_t x);

  /// Vertices may be in no triangle.
  proto::TriangleMesh& mesh() { return mesh_; }
  const proto::Vec3& origin_m() const { return origin_m_; }

 private:
  struct Key {
    std::int64_t column, row, height;
    friend bool operator==(const Key&, const Key&) = default;
  };
  struct Hash {
    std::size_t operator()(const Key& key) const;
  };

  std::uint32_t vertex(const Key& at, double height_m, bool shared);
  double nearness() const;
  std::optional<Key> on_box(const PlanPoint& at) const;
  std::uint32_t cut(std::uint32_t from, std::uint32_t to, double share, const PlanPoint& at);
  std::uint32_t push(const proto::Vec3& position);
  proto::Vec3 position(std::int64_t column, std::int64_t row, double height_m) const;
  void push_triangle(const std::array<std::uint32_t, 3>& triangle);
  bool inside(const LatticeMesh& tile, std::int64_t west, std::int64_t south) const;

  proto::Lattice lattice_;
  MeshWindow window_;
  MeshFrame frame_;
  ToMap to_map_;
  proto::Vec3 origin_m_, east_, north_, up_;
  proto::TriangleMesh mesh_;
  std::unordered_map<Key, std::uint32_t, Hash> sides_;   // vertices on tiles' sides
  std::unordered_map<Key, std::uint32_t, Hash> on_box_;  // vertices on the box's sides, by steps along them
};

}  // namespace cordillera::pipeline::exports
