#include "pipeline/estimate/sample_build.h"

#include <algorithm>
#include <set>

#include "pipeline/build/in_flight.h"
#include "pipeline/estimate/estimate.h"
#include "pipeline/plan/plan.h"
#include "pipeline/plan/sample_places.h"

namespace cordillera::pipeline {
namespace {

constexpr std::size_t kPlaces = 12;    // single tiles of the finest level
constexpr std::size_t kParents = 2;    // of them, four tiles and the one above each
constexpr std::size_t kMostTries = 3;  // times as many places as wanted are looked at where some hold no data
constexpr double kUpperLevels = 1.4;   // time of all levels, in times of the finest

static_assert(kPlaces + 4 * kParents <= kEstimateTiles);

/// Of all threads: what the build will need, whoever else uses the machine now.
double cpu_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

void add(const FinishedTask& task, int finest, std::vector<LevelSum>& levels) {
  for (const EncodedTile& tile : task.tiles) {
    if (!tile.shows()) continue;
    LevelSum& sum = levels[static_cast<std::size_t>(finest) - tile.record.level()];
    ++sum.tiles;
    sum.triangles += tile.record.triangles();
    sum.drc += static_cast<double>(tile.drc.size());
    sum.valid += tile.record.valid_samples();
  }
}

/// Nodes of this level are built, as blocks. Targets and what derives from them stay those of the real blocks.
proto::Plan with_blocks_at(proto::Plan plan, int level) {
  plan.set_block_level(static_cast<std::uint32_t>(level));
  return plan;
}

}  // namespace

bool is_small(const proto::Plan& plan) {
  const int finest = static_cast<int>(plan.finest_level());
  return touched_count(plan, finest) <= 4 * kEstimateTiles && touched_tiles(plan, finest).size() <= kEstimateTiles;
}

proto::Result<std::vector<FinishedTask>> Sampler::blocks(const proto::Plan& plan, const std::vector<proto::TileAddress>& nodes) {
  builder_.use(plan, static_cast<int>(plan.block_level()) != block_level_);
  std::vector<FinishedTask> tasks;
  const auto built = in_flight(
      nodes.size(), [&] { return builder_.tasks_at_once(); },
      [&](std::size_t k) { return builder_.block(nodes[k], [](double) {}); },
      [&](std::size_t, FinishedTask&& task) -> proto::Result<void> {
        tasks.push_back(std::move(task));
        return {};
      });
  if (!built.ok()) return built.problem();
  return tasks;
}

proto::Result<Sampled> Sampler::build(const proto::Plan& plan) {
  block_level_ = static_cast<int>(plan.block_level());
  Sampled sampled;
  for (const proto::TileAddress& node : nodes_) sampled.all_samples += samples_of(plan, node);
  if (nodes_.empty()) return sampled;
  const int finest = static_cast<int>(plan.finest_level()), top = is_small(plan) ? nodes_.front().z : finest;
  sampled.levels.resize(static_cast<std::size_t>(finest - top) + 1);
  const double before = cpu_seconds();
  if (const auto built = build_places(with_blocks_at(plan, top), is_small(plan) ? nodes_.size() : kPlaces, sampled); !built.ok())
    return built.problem();
  sampled.cpu_seconds = cpu_seconds() - before;
  if (is_small(plan) || found_.empty() || finest == static_cast<int>(std::max(plan.min_level(), plan.block_level())))
    return sampled;
  if (const auto built = build_parents(plan, sampled); !built.ok()) return built.problem();
  sampled.cpu_seconds *= kUpperLevels;
  return sampled;
}

proto::Result<void> Sampler::build_places(const proto::Plan& plan, std::size_t most, Sampled& sampled) {
  const int level = static_cast<int>(plan.block_level());
  const std::size_t count = count_at(nodes_, level);
  const bool all = count <= most;
  sampled.all_places = count;
  std::set<std::size_t> seen;
  found_.clear();
  const std::size_t last = all ? count : kMostTries * most;
  for (std::size_t k = 0; k < last && sampled.filled < most;) {
    // As many at a time as are still wanted: how many that is depends on the data alone.
    std::vector<proto::TileAddress> round;
    for (; k < last && round.size() < most - sampled.filled; ++k) {
      const std::size_t at = all ? k : spread_place(k, count);
      if (seen.insert(at).second) round.push_back(node_at(nodes_, at, level));
    }
    const auto tasks = blocks(plan, round);
    if (!tasks.ok()) return tasks.problem();
    for (std::size_t n = 0; n < round.size(); ++n) {
      const FinishedTask& task = (*tasks)[n];
      add(task, static_cast<int>(plan.finest_level()), sampled.levels);
      sampled.samples += samples_of(plan, round[n]);
      ++sampled.places;
      if (!task.shows()) continue;
      ++sampled.filled;
      found_.emplace_back(task.tiles.front().record.triangles(), round[n]);
    }
  }
  return {};
}

/// The level above, where most triangles are: what matters of it is how it grows there.
proto::Result<void> Sampler::build_parents(const proto::Plan& plan, Sampled& sampled) {
  const int finest = static_cast<int>(plan.finest_level());
  std::stable_sort(found_.begin(), found_.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::vector<proto::TileAddress> parents;
  for (const auto& [triangles, tile] : found_) {
    const proto::TileAddress parent{finest - 1, tile.x >> 1, tile.y >> 1};
    if (parents.size() < kParents && std::find(parents.begin(), parents.end(), parent) == parents.end())
      parents.push_back(parent);
  }
  std::vector<LevelSum> pair(2);
  const auto tasks = blocks(with_blocks_at(plan, finest - 1), parents);
  if (!tasks.ok()) return tasks.problem();
  for (const FinishedTask& task : *tasks) add(task, finest, pair);
  const LevelSum& here = sampled.levels[0];
  const auto grown = [&](double LevelSum::*part) { return pair[0].*part > 0 ? here.*part * (pair[1].*part / pair[0].*part) : 0; };
  const auto share = static_cast<double>(count_at(nodes_, finest - 1)) / static_cast<double>(count_at(nodes_, finest));
  LevelSum above;
  above.tiles = here.tiles * share;
  above.triangles = grown(&LevelSum::triangles);
  above.drc = grown(&LevelSum::drc);
  sampled.levels.push_back(above);
  return {};
}

}  // namespace cordillera::pipeline
