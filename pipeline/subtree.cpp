#include "pipeline/subtree.h"

#include <algorithm>

#include "pipeline/json.h"
#include "pipeline/little_endian.h"
#include "pipeline/implicit_tile.h"
#include "pipeline/tileset.h"

namespace cordillera::pipeline {
namespace {

constexpr std::uint32_t kMagic = 0x74627573;  // "subt"
constexpr std::uint32_t kVersion = 1;

// Bits of x and y by turns, x lowest.
std::uint32_t morton(std::uint32_t x, std::uint32_t y) {
  std::uint32_t out = 0;
  for (int bit = 0; bit < kSubtreeLevels; ++bit) out |= ((x >> bit & 1) << (2 * bit)) | ((y >> bit & 1) << (2 * bit + 1));
  return out;
}

std::size_t first_of_level(int depth) { return ((std::size_t{1} << (2 * depth)) - 1) / 3; }

class Bits {
 public:
  explicit Bits(std::size_t count) : count_(count), bytes_((count + 7) / 8, '\0') {}
  void set(std::size_t i) {
    bytes_[i / 8] = static_cast<char>(bytes_[i / 8] | 1 << (i % 8));
    ++set_;
  }
  std::size_t available() const { return set_; }
  bool uniform() const { return set_ == 0 || set_ == count_; }
  const std::string& bytes() const { return bytes_; }

 private:
  std::size_t count_, set_ = 0;
  std::string bytes_;
};

// Availability and, in availability order, the rows of the property table.
struct Availability {
  Bits tiles{first_of_level(kSubtreeLevels)};
  Bits contents{first_of_level(kSubtreeLevels)};
  Bits subtrees{std::size_t{1} << (2 * kSubtreeLevels)};
  std::string regions, errors;
};

// A hemisphere's nodes at one depth below the subtree's root, with their place in Morton order.
std::vector<std::pair<std::uint32_t, TileExtent>> level_nodes(const StoreReader& store, const proto::TileAddress& root, int depth) {
  const std::int32_t x0 = root.x << depth, y0 = root.y << depth, last = (1 << depth) - 1;
  std::vector<std::pair<std::uint32_t, TileExtent>> out;
  for (const TileExtent& node : store.extents(root.z + depth, x0, y0, x0 + last, y0 + last)) {
    out.emplace_back(morton(static_cast<std::uint32_t>(node.tile.x - x0), static_cast<std::uint32_t>(node.tile.y - y0)), node);
  }
  std::sort(out.begin(), out.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return out;
}

Availability gather(const StoreReader& store, const proto::TileAddress& root) {
  const double empty_error = empty_error_m(store.manifest());
  Availability out;
  for (int depth = 0; depth < kSubtreeLevels; ++depth) {
    for (const auto& [place, node] : level_nodes(store, root, depth)) {
      out.tiles.set(first_of_level(depth) + place);
      if (node.content) out.contents.set(first_of_level(depth) + place);
      for (const double number : node.region) append_little_endian(out.regions, number);
      append_little_endian(out.errors, node.content ? node.geometric_error_m : empty_error);
    }
  }
  for (const auto& [place, node] : level_nodes(store, root, kSubtreeLevels)) out.subtrees.set(place);
  return out;
}

struct Buffer {
  Json views = Json::array();
  std::string bytes;

  std::size_t add(const std::string& part) {
    views.push_back({{"buffer", 0}, {"byteOffset", bytes.size()}, {"byteLength", part.size()}});
    bytes += part;
    pad(bytes, 8, '\0');
    return views.size() - 1;
  }
};

Json availability(const Bits& bits, Buffer& buffer) {
  if (bits.uniform()) return {{"constant", bits.available() > 0 ? 1 : 0}};
  return {{"bitstream", buffer.add(bits.bytes())}, {"availableCount", bits.available()}};
}

std::string pack(std::string json, std::string binary) {
  pad(json, 8, ' ');
  pad(binary, 8, '\0');
  std::string out;
  append_little_endian(out, kMagic);
  append_little_endian(out, kVersion);
  append_little_endian(out, std::uint64_t{json.size()});
  append_little_endian(out, std::uint64_t{binary.size()});
  return out + json + binary;
}

}  // namespace

std::optional<std::string> subtree(const StoreReader& store, char hemisphere, int level, std::int32_t x, std::int32_t y) {
  const auto root = absolute_tile(hemisphere, level, x, y);
  if (!root || level % kSubtreeLevels != 0) return std::nullopt;
  const Availability found = gather(store, *root);
  if (found.tiles.available() == 0) return std::nullopt;

  Buffer buffer;
  Json json;
  const Json tiles = availability(found.tiles, buffer), contents = availability(found.contents, buffer);
  const Json subtrees = availability(found.subtrees, buffer);
  const Json properties = {{"region", {{"values", buffer.add(found.regions)}}}, {"geometric_error", {{"values", buffer.add(found.errors)}}}};
  json["buffers"] = Json::array({{{"byteLength", buffer.bytes.size()}}});
  json["bufferViews"] = buffer.views;
  json["propertyTables"] = Json::array({{{"class", "tile"}, {"count", found.tiles.available()}, {"properties", properties}}});
  json["tileAvailability"] = tiles;
  json["contentAvailability"] = Json::array({contents});
  json["childSubtreeAvailability"] = subtrees;
  json["tileMetadata"] = 0;
  return pack(json.dump(), buffer.bytes);
}

}  // namespace cordillera::pipeline
