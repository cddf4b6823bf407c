#include "pipeline/tileset/subtree.h"

#include <algorithm>

#include "pipeline/encode/little_endian.h"
#include "pipeline/tileset/implicit_tile.h"
#include "pipeline/tileset/subtree_file.h"
#include "pipeline/tileset/tileset.h"

namespace cordillera::pipeline {
namespace {

// Availability and, in availability order, the rows of the property table.
struct Availability {
  AvailabilityBits tiles{first_of_level(kSubtreeLevels)};
  AvailabilityBits contents{first_of_level(kSubtreeLevels)};
  AvailabilityBits subtrees{std::size_t{1} << (2 * kSubtreeLevels)};
  std::string regions, errors;
};

// A hemisphere's nodes at one depth below the subtree's root, with their place in Morton order.
std::vector<std::pair<std::uint32_t, TileExtent>> level_nodes(const StoreReader& store, const proto::TileAddress& root,
                                                              int depth) {
  const std::int32_t x0 = root.x << depth, y0 = root.y << depth, last = (1 << depth) - 1;
  std::vector<std::pair<std::uint32_t, TileExtent>> out;
  for (const TileExtent& node : store.extents(root.z + depth, x0, y0, x0 + last, y0 + last)) {
    out.emplace_back(morton(static_cast<std::uint32_t>(node.tile.x - x0), static_cast<std::uint32_t>(node.tile.y - y0)), node);
  }
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return out;
}

Availability gather(const StoreReader& store, const proto::TileAddress& root) {
  const RefineErrors errors(store.manifest());
  Availability out;
  for (int depth = 0; depth < kSubtreeLevels; ++depth) {
    for (const auto& [place, node] : level_nodes(store, root, depth)) {
      out.tiles.set(first_of_level(depth) + place);
      if (node.content) out.contents.set(first_of_level(depth) + place);
      for (const double number : node.region) append_little_endian(out.regions, number);
      append_little_endian(out.errors, errors.of(node));
    }
  }
  for (const auto& [place, node] : level_nodes(store, root, kSubtreeLevels)) out.subtrees.set(place);
  return out;
}

}  // namespace

std::optional<std::string> subtree(const StoreReader& store, char hemisphere, int level, std::int32_t x, std::int32_t y) {
  const auto root = absolute_tile(hemisphere, level, x, y);
  if (!root || level % kSubtreeLevels != 0) return std::nullopt;
  const Availability found = gather(store, *root);
  if (found.tiles.available() == 0) return std::nullopt;

  SubtreeFile file;
  const Json tiles = file.availability(found.tiles), contents = file.availability(found.contents);
  const Json subtrees = file.availability(found.subtrees);
  const Json properties = {{"region", {{"values", file.add(found.regions)}}},
                           {"geometric_error", {{"values", file.add(found.errors)}}}};
  Json json;
  json["propertyTables"] = Json::array({{{"class", "tile"}, {"count", found.tiles.available()}, {"properties", properties}}});
  json["tileAvailability"] = tiles;
  json["contentAvailability"] = Json::array({contents});
  json["childSubtreeAvailability"] = subtrees;
  json["tileMetadata"] = 0;
  return file.bytes(json);
}

}  // namespace cordillera::pipeline
