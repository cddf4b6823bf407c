#include "pipeline/tile_path.h"

#include <array>
#include <charconv>

namespace cordillera::pipeline {
namespace {

std::optional<std::int32_t> number(std::string_view text) {
  std::int32_t value = 0;
  if (text.empty() || text[0] == '-' || (text[0] == '0' && text.size() > 1)) return std::nullopt;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

/// "a/b/c" as three numbers.
std::optional<std::array<std::int32_t, 3>> three_numbers(std::string_view text) {
  const std::size_t first = text.find('/');
  const std::size_t second = first == text.npos ? text.npos : text.find('/', first + 1);
  if (second == text.npos) return std::nullopt;
  const auto a = number(text.substr(0, first)), b = number(text.substr(first + 1, second - first - 1)), c = number(text.substr(second + 1));
  if (!a || !b || !c) return std::nullopt;
  return std::array{*a, *b, *c};
}

bool take_suffix(std::string_view& text, std::string_view suffix) {
  if (!text.ends_with(suffix)) return false;
  text.remove_suffix(suffix.size());
  return true;
}

/// Takes "W/" or "E/" from the front.
std::optional<char> take_hemisphere(std::string_view& text) {
  if (!text.starts_with("W/") && !text.starts_with("E/")) return std::nullopt;
  const char hemisphere = text[0];
  text.remove_prefix(2);
  return hemisphere;
}

bool inside(const proto::TileAddress& t) {
  return t.z >= 0 && t.z <= proto::kMaxLevel && t.x >= 0 && t.x < proto::tiles_across(t.z) && t.y >= 0 && t.y < proto::tiles_up(t.z);
}

std::string place(int level, std::int32_t x, std::int32_t y) {
  return std::to_string(level) + '/' + std::to_string(x) + '/' + std::to_string(y);
}

std::string implicit_place(const proto::TileAddress& t) {
  return std::string(1, hemisphere_of(t)) + '/' + place(t.z, implicit_x(t), t.y);
}

}  // namespace

char hemisphere_of(const proto::TileAddress& tile) { return tile.x >> tile.z == 0 ? 'W' : 'E'; }

std::int32_t implicit_x(const proto::TileAddress& tile) { return tile.x & ((std::int32_t{1} << tile.z) - 1); }

std::optional<proto::TileAddress> absolute_tile(char hemisphere, int level, std::int32_t x, std::int32_t y) {
  if ((hemisphere != 'W' && hemisphere != 'E') || level < 0 || level > proto::kMaxLevel) return std::nullopt;
  const std::int32_t side = std::int32_t{1} << level;
  if (x < 0 || x >= side || y < 0 || y >= side) return std::nullopt;
  return proto::TileAddress{level, hemisphere == 'E' ? side + x : x, y};
}

std::optional<TilePath> parse_tile_path(std::string_view path) {
  TilePath out;
  if (take_suffix(path, ".glb")) {
    out.face = Face::glb;
  } else if (!take_suffix(path, ".drc")) {
    return std::nullopt;
  }
  const std::optional<char> hemisphere = take_hemisphere(path);
  const auto numbers = three_numbers(path);
  if (!numbers) return std::nullopt;
  const auto [z, x, y] = *numbers;
  const auto tile = hemisphere ? absolute_tile(*hemisphere, z, x, y) : std::optional(proto::TileAddress{z, x, y});
  if (!tile || !inside(*tile)) return std::nullopt;
  out.tile = *tile;
  return out;
}

std::optional<SubtreePath> parse_subtree_path(std::string_view path) {
  if (!take_suffix(path, ".subtree")) return std::nullopt;
  const std::optional<char> hemisphere = take_hemisphere(path);
  const auto numbers = three_numbers(path);
  if (!hemisphere || !numbers || !absolute_tile(*hemisphere, (*numbers)[0], (*numbers)[1], (*numbers)[2])) return std::nullopt;
  return SubtreePath{*hemisphere, (*numbers)[0], (*numbers)[1], (*numbers)[2]};
}

std::string drc_path(const proto::TileAddress& tile) { return "tiles/" + place(tile.z, tile.x, tile.y) + ".drc"; }
std::string glb_path(const proto::TileAddress& tile) { return "tiles/" + implicit_place(tile) + ".glb"; }
std::string subtree_path(const proto::TileAddress& root) { return "subtrees/" + implicit_place(root) + ".subtree"; }

}  // namespace cordillera::pipeline
