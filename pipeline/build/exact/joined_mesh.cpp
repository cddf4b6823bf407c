#include "pipeline/build/exact/joined_mesh.h"

#include <algorithm>
#include <map>
#include <stdexcept>
#include <utility>

#include "gpu/exact/side_chain.h"
#include "pipeline/tile/border.h"
#include "pipeline/tile/void_tile.h"

namespace cordillera::pipeline {
namespace {

using gpu::exact::BlockMesh;

class Joining {
 public:
  explicit Joining(const MeshSquares& squares) : squares_(squares) {}

  BlockMesh mesh() {
    for (std::int32_t row = 0; row < squares_.up; ++row) {
      for (std::int32_t column = 0; column < squares_.across; ++column) {
        if (const proto::TileMesh* const mesh = squares_.at(column, row))
          append(*mesh, column, row);
        else
          append(without_data(column, row), column, row);
      }
    }
    return std::move(all_);
  }

 private:
  proto::TileMesh without_data(std::int32_t column, std::int32_t row) const {
    const auto beside = [&](std::int32_t dx, std::int32_t dy, Side facing) {
      const proto::TileMesh* const mesh = squares_.at(column + dx, row + dy);
      return mesh ? border_chain(*mesh, facing) : void_chain(squares_.side, squares_.side / gpu::exact::kVoidChords);
    };
    std::array<Chain, 4> border;
    border[static_cast<std::size_t>(Side::west)] = beside(-1, 0, Side::east);
    border[static_cast<std::size_t>(Side::east)] = beside(1, 0, Side::west);
    border[static_cast<std::size_t>(Side::south)] = beside(0, -1, Side::north);
    border[static_cast<std::size_t>(Side::north)] = beside(0, 1, Side::south);
    return void_tile(squares_.side, border);
  }
  void append(const proto::TileMesh& mesh, std::int32_t column, std::int32_t row) {
    const std::int32_t side = squares_.side, west = column * side, south = row * side;
    std::vector<std::uint32_t> number(mesh.vertices());
    for (std::size_t v = 0; v < number.size(); ++v) {
      const bool on_side = mesh.x[v] == 0 || mesh.y[v] == 0 || mesh.x[v] == side || mesh.y[v] == side;
      const std::int32_t x = west + mesh.x[v], y = south + mesh.y[v];
      const auto next = static_cast<std::uint32_t>(all_.vertices());
      const std::uint8_t is_void = proto::is_void(mesh, v) ? 1 : 0;
      number[v] = next;
      if (on_side) {
        const auto [there, added] =
            on_sides_.try_emplace(static_cast<std::uint64_t>(x) << 32 | static_cast<std::uint64_t>(y), next);
        number[v] = there->second;
        if (!added) {
          if (all_.height[number[v]] != mesh.height[v] || all_.is_void[number[v]] != is_void)
            throw std::logic_error("meshes above exact blocks differ on the side between them");
          continue;
        }
      }
      all_.x.push_back(static_cast<std::uint16_t>(x));
      all_.y.push_back(static_cast<std::uint16_t>(y));
      all_.height.push_back(mesh.height[v]);
      all_.is_void.push_back(is_void);
    }
    for (const auto& t : mesh.triangles) all_.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
  }

  const MeshSquares& squares_;
  BlockMesh all_;
  std::map<std::uint64_t, std::uint32_t> on_sides_;  ///< where squares meet
};

}  // namespace

BlockMesh joined_mesh(const MeshSquares& squares) { return Joining(squares).mesh(); }

namespace {
constexpr std::uint32_t kUnnumbered = UINT32_MAX;
}

MeshParts::MeshParts(const BlockMesh& mesh) : mesh_(mesh), number_(mesh.vertices(), kUnnumbered) {}

std::vector<std::uint32_t> MeshParts::vertices_of(const std::vector<std::uint32_t>& triangles) {
  std::vector<std::uint32_t> vertices;
  for (const std::uint32_t t : triangles) {
    for (const std::uint32_t v : mesh_.triangles[t]) {
      if (std::exchange(number_[v], 0) == kUnnumbered) vertices.push_back(v);
    }
  }
  for (const std::uint32_t v : vertices) number_[v] = kUnnumbered;
  return vertices;
}

proto::TileMesh MeshParts::part(const std::vector<std::uint32_t>& vertices, const std::vector<std::uint32_t>& triangles,
                                std::int64_t dx, std::int64_t dy) {
  proto::TileMesh part;
  for (const std::uint32_t v : vertices) {
    number_[v] = static_cast<std::uint32_t>(part.vertices());
    part.x.push_back(static_cast<std::int32_t>(mesh_.x[v] + dx));
    part.y.push_back(static_cast<std::int32_t>(mesh_.y[v] + dy));
    part.height.push_back(mesh_.height[v]);
    part.mark.push_back(mesh_.is_void[v] ? proto::kVoid : 0);
  }
  part.triangles.reserve(triangles.size());
  for (const std::uint32_t t : triangles) {
    const auto& [a, b, c] = mesh_.triangles[t];
    part.triangles.push_back({number_[a], number_[b], number_[c]});
  }
  for (const std::uint32_t v : vertices) number_[v] = kUnnumbered;
  return part;
}

std::vector<proto::TileMesh> cut_mesh(const BlockMesh& mesh, std::int32_t across, std::int32_t up, std::int32_t side) {
  std::vector<std::vector<std::uint32_t>> triangles(static_cast<std::size_t>(across * up));
  std::vector<std::uint8_t> has_data(triangles.size());
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    const auto& c = mesh.triangles[t];
    const std::int32_t x = std::min({mesh.x[c[0]], mesh.x[c[1]], mesh.x[c[2]]}) / side,
                       y = std::min({mesh.y[c[0]], mesh.y[c[1]], mesh.y[c[2]]}) / side;
    const auto k = static_cast<std::size_t>(y * across + x);
    triangles[k].push_back(t);
    for (const std::uint32_t v : c) has_data[k] |= static_cast<std::uint8_t>(mesh.is_void[v] == 0);
  }
  std::vector<proto::TileMesh> squares(triangles.size());
  MeshParts cut(mesh);
  for (std::size_t k = 0; k < squares.size(); ++k) {
    const auto column = static_cast<std::int32_t>(k) % across, row = static_cast<std::int32_t>(k) / across;
    if (!has_data[k]) continue;
    squares[k] = cut.part(cut.vertices_of(triangles[k]), triangles[k], -std::int64_t{column} * side, -std::int64_t{row} * side);
    squares[k].side = side;
  }
  return squares;
}

}  // namespace cordillera::pipeline
