#include "pipeline/faces/walk.h"

namespace cordillera::pipeline::faces {
namespace {

void walk(const StoreReader& store, const TileExtent& node, const std::function<void(const TileExtent&)>& visit) {
  visit(node);
  const auto& [z, x, y] = node.tile;
  if (z >= static_cast<int>(store.manifest().max_level())) return;
  for (const TileExtent& child : store.extents(z + 1, 2 * x, 2 * y, 2 * x + 1, 2 * y + 1)) walk(store, child, visit);
}

}  // namespace

void walk_tiles(const StoreReader& store, const std::function<void(const TileExtent&)>& visit) {
  for (const TileExtent& root : store.extents(0, 0, 0, 1, 0)) walk(store, root, visit);
}

}  // namespace cordillera::pipeline::faces
