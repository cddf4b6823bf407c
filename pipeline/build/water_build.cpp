#include "pipeline/build/water_build.h"

#include <cmath>
#include <filesystem>
#include <map>
#include <mutex>
#include <optional>

#include "pipeline/build/build.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/water_mask.h"
#include "proto/utf8.h"
#include "raster/place/area.h"

namespace cordillera::pipeline {
namespace {

using proto::Problem;
using proto::TileAddress;
using Masks = std::map<TileAddress, WaterPixels>;

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

class WaterBuilder {
 public:
  WaterBuilder(const proto::Plan& plan, Workers& workers, StoreWriter& store) : plan_(plan), workers_(workers), store_(store) {}

  /// Before the first block.
  proto::Result<void> open(const WorkerSources::Open& source) { return sources_.open(workers_.threads(), source); }

  /// A block's tiles of all its levels; what is left for the levels above is its own mask.
  proto::Result<void> block(const TileAddress& node) {
    const int finest = static_cast<int>(plan_.finest_level());
    auto masks = sampled(touched_tiles(plan_, finest, node));
    if (!masks.ok()) return masks.problem();
    std::vector<StoreWriter::Water> rows;
    for (int z = finest; z > node.z; --z) {
      add_rows(*masks, rows);
      *masks = parents(*masks);
    }
    add_rows(*masks, rows);
    for (const auto& [tile, pixels] : *masks) tops_[tile] = pack_water(pixels);
    return store_.put_water(rows);
  }

  proto::Result<void> above_blocks() {
    for (int z = static_cast<int>(plan_.block_level()) - 1; z >= static_cast<int>(plan_.min_level()); --z) {
      std::map<TileAddress, std::string> tops;
      std::vector<StoreWriter::Water> rows;
      for (auto it = tops_.begin(); it != tops_.end(); ++it) {
        const TileAddress tile = it->first.parent();
        if (tops.contains(tile)) continue;
        std::array<WaterPixels, 4> pixels;
        std::array<const WaterPixels*, 4> children{};
        for (std::size_t c = 0; c < 4; ++c) {
          const auto found = tops_.find(tile.child(static_cast<int>(c)));
          if (found != tops_.end()) pixels[c] = unpack_water(found->second);
          children[c] = &pixels[c];
        }
        tops[tile] = pack_water(coarser_water(children));
      }
      for (const auto& [tile, packed] : tops) rows.push_back({tile, packed});
      std::erase_if(rows, [](const StoreWriter::Water& row) { return row.packed.empty(); });
      if (auto put = store_.put_water(rows); !put.ok()) return put.problem();
      tops_ = std::move(tops);
    }
    return {};
  }

 private:
  bool is_water(double value) const {
    if (std::isnan(value)) return false;
    return plan_.options().has_water() ? value == plan_.options().water() : value != 0;
  }

  proto::Result<WaterPixels> pixels_of(const TileAddress& tile, raster::Source& source) const {
    const double side_deg = 180.0 / proto::tiles_up(tile.z), cell_deg = side_deg / kWaterSide;
    std::vector<double> longitude, latitude;
    for (int r = 0; r < kWaterSide; ++r) {
      for (int c = 0; c < kWaterSide; ++c) {
        longitude.push_back(-180 + tile.x * side_deg + (c + 0.5) * cell_deg);
        latitude.push_back(-90 + (tile.y + 1) * side_deg - (r + 0.5) * cell_deg);
      }
    }
    std::vector<double> value(longitude.size());
    if (auto read = source.nearest(longitude, latitude, value.data()); !read.ok()) return read.problem();
    WaterPixels out(value.size());
    bool any = false;
    for (std::size_t k = 0; k < out.size(); ++k) {
      out[k] = is_water(value[k]) ? kWater : 0;
      any |= out[k] != 0;
    }
    if (!any) out.clear();
    return out;
  }

  proto::Result<Masks> sampled(const std::vector<TileAddress>& tiles) {
    std::vector<WaterPixels> found(tiles.size());
    std::mutex mutex;
    std::optional<Problem> problem;
    workers_.each(tiles.size(), [&](std::size_t k, unsigned worker) {
      const auto source = sources_.of(worker);
      auto pixels = source.ok() ? pixels_of(tiles[k], **source) : source.problem();
      if (pixels.ok()) {
        found[k] = std::move(*pixels);
        return;
      }
      const std::lock_guard lock(mutex);
      if (!problem) problem = pixels.problem();
    });
    if (problem) return *problem;
    Masks out;
    for (std::size_t k = 0; k < tiles.size(); ++k) {
      if (!found[k].empty()) out[tiles[k]] = std::move(found[k]);
    }
    return out;
  }

  static Masks parents(const Masks& masks) {
    Masks out;
    for (const auto& [tile, pixels] : masks) {
      const TileAddress parent = tile.parent();
      if (out.contains(parent)) continue;
      std::array<const WaterPixels*, 4> children{};
      for (std::size_t c = 0; c < 4; ++c) {
        const auto child = masks.find(parent.child(static_cast<int>(c)));
        if (child != masks.end()) children[c] = &child->second;
      }
      out[parent] = coarser_water(children);
    }
    return out;
  }

  static void add_rows(const Masks& masks, std::vector<StoreWriter::Water>& rows) {
    for (const auto& [tile, pixels] : masks) {
      std::string packed = pack_water(pixels);
      if (!packed.empty()) rows.push_back({tile, std::move(packed)});
    }
  }

  const proto::Plan& plan_;
  Workers& workers_;
  StoreWriter& store_;
  WorkerSources sources_;
  std::map<TileAddress, std::string> tops_;  // packed masks of the finished nodes of one level
};

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
  return "The water mask " + proto::as_utf8(std::filesystem::path(options.water_mask()).filename().string()) +
         " lies elsewhere: nothing is water";
}

proto::Result<void> build_water(const proto::Plan& plan, Workers& workers, const WorkerSources::Open& open, StoreWriter& store,
                                const std::atomic<bool>& stop) {
  if (!has_water(plan.options())) return {};
  WaterBuilder builder(plan, workers, store);
  const auto mask = [&] { return open_mask(plan.options().water_mask()); };
  if (const auto opened = builder.open(plan.options().has_water() ? open : mask); !opened.ok()) return opened;
  for (const TileAddress& node : touched_tiles(plan, static_cast<int>(plan.block_level()))) {
    if (stop) return kCancelled;
    if (auto done = builder.block(node); !done.ok()) return done.problem();
  }
  return builder.above_blocks();
}

}  // namespace cordillera::pipeline
