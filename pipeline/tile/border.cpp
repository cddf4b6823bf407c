#include "pipeline/tile/border.h"

#include <algorithm>

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;

bool runs_north(Side side) { return side == Side::west || side == Side::east; }

std::int32_t height_or_none(const TileMesh& mesh, std::uint32_t v) {
  return is_void(mesh, v) ? proto::kNoHeight : mesh.height[v];
}

}  // namespace

Chain void_chain(std::int32_t units, std::int32_t gap) {
  const std::int64_t step = gap > 0 ? gap : units;
  Chain chain;
  for (std::int64_t k = 0; k < units; k += step) chain.position.push_back(static_cast<std::int32_t>(k));
  chain.position.push_back(units);
  chain.height.assign(chain.position.size(), proto::kNoHeight);
  return chain;
}

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

}  // namespace cordillera::pipeline
