#pragma once
// 3D Tiles' template addresses count from an implicit root: there is one for the western hemisphere and one for the eastern.
#include <optional>

#include "proto/lattice.h"

namespace cordillera::pipeline {

/// The tile at (level, x, y) of the implicit tileset W or E; none when there is no such place.
std::optional<proto::TileAddress> absolute_tile(char hemisphere, int level, std::int32_t x, std::int32_t y);

/// 'W' or 'E', and x counted from that hemisphere's own western edge.
char hemisphere_of(const proto::TileAddress& tile);
std::int32_t implicit_x(const proto::TileAddress& tile);

}  // namespace cordillera::pipeline
