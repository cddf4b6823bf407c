#include "pipeline/check/folder_documents.h"

#include <cstdint>
#include <utility>

#include "pipeline/encode/little_endian.h"
#include "pipeline/encode/strange_json.h"
#include "pipeline/tileset/implicit_tile.h"
#include "pipeline/tileset/subtree.h"
#include "proto/files.h"

namespace cordillera::pipeline::check {
namespace {

constexpr std::size_t kHeader = 24;  // bytes of a subtree file: magic, version, length of the JSON and of the rest

constexpr std::size_t kTiles = first_of_level(kSubtreeLevels);             // of a subtree
constexpr std::size_t kChildren = std::size_t{1} << (2 * kSubtreeLevels);  // subtrees whose roots are below it

/// Bits of an availability of so many, least first in each byte.
std::vector<bool> bits_of(const Json& availability, std::size_t count, const Json& views, std::string_view binary) {
  if (availability.contains("constant")) return std::vector<bool>(count, availability["constant"].get<int>() == 1);
  const Json& view = views.at(availability.at("bitstream").get<std::size_t>());
  const std::string_view bytes =
      binary.substr(view.at("byteOffset").get<std::size_t>(), view.at("byteLength").get<std::size_t>());
  std::vector<bool> bits(count);
  for (std::size_t k = 0; k < count; ++k) bits[k] = (static_cast<unsigned char>(bytes.at(k / 8)) >> (k % 8) & 1) != 0;
  return bits;
}

/// A tile's place among those of its level and of its subtree.
std::uint32_t place_of(std::int32_t x, std::int32_t y, int depth) {
  const std::int32_t within = (1 << depth) - 1;
  return morton(static_cast<std::uint32_t>(x & within), static_cast<std::uint32_t>(y & within));
}

/// Both lists empty where the bytes are no subtree.
FolderDocuments::Subtree subtree_in(std::string_view bytes) {
  if (bytes.size() < kHeader || !bytes.starts_with("subt")) return {};
  const auto json_bytes = little_endian_at<std::uint64_t>(bytes, 8), binary_bytes = little_endian_at<std::uint64_t>(bytes, 16);
  if (json_bytes > bytes.size() || binary_bytes > bytes.size() || kHeader + json_bytes + binary_bytes != bytes.size()) return {};
  try {
    const Json json = json_of_stranger(bytes.substr(kHeader, json_bytes));
    const Json views = json.value("bufferViews", Json::array());
    const std::string_view binary = bytes.substr(kHeader + json_bytes);
    std::vector<bool> named = bits_of(json.at("contentAvailability").at(0), kTiles, views, binary);
    const std::vector<bool> tiles = bits_of(json.at("tileAvailability"), kTiles, views, binary);
    for (std::size_t k = 0; k < named.size(); ++k) named[k] = named[k] && tiles[k];
    return {std::move(named), bits_of(json.at("childSubtreeAvailability"), kChildren, views, binary)};
  } catch (const std::exception&) {  // of the JSON library, and of a place outside of the bytes
    return {};
  }
}

/// Why a client finds no tile by it; empty where it may.
std::string fault_of_tileset(const std::filesystem::path& file) {
  const auto bytes = proto::bytes_of_file(file);
  if (!bytes) return "it is missing: no client of 3D Tiles can open the folder";
  const Json json = json_of_stranger(*bytes);
  if (!json.is_object()) return std::string("it is no JSON ") + kStrangeJson;
  return json.contains("asset") && json.contains("root") && json["root"].contains("children") ? "" : "it names no tiles";
}

}  // namespace

FolderDocuments::FolderDocuments(std::filesystem::path folder, Report& report) : folder_(std::move(folder)), report_(report) {
  std::error_code error;
  is_implicit_ = std::filesystem::exists(folder_ / "tileset.json", error) ||
                 !std::filesystem::exists(folder_ / "tileset-explicit.json", error);
  if (!is_implicit_) return;
  if (std::string fault = fault_of_tileset(folder_ / "tileset.json"); !fault.empty())
    report_.findings.add("tileset.json", std::move(fault));
}

std::string FolderDocuments::Root::file() const {
  return std::string("subtrees/") + hemisphere + "/" + std::to_string(z) + "/" + std::to_string(x) + "/" + std::to_string(y) +
         ".subtree";
}

const FolderDocuments::Subtree& FolderDocuments::subtree_of(const Root& root) {
  const std::string file = root.file();
  const auto [found, fresh] = subtrees_.try_emplace(file);
  Subtree& subtree = found->second;  // stays where it is when others come
  if (!fresh) return subtree;
  const auto bytes = proto::bytes_of_file(folder_ / file);
  if (bytes) subtree = subtree_in(*bytes);
  if (subtree.contents.empty()) report_.findings.add(file, bytes ? "it is no subtree file" : "it is missing");
  if (root.z > 0 && bytes) find_from_above(root);
  return subtree;
}

/// A client comes to a subtree by the one above it alone.
void FolderDocuments::find_from_above(const Root& root) {
  const Root parent{root.hemisphere, root.z - kSubtreeLevels, root.x >> kSubtreeLevels, root.y >> kSubtreeLevels};
  const Subtree& above = subtree_of(parent);
  if (!above.children.empty() && !above.children[place_of(root.x, root.y, kSubtreeLevels)])
    report_.findings.add(parent.file(), "it does not name the subtree " + root.file() + ", which is there");
}

void FolderDocuments::add(const proto::TileAddress& tile) {
  if (!is_implicit_) return;
  const int depth = tile.z % kSubtreeLevels;
  const std::int32_t x = implicit_x(tile);
  const Root root{hemisphere_of(tile), tile.z - depth, x >> depth, tile.y >> depth};
  const Subtree& subtree = subtree_of(root);
  if (!subtree.contents.empty() && !subtree.contents[first_of_level(depth) + place_of(x, tile.y, depth)])
    report_.findings.add(root.file(), "it does not name tile " + std::to_string(tile.z) + "/" + std::to_string(tile.x) + "/" +
                                          std::to_string(tile.y) + ", which is there");
}

}  // namespace cordillera::pipeline::check
