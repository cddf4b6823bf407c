#include "pipeline/check/folder_documents.h"

#include <cstdint>
#include <utility>

#include "pipeline/encode/json.h"
#include "pipeline/encode/little_endian.h"
#include "pipeline/tileset/implicit_tile.h"
#include "pipeline/tileset/subtree.h"
#include "proto/files.h"

namespace cordillera::pipeline::check {
namespace {

constexpr std::size_t kHeader = 24;  // bytes of a subtree file: magic, version, length of the JSON and of the rest

/// Bits of an availability, least first in each byte.
std::vector<bool> bits_of(const Json& availability, const Json& views, std::string_view binary) {
  const std::size_t count = first_of_level(kSubtreeLevels);
  if (availability.contains("constant")) return std::vector<bool>(count, availability["constant"].get<int>() == 1);
  const Json& view = views.at(availability.at("bitstream").get<std::size_t>());
  const std::string_view bytes =
      binary.substr(view.at("byteOffset").get<std::size_t>(), view.at("byteLength").get<std::size_t>());
  std::vector<bool> bits(count);
  for (std::size_t k = 0; k < count; ++k) bits[k] = (static_cast<unsigned char>(bytes.at(k / 8)) >> (k % 8) & 1) != 0;
  return bits;
}

/// Which tiles a client finds, in availability order; empty where the bytes are no subtree.
std::vector<bool> contents_in(std::string_view bytes) {
  if (bytes.size() < kHeader || !bytes.starts_with("subt")) return {};
  const auto json_bytes = little_endian_at<std::uint64_t>(bytes, 8), binary_bytes = little_endian_at<std::uint64_t>(bytes, 16);
  if (json_bytes > bytes.size() || binary_bytes > bytes.size() || kHeader + json_bytes + binary_bytes != bytes.size()) return {};
  try {
    const Json json = Json::parse(bytes.substr(kHeader, json_bytes));
    const Json views = json.value("bufferViews", Json::array());
    const std::string_view binary = bytes.substr(kHeader + json_bytes);
    std::vector<bool> named = bits_of(json.at("contentAvailability").at(0), views, binary);
    const std::vector<bool> tiles = bits_of(json.at("tileAvailability"), views, binary);
    for (std::size_t k = 0; k < named.size(); ++k) named[k] = named[k] && tiles[k];
    return named;
  } catch (const std::exception&) {  // of the JSON library, and of a place outside of the bytes
    return {};
  }
}

/// Why a client finds no tile by it; empty where it may.
std::string fault_of_tileset(const std::filesystem::path& file) {
  const auto bytes = proto::bytes_of_file(file);
  if (!bytes) return "it is missing: no client of 3D Tiles can open the folder";
  const Json json = Json::parse(*bytes, nullptr, false);
  if (json.is_discarded() || !json.is_object()) return "it is no JSON";
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

const std::vector<bool>& FolderDocuments::contents_of(const std::string& subtree) {
  const auto [found, fresh] = contents_.try_emplace(subtree);
  if (!fresh) return found->second;
  const auto bytes = proto::bytes_of_file(folder_ / subtree);
  if (bytes) found->second = contents_in(*bytes);
  if (found->second.empty()) report_.findings.add(subtree, bytes ? "it is no subtree file" : "it is missing");
  return found->second;
}

void FolderDocuments::add(const proto::TileAddress& tile) {
  if (!is_implicit_) return;
  const int depth = tile.z % kSubtreeLevels;
  const std::int32_t x = implicit_x(tile);
  const std::string subtree = std::string("subtrees/") + hemisphere_of(tile) + "/" + std::to_string(tile.z - depth) + "/" +
                              std::to_string(x >> depth) + "/" + std::to_string(tile.y >> depth) + ".subtree";
  const std::vector<bool>& contents = contents_of(subtree);
  if (contents.empty()) return;
  const std::int32_t within = (1 << depth) - 1;
  const std::size_t place =
      first_of_level(depth) + morton(static_cast<std::uint32_t>(x & within), static_cast<std::uint32_t>(tile.y & within));
  if (!contents[place])
    report_.findings.add(subtree, "it does not name tile " + std::to_string(tile.z) + "/" + std::to_string(tile.x) + "/" +
                                      std::to_string(tile.y) + ", which is there");
}

}  // namespace cordillera::pipeline::check
