#include "pipeline/tileset/implicit_tile.h"

namespace cordillera::pipeline {

char hemisphere_of(const proto::TileAddress& tile) { return tile.x >> tile.z == 0 ? 'W' : 'E'; }

std::int32_t implicit_x(const proto::TileAddress& tile) { return tile.x & ((std::int32_t{1} << tile.z) - 1); }

std::optional<proto::TileAddress> absolute_tile(char hemisphere, int level, std::int32_t x, std::int32_t y) {
  if ((hemisphere != 'W' && hemisphere != 'E') || level < 0 || level > proto::kMaxLevel) return std::nullopt;
  const std::int32_t side = std::int32_t{1} << level;
  if (x < 0 || x >= side || y < 0 || y >= side) return std::nullopt;
  return proto::TileAddress{level, hemisphere == 'E' ? side + x : x, y};
}

}  // namespace cordillera::pipeline
