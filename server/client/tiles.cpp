#include "server/client/tiles.h"

#include <algorithm>
#include <cmath>
#include <set>

#include "proto/integers.h"
#include "proto/lattice.h"
#include "proto/letters.h"
#include "raster/place/area.h"
#include "server/options/option_values.h"
#include "server/options/options.h"

namespace cordillera::server::client {
namespace {

using proto::Problem;
using raster::Area;

constexpr std::size_t kMost = 2'000'000;     // addresses of one command
constexpr double kMost_deg = 540;            // a box may be a turn away
constexpr std::size_t kMostOfMiddle = 2000;  // tries

struct TileFormat {
  const char* name;
  const char* folder;
};
constexpr TileFormat kFormats[] = {{"drc", "tiles/"}, {"glb", "tiles/"}, {"terrain", "terrain/"}};

struct Levels {
  std::uint32_t least = 0, finest = 0;
};

/// What of a manifest says where tiles are.
struct DatasetExtent {
  Area box;
  Levels levels;
};

proto::Result<DatasetExtent> extent_of(const Json& manifest) {
  const Json bounds = manifest.value("bounds", Json::array());
  const auto is_number = [](const Json& one) { return one.is_number(); };
  const auto is_place = [](const Json& degrees) { return std::abs(degrees.get<double>()) <= kMost_deg; };
  const bool box = bounds.is_array() && bounds.size() >= 4 && std::all_of(bounds.begin(), bounds.end(), is_number) &&
                   std::all_of(bounds.begin(), bounds.begin() + 4, is_place);  // heights may follow
  const bool sound = box && manifest.contains("max_level") && manifest["max_level"].is_number_unsigned();
  const Json least = manifest.value("min_level", Json(0u));
  // Of what is shifted by a level none is too large for it.
  const bool levels =
      sound && least.is_number_unsigned() && manifest["max_level"] <= proto::kMaxLevel && least <= manifest["max_level"];
  if (!levels)
    return Problem{"answer-unknown", "the manifest does not say where the dataset is", "a service of this version", "--server"};
  return DatasetExtent{*raster::area_of(bounds.get<std::vector<double>>()),
                       {least.get<std::uint32_t>(), manifest["max_level"].get<std::uint32_t>()}};
}

proto::Result<Levels> read_levels(const std::string& text, const Levels& all) {
  if (text.empty()) return all;
  const auto dash = text.find('-');
  Levels levels;
  const WholeRange range = {all.least, all.finest};
  Complaint wrong = read_whole(text.substr(0, dash), range, &levels.least);
  if (!wrong) wrong = read_whole(dash == text.npos ? text : text.substr(dash + 1), range, &levels.finest);
  if (!wrong && levels.least > levels.finest) wrong = "the first level is above the second";
  if (!wrong) return levels;
  return wrong_value(
      "--level", text, *wrong,
      "a level from " + std::to_string(all.least) + " to " + std::to_string(all.finest) + ", or two with a dash between");
}

proto::Result<Area> read_box(const std::string& text, const Area& all) {
  if (text.empty()) return all;
  const auto settings = with_layer({}, build_options(), {{"--bbox", text}}, Spelling::command_line);
  if (!settings) return settings.problem();
  return *raster::area_of(settings->build.bbox());
}

std::string address(const TileFormat& format, std::uint32_t level, long column, long row) {
  return format.folder + std::to_string(level) + "/" + std::to_string(column) + "/" + std::to_string(row) + "." + format.name;
}

/// Tiles whose inside meets from..to, in tiles.
std::pair<long, long> between(double from, double to) {
  const long first = static_cast<long>(std::floor(from));
  return {first, std::max(first, static_cast<long>(std::ceil(to)) - 1)};
}

/// Columns and rows of a level in both boxes. A box and the data may be a whole turn apart.
struct ColumnsAndRows {
  std::set<long> columns;
  std::pair<long, long> rows = {0, -1};
};
ColumnsAndRows range_of(const Area& data, const Area& box, std::uint32_t level) {
  ColumnsAndRows range;
  const double tiles = std::ldexp(1.0, static_cast<int>(level));
  const long around = 2l << level, top = 1l << level;
  const double south = std::max(data.south_deg, box.south_deg), north = std::min(data.north_deg, box.north_deg);
  if (south > north) return range;
  range.rows = between((south + 90) / 180 * tiles, (north + 90) / 180 * tiles);
  range.rows = {std::clamp(range.rows.first, 0l, top - 1), std::clamp(range.rows.second, 0l, top - 1)};
  for (const double turn : {-360.0, 0.0, 360.0}) {
    const double west = std::max(data.west_deg, box.west_deg + turn), east = std::min(data.east_deg, box.east_deg + turn);
    if (west > east) continue;
    const auto [first, last] = between((west + 180) / 180 * tiles, (east + 180) / 180 * tiles);
    for (long column = first; column <= last; ++column) range.columns.insert(proto::modulo(column, around));
  }
  return range;
}

proto::Result<TileFormat> read_format(const std::string& name) {
  for (const TileFormat& format : kFormats) {
    if (name == format.name) return format;
  }
  return wrong_value("--format", name, "no such kind of tile", "drc, glb or terrain");
}

bool is_tile(const std::string& what, const TileFormat& format) {
  const std::string suffix = std::string(".") + format.name;
  if (!what.ends_with(suffix)) return false;
  const std::string numbers = what.substr(0, what.size() - suffix.size());
  return std::count(numbers.begin(), numbers.end(), '/') == 2 && numbers.find_first_not_of("0123456789/") == numbers.npos;
}

/// What the words mean for a dataset, but for its levels.
struct Asked {
  DatasetExtent extent;
  TileFormat format;
  Area box;
};
proto::Result<Asked> read_words(const Json& manifest, const TileWords& words) {
  const auto extent = extent_of(manifest);
  if (!extent) return extent.problem();
  const auto format = read_format(words.format);
  if (!format) return format.problem();
  const auto box = read_box(words.bbox, extent->box);
  if (!box) return box.problem();
  return Asked{*extent, *format, *box};
}

Problem too_many_tiles() {
  return {"usage", "these would be more than " + std::to_string(kMost) + " tiles",
          "a smaller --bbox, a coarser --level, or cordillera export", "--level"};
}

Problem elsewhere(const TileWords& words, const Area& data) {
  const auto degrees = [](double value) { return shown(std::round(value * 1e4) / 1e4); };
  return wrong_value("--bbox", words.bbox, "the dataset is elsewhere",
                     "a box that meets " + degrees(data.west_deg) + "," + degrees(data.south_deg) + "," +
                         degrees(data.east_deg > 180 ? data.east_deg - 360 : data.east_deg) + "," + degrees(data.north_deg));
}

/// A range of tiles that a layer.json names.
struct LayerRange {
  long first_x, first_y, last_x, last_y;
};
/// Whether a level has such tiles.
bool is_within(const LayerRange& range, std::size_t level) {
  if (level > std::size_t{proto::kMaxLevel}) return false;
  const bool ordered = range.first_x <= range.last_x && range.first_y <= range.last_y;
  return ordered && range.first_x >= 0 && range.first_y >= 0 && range.last_x < 2l << level && range.last_y < 1l << level;
}

proto::Result<std::vector<std::vector<LayerRange>>> ranges_of(const Json& layer) {
  std::vector<std::vector<LayerRange>> levels;
  bool sound = true;
  try {
    for (const Json& level : layer.at("available")) {
      auto& ranges = levels.emplace_back();
      for (const Json& range : level) {
        ranges.push_back({range.at("startX"), range.at("startY"), range.at("endX"), range.at("endY")});
        sound = sound && is_within(ranges.back(), levels.size() - 1);
      }
    }
  } catch (const Json::exception&) { sound = false; }
  if (sound && !levels.empty() && levels.size() <= std::size_t{proto::kMaxLevel} + 1) return levels;
  return Problem{"answer-unknown", "the layer.json does not say which tiles there are", "a service of this version", "--server"};
}

}  // namespace

proto::Result<std::string> address_named(const std::string& what) {
  if (what == "manifest" || what == "tileset") return what + ".json";
  for (const TileFormat& format : kFormats) {
    if (is_tile(what, format)) return format.folder + what;
  }
  // It also becomes a path on this machine.
  const std::string around = "/" + what + "/";
  const bool plain = std::all_of(what.begin(), what.end(), [](char c) { return proto::is_letter_or_digit(c, "/.-_"); });
  if (plain && what.find('.') != what.npos && around.find("//") == around.npos && around.find("/.") == around.npos) return what;
  return Problem{
      "usage", "'" + what + "' names nothing of a dataset",
      "z/x/y.drc, z/x/y.glb, z/x/y.terrain, manifest, tileset, or another address below the dataset's, such as layer.json",
      "what"};
}

proto::Result<std::vector<std::string>> addresses_of(const Json& manifest, const TileWords& words) {
  const auto asked = read_words(manifest, words);
  if (!asked) return asked.problem();
  const auto& [extent, format, box] = *asked;
  const auto levels = read_levels(words.level, extent.levels);
  if (!levels) return levels.problem();
  std::vector<std::string> addresses;
  for (std::uint32_t level = levels->least; level <= levels->finest; ++level) {
    const ColumnsAndRows range = range_of(extent.box, box, level);
    const auto rows = static_cast<std::size_t>(range.rows.second - range.rows.first + 1);
    if (addresses.size() + range.columns.size() * rows > kMost) return too_many_tiles();
    for (const long column : range.columns) {
      for (long row = range.rows.first; row <= range.rows.second; ++row) addresses.push_back(address(format, level, column, row));
    }
  }
  if (addresses.empty()) return elsewhere(words, extent.box);
  return addresses;
}

proto::Result<std::vector<std::string>> addresses_of_layer(const Json& manifest, const Json& layer, const TileWords& words) {
  const auto asked = read_words(manifest, words);
  if (!asked) return asked.problem();
  const auto& [extent, format, box] = *asked;
  const auto ranges = ranges_of(layer);
  if (!ranges) return ranges.problem();
  const auto levels = read_levels(words.level, {0, static_cast<std::uint32_t>(ranges->size() - 1)});
  if (!levels) return levels.problem();
  if (range_of(extent.box, box, 0).columns.empty()) return elsewhere(words, extent.box);
  std::vector<std::string> addresses;
  for (std::uint32_t level = levels->least; level <= levels->finest; ++level) {
    const bool all = words.bbox.empty() || level == 0;
    const ColumnsAndRows parents = all ? ColumnsAndRows{} : range_of(box, box, level - 1);
    for (const LayerRange& range : (*ranges)[level]) {
      for (long column = range.first_x; column <= range.last_x; ++column) {
        if (!all && !parents.columns.contains(column / 2)) continue;
        const long first = all ? range.first_y : std::max(range.first_y, 2 * parents.rows.first);
        const long last = all ? range.last_y : std::min(range.last_y, 2 * parents.rows.second + 1);
        for (long row = first; row <= last; ++row) {
          if (addresses.size() == kMost) return too_many_tiles();
          addresses.push_back(address(format, level, column, row));
        }
      }
    }
  }
  return addresses;
}

proto::Result<std::vector<std::string>> addresses_from_the_middle(const Json& manifest, const std::string& format_name) {
  const auto extent = extent_of(manifest);
  if (!extent) return extent.problem();
  const auto format = read_format(format_name);
  if (!format) return format.problem();
  const std::uint32_t level = extent->levels.finest;
  const double tiles = std::ldexp(1.0, static_cast<int>(level));
  const Area& data = extent->box;
  const auto [west, east] = between((data.west_deg + 180) / 180 * tiles, (data.east_deg + 180) / 180 * tiles);
  const auto [south, north] = between((data.south_deg + 90) / 180 * tiles, (data.north_deg + 90) / 180 * tiles);
  struct Numbers {
    long distance, column, row;
  };
  std::vector<Numbers> places;
  const long x = (west + east) / 2, y = (south + north) / 2, reach = static_cast<long>(std::sqrt(kMostOfMiddle));
  for (long column = std::max(west, x - reach); column <= std::min(east, x + reach); ++column) {
    for (long row = std::max(south, y - reach); row <= std::min(north, y + reach); ++row)
      places.push_back({(column - x) * (column - x) + (row - y) * (row - y), column, row});
  }
  std::stable_sort(places.begin(), places.end(),
                   [](const Numbers& one, const Numbers& other) { return one.distance < other.distance; });
  std::vector<std::string> addresses;
  for (std::size_t k = 0; k < std::min(places.size(), kMostOfMiddle); ++k)
    addresses.push_back(address(*format, level, places[k].column % (2l << level), places[k].row));
  return addresses;
}

}  // namespace cordillera::server::client
