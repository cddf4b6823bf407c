#include "pipeline/tile/border.h"

#include <algorithm>
#include <string>

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;

bool runs_north(Side side) { return side == Side::west || side == Side::east; }

std::int32_t height_or_none(const TileMesh& mesh, std::uint32_t v) {
  return is_void(mesh, v) ? proto::kNoHeight : mesh.height[v];
}

}  // namespace

std::vector<std::uint32_t> side_vertices(const TileMesh& mesh, Side side) {
  const auto& across = runs_north(side) ? mesh.x : mesh.y;
  const auto& along = runs_north(side) ? mesh.y : mesh.x;
  const std::int32_t line = side == Side::west || side == Side::south ? 0 : mesh.side;
  std::vector<std::uint32_t> found;
  for (std::uint32_t v = 0; v < mesh.vertices(); ++v)
    if (across[v] == line) found.push_back(v);
  std::sort(found.begin(), found.end(), [&](std::uint32_t a, std::uint32_t b) { return along[a] < along[b]; });
  return found;
}

Chain border_chain(const TileMesh& mesh, Side side) {
  const auto& along = runs_north(side) ? mesh.y : mesh.x;
  Chain chain;
  for (const std::uint32_t v : side_vertices(mesh, side)) {
    chain.position.push_back(along[v]);
    chain.height.push_back(height_or_none(mesh, v));
  }
  return chain;
}

proto::Result<void> apply_chain(TileMesh& mesh, Side side, const Chain& chain) {
  const auto& along = runs_north(side) ? mesh.y : mesh.x;
  std::size_t next = 0;
  for (const std::uint32_t v : side_vertices(mesh, side)) {
    const bool stays = next < chain.position.size() && chain.position[next] == along[v];
    if (stays && chain.height[next] != height_or_none(mesh, v)) break;
    next += stays ? 1 : 0;
    mesh.mark[v] = static_cast<std::uint8_t>((mesh.mark[v] & proto::kVoid) | (stays ? proto::kKeep : proto::kRemove));
  }
  if (next == chain.position.size()) return {};
  return proto::Problem{
      "chain-not-in-mesh",
      "vertex " + std::to_string(chain.position[next]) + " of a border chain is not on that side of the mesh, or differs there",
      "", ""};
}

}  // namespace cordillera::pipeline
