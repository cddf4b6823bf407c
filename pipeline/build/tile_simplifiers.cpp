#include "pipeline/build/tile_simplifiers.h"

#include <utility>

#include "gpu/device/device_lost.h"

namespace cordillera::pipeline {
namespace {

constexpr std::size_t kBatchTiles = 64;  // on a GPU; 0.4 GB of host memory while they are prepared

}  // namespace

proto::Result<void> TileSimplifiers::open(const std::string& device, const std::string& strategy) {
  auto simplifier = gpu::make_simplifier(device, workers_.loop(), strategy);
  if (!simplifier.ok()) return simplifier.problem();
  if ((*simplifier)->device() != "cpu") on_device_ = std::move(*simplifier);
  has_device_ = on_device_ != nullptr;
  for (unsigned k = 0; k < workers_.threads(); ++k) {
    on_cpu_.push_back(gpu::make_simplifier("cpu", gpu::one_after_the_other, strategy).value());
  }
  return {};
}

std::string TileSimplifiers::device() const {
  const std::lock_guard lock(device_mutex_);
  return on_device_ ? on_device_->device() : "cpu" + lost_;
}

std::vector<proto::TileMesh> TileSimplifiers::simplify_on_device(const std::vector<gpu::SimplifyJob>& jobs) {
  const std::lock_guard lock(device_mutex_);
  if (!on_device_) throw gpu::DeviceLost("another task has lost it");
  try {
    return on_device_->simplify(jobs);
  } catch (const gpu::DeviceLost& lost) {
    lost_ = ", after " + on_device_->device() + " was lost: " + lost.what();
    has_device_ = false;
    on_device_.reset();
    throw;
  }
}

std::vector<BuiltTile> TileSimplifiers::simplify(const LevelContext& context, std::size_t count, const Prepare& prepare,
                                                 const TileDone& done) {
  std::vector<std::optional<BuiltTile>> tiles(count);
  if (!has_device_) {
    simplify_on_cpu(context, prepare, tiles, done);
  } else {
    try {
      simplify_batched(context, prepare, tiles);
    } catch (const gpu::DeviceLost&) {  // the CPU gives the same bytes
      simplify_on_cpu(context, prepare, tiles, done);
    }
  }
  std::vector<BuiltTile> built;
  for (std::optional<BuiltTile>& tile : tiles) {
    if (tile) built.push_back(std::move(*tile));
  }
  return built;
}

void TileSimplifiers::simplify_on_cpu(const LevelContext& context, const Prepare& prepare,
                                      std::vector<std::optional<BuiltTile>>& tiles, const TileDone& done) {
  workers_.each(tiles.size(), [&](std::size_t k, unsigned worker) {
    if (stop_) return;
    std::optional<PreparedTile> prepared = prepare(k);
    if (prepared) tiles[k] = complete(context, *prepared, *on_cpu_[worker]);
    done();
  });
}

void TileSimplifiers::simplify_batched(const LevelContext& context, const Prepare& prepare,
                                       std::vector<std::optional<BuiltTile>>& tiles) {
  for (std::size_t from = 0; from < tiles.size() && !stop_; from += kBatchTiles) {
    const std::size_t count = std::min(kBatchTiles, tiles.size() - from);
    std::vector<std::optional<PreparedTile>> maybe(count);
    workers_.each(count, [&](std::size_t k, unsigned) { maybe[k] = prepare(from + k); });
    std::vector<PreparedTile> prepared;
    std::vector<std::size_t> place;
    for (std::size_t k = 0; k < count; ++k) {
      if (!maybe[k]) continue;
      prepared.push_back(std::move(*maybe[k]));
      place.push_back(from + k);
    }
    std::vector<std::optional<BuiltTile>> built(prepared.size());
    simplify_batch(context, prepared, built);
    for (std::size_t k = 0; k < place.size(); ++k) tiles[place[k]] = std::move(built[k]);
  }
}

void TileSimplifiers::simplify_batch(const LevelContext& context, std::vector<PreparedTile>& prepared,
                                     std::vector<std::optional<BuiltTile>>& built) {
  std::vector<std::size_t> open(prepared.size());
  for (std::size_t k = 0; k < open.size(); ++k) open[k] = k;
  for (int attempt = 0; !open.empty() && !stop_; ++attempt) {
    std::vector<gpu::SimplifyJob> jobs;
    jobs.reserve(open.size());
    for (const std::size_t k : open) jobs.push_back(prepared[k].job(context));
    std::vector<proto::TileMesh> meshes = simplify_on_device(jobs);
    workers_.each(open.size(), [&](std::size_t n, unsigned) {
      built[open[n]] = finish(context, prepared[open[n]], std::move(meshes[n]), attempt);
    });
    std::erase_if(open, [&](std::size_t k) { return built[k].has_value(); });
  }
}

}  // namespace cordillera::pipeline
