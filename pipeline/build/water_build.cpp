#include "pipeline/build/water_build.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <iterator>
#include <map>
#include <mutex>
#include <optional>

#include "pipeline/build/build.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/water_mask.h"
#include "proto/utf8.h"
#include "raster/place/area.h"

namespace cordillera::pipeline {

using proto::Problem;
using proto::TileAddress;

namespace {

/// Its values are flags: no datum is to be added to them, and no geoid grid needed.
proto::Result<std::unique_ptr<raster::Source>> open_mask(const std::string& path) {
  proto::BuildOptions plain;
  plain.set_vertical_datum("ellipsoid");
  auto source = raster::open_source(path, std::filesystem::path(path).filename().string(), raster::Trust::operator_file, plain);
  if (source.ok()) return source;
  Problem problem = source.problem();
  problem.detail = "the water mask: " + problem.detail;
  problem.parameter = "water_mask";
  return problem;
}

bool is_water(const proto::BuildOptions& options, double value) {
  if (std::isnan(value)) return false;
  return options.has_water() ? value == options.water() : value != 0;
}

proto::Result<WaterPixels> pixels_of(const proto::BuildOptions& options, const TileAddress& tile, raster::Source& source) {
  static_assert(kWaterSide == proto::kTileCells);  // a pixel is a cell of the tile's level
  const proto::Lattice lattice{tile.z};
  const std::int64_t west = lattice.west(tile), south = lattice.south(tile);
  std::vector<double> value(std::size_t{kWaterSide} * kWaterSide);  // rows from the south
  if (auto read = source.nearest_in_cells(lattice, {west, south, west + kWaterSide, south + kWaterSide}, value.data());
      !read.ok())
    return read.problem();
  WaterPixels out;
  out.reserve(value.size());
  for (auto row = value.end(); row != value.begin();) {
    row -= kWaterSide;
    std::transform(row, row + kWaterSide, std::back_inserter(out),
                   [&](double height_m) { return is_water(options, height_m) ? kWater : std::uint8_t{0}; });
  }
  return out;
}

/// A level's masks from those of the one below, a tile after the other: unpacked they are large.
std::vector<TileWater> parents(const std::vector<TileWater>& below) {
  std::map<TileAddress, std::array<const TileWater*, 4>> children;
  for (const TileWater& mask : below)
    children[mask.tile.parent()][static_cast<std::size_t>((mask.tile.x & 1) + 2 * (mask.tile.y & 1))] = &mask;
  std::vector<TileWater> out;
  for (const auto& [tile, four] : children) {
    std::array<WaterPixels, 4> pixels;
    for (std::size_t c = 0; c < 4; ++c)
      if (four[c] != nullptr) pixels[c] = unpack_water(four[c]->packed);
    std::string packed = pack_water(coarser_water({&pixels[0], &pixels[1], &pixels[2], &pixels[3]}));
    if (!packed.empty()) out.push_back({tile, std::move(packed)});
  }
  return out;
}

}  // namespace

proto::Result<void> check_water(const proto::BuildOptions& options) {
  if (options.water_mask().empty()) return {};
  if (options.has_water()) {
    return Problem{"options-conflict", "water and water_mask are both given", "one of them", "water_mask"};
  }
  const auto opened = open_mask(options.water_mask());
  return opened.ok() ? proto::Result<void>() : opened.problem();
}

std::string note_on_mask(const proto::BuildOptions& options, const proto::Source& source) {
  if (options.water_mask().empty()) return "";
  const auto mask = open_mask(options.water_mask());
  const auto area = mask.ok() ? raster::area_of((*mask)->description().bbox()) : std::nullopt,
             data = raster::area_of(source.bbox());
  if (!area || !data || raster::intersect(*area, *data)) return "";
  return "The water mask " + proto::as_utf8(water_mask_name(options)) + " lies elsewhere: nothing is water";
}

BlockWater::BlockWater(const proto::Plan& plan, Workers& workers, WorkerSources& heights)
    : plan_(plan), workers_(workers), heights_(heights) {}

proto::Result<void> BlockWater::open() {
  const std::string& path = plan_.options().water_mask();
  return path.empty() ? proto::Result<void>() : mask_.open(workers_.threads(), [path] { return open_mask(path); });
}

proto::Result<std::vector<TileWater>> BlockWater::of(const TileAddress& block) {
  std::vector<TileWater> rows;
  const proto::BuildOptions& options = plan_.options();
  if (!has_water(options)) return rows;
  WorkerSources& sources = options.has_water() ? heights_ : mask_;
  const int finest = static_cast<int>(plan_.finest_level());
  const std::vector<TileAddress> tiles = touched_tiles(plan_, finest, block);
  std::vector<std::string> found(tiles.size());
  std::mutex mutex;
  std::optional<Problem> problem;
  workers_.each(tiles.size(), [&](std::size_t k, unsigned worker) {
    const auto source = sources.of(worker);
    const auto pixels = source.ok() ? pixels_of(options, tiles[k], **source) : source.problem();
    if (pixels.ok()) {
      found[k] = pack_water(*pixels);
      return;
    }
    const std::lock_guard lock(mutex);
    if (!problem) problem = pixels.problem();
  });
  if (problem) return *problem;
  std::vector<TileWater> level;
  for (std::size_t k = 0; k < tiles.size(); ++k) {
    if (!found[k].empty()) level.push_back({tiles[k], std::move(found[k])});
  }
  for (int z = finest; z >= block.z; --z) {
    rows.insert(rows.end(), level.begin(), level.end());
    if (z > block.z) level = parents(level);
  }
  return rows;
}

proto::Result<void> build_water_above(const proto::Plan& plan, StoreWriter& store, const std::atomic<bool>& stop) {
  if (!has_water(plan.options())) return {};
  const int blocks = static_cast<int>(plan.block_level());
  std::vector<TileWater> below;
  for (const TileAddress& node : touched_tiles(plan, blocks)) {
    std::string packed = store.water(node);
    if (!packed.empty()) below.push_back({node, std::move(packed)});
  }
  std::vector<TileWater> above;
  for (int z = blocks - 1; z >= static_cast<int>(plan.min_level()) && !below.empty(); --z) {
    if (stop) return kCancelled;
    below = parents(below);
    above.insert(above.end(), below.begin(), below.end());
  }
  return store.put_water(above);  // at once: a disk takes its time for each
}

}  // namespace cordillera::pipeline
