#include "pipeline/build/sharpen.h"

#include <algorithm>

#include "pipeline/encode/draco_mesh.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/plan.h"
#include "pipeline/store/water_mask.h"

namespace cordillera::pipeline {
namespace {

/// A tile's bytes with positions that are units of another lattice, of which a side has so many.
proto::Result<std::string> on_lattice(const std::string& drc, std::int64_t side) {
  auto mesh = draco_decode_lattice(drc);
  if (!mesh.ok()) return mesh.problem();
  if (mesh->side == side) return drc;
  const auto times = static_cast<std::int32_t>(side / mesh->side);
  for (auto& point : mesh->points) point[0] *= times, point[1] *= times;
  mesh->side = static_cast<std::int32_t>(side);
  return draco_encode(*mesh);
}

constexpr std::size_t kTilesAtOnce = 1024;  // in a transaction

/// Whether its tiles are on the plan's lattice: a step before this one has put them there.
bool is_on_lattice(const proto::Manifest& shown, const proto::Plan& plan) {
  return shown.has_done_blocks() && shown.done_blocks().level() == plan.block_level() && shown.max_level() == plan.finest_level();
}

/// Tiles that no done block covers.
proto::Result<void> copy_beside(const StoreReader& store, const proto::Plan& plan, const std::set<proto::TileAddress>& done,
                                StoreWriter& to) {
  FinishedTask task;
  const int finest = static_cast<int>(store.manifest().max_level()), block_level = static_cast<int>(plan.block_level());
  const bool as_it_is = is_on_lattice(store.manifest(), plan);
  for (int z = static_cast<int>(store.manifest().min_level()); z <= finest; ++z) {
    task.node = {z, 0, 0};
    for (proto::TileRecord& record : store.records_of(z)) {
      const proto::TileAddress tile = address_of(record);
      if (z >= block_level && done.contains(tile.at_level(block_level))) continue;
      auto blob = store.tile(tile, Encoding::drc);
      if (!blob) continue;
      auto drc =
          as_it_is ? proto::Result<std::string>(std::move(blob->bytes)) : on_lattice(blob->bytes, lattice_of(plan).tile_units(z));
      if (!drc.ok()) return drc.problem();
      task.tiles.push_back({std::move(record), std::move(*drc), {}});
      if (std::string mask = store.water(tile); !mask.empty()) task.water.push_back({tile, std::move(mask)});
      if (task.tiles.size() < kTilesAtOnce) continue;
      if (auto committed = to.commit(task); !committed.ok()) return committed;
      task.tiles.clear(), task.water.clear();
    }
  }
  return to.commit(task);
}

}  // namespace

bool has_blocks_to_show(const proto::Plan& plan) { return has_levels_above(plan); }

bool can_show_blocks(const proto::Plan& plan, const proto::Manifest& provisional) {
  return provisional.provisional() && has_blocks_to_show(plan) && provisional.max_level() >= plan.block_level() &&
         provisional.min_level() == plan.min_level();
}

std::set<proto::TileAddress> blocks_in(const proto::Manifest& provisional) {
  std::set<proto::TileAddress> blocks;
  const proto::DoneBlocks& done = provisional.done_blocks();
  for (int k = 0; k < std::min(done.x_size(), done.y_size()); ++k) {
    blocks.insert({static_cast<int>(done.level()), static_cast<std::int32_t>(done.x(k)), static_cast<std::int32_t>(done.y(k))});
  }
  return blocks;
}

proto::Result<void> put_done_blocks(const std::string& store, const proto::Plan& plan, const std::vector<FinishedTask>& done,
                                    const std::string& next) {
  const auto shown = StoreReader::open(store);
  if (!shown.ok()) return shown.problem();
  auto writer = StoreWriter::open(next, plan);
  if (!writer.ok()) return writer.problem();
  std::set<proto::TileAddress> nodes;
  for (const FinishedTask& task : done) nodes.insert(task.node);
  proto::Manifest manifest = (*shown)->manifest();
  if (auto copied = copy_beside(**shown, plan, nodes, **writer); !copied.ok()) return copied;
  for (const FinishedTask& task : done) {
    if (const auto committed = (*writer)->commit(task); !committed.ok()) return committed.problem();
  }
  nodes.merge(blocks_in(manifest));
  // What was shown before had no masks of that raster: it would take too long to read.
  manifest.mutable_options()->set_water_mask(water_mask_name(plan.options()));
  manifest.clear_done_blocks();
  manifest.mutable_done_blocks()->set_level(plan.block_level());
  double made = 0, all = 0;
  for (const proto::TileAddress& node : nodes) {
    manifest.mutable_done_blocks()->add_x(static_cast<std::uint32_t>(node.x));
    manifest.mutable_done_blocks()->add_y(static_cast<std::uint32_t>(node.y));
    made += samples_of(plan, node);
  }
  for (const proto::TileAddress& node : touched_tiles(plan, static_cast<int>(plan.block_level()))) all += samples_of(plan, node);
  manifest.mutable_done_blocks()->set_share(all > 0 ? made / all : 0);
  const auto published = (*writer)->publish(std::move(manifest));
  return published.ok() ? proto::Result<void>() : published.problem();
}

proto::Result<void> put_finest(const std::string& shown, const proto::Plan& plan, FinishedTask finest, const std::string& store) {
  auto manifest = StoreReader::manifest_of(shown);
  if (!manifest.ok()) return manifest.problem();
  auto writer = StoreWriter::open(store, plan);
  if (!writer.ok()) return writer.problem();
  if (auto committed = (*writer)->commit(finest); !committed.ok()) return committed;
  manifest->clear_done_blocks();
  const auto published = (*writer)->publish(std::move(*manifest));
  return published.ok() ? proto::Result<void>() : published.problem();
}

}  // namespace cordillera::pipeline
