#pragma once
// Names of tiles and subtrees, the same in URLs and in static folders.
#include <optional>
#include <string>
#include <string_view>

#include "pipeline/store.h"

namespace cordillera::pipeline {

/// The tile at (level, x, y) of the implicit tileset W or E; none when there is no such place.
std::optional<proto::TileAddress> absolute_tile(char hemisphere, int level, std::int32_t x, std::int32_t y);

struct TilePath {
  proto::TileAddress tile;
  Face face = Face::drc;
};
/// What follows tiles/: "{z}/{x}/{y}.drc" or ".glb" (absolute), "W/{level}/{x}/{y}.glb" or "E/…" (implicit; .drc too). Numbers are
/// plain decimals without sign or leading zeros, so that a tile has one name a face.
std::optional<TilePath> parse_tile_path(std::string_view path);

struct SubtreePath {
  char hemisphere = 'W';
  int level = 0;
  std::int32_t x = 0, y = 0;
};
/// What follows subtrees/: "W/{level}/{x}/{y}.subtree" or "E/…".
std::optional<SubtreePath> parse_subtree_path(std::string_view path);

/// "tiles/{z}/{x}/{y}.drc".
std::string drc_path(const proto::TileAddress& tile);
/// "tiles/W/{level}/{x}/{y}.glb" or E.
std::string glb_path(const proto::TileAddress& tile);
/// "subtrees/W/{level}/{x}/{y}.subtree" or E, for the absolute address of a subtree's root.
std::string subtree_path(const proto::TileAddress& root);
/// 'W' or 'E', and x counted from that hemisphere's own western edge.
char hemisphere_of(const proto::TileAddress& tile);
std::int32_t implicit_x(const proto::TileAddress& tile);

}  // namespace cordillera::pipeline
