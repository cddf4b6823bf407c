#include "pipeline/estimate/estimate.h"

#include <algorithm>
#include <cmath>

#include "pipeline/build/blank_manifest.h"
#include "pipeline/build/pilot.h"
#include "pipeline/build/stages.h"
#include "pipeline/estimate/sample_build.h"
#include "pipeline/plan/plan.h"
#include "pipeline/plan/sample_places.h"
#include "pipeline/store/store_publish.h"

namespace cordillera::pipeline {
namespace {

constexpr double kDrcOverhead = 200;                       // bytes of a tile without any triangle
constexpr double kLeastGrowth = 0.25, kMostGrowth = 0.75;  // of a level's triangles, from one level to the one above

/// keep=: targets nearer to those that give the shares. Triangles fall about as the target rises.
void aim_at_shares(const proto::BuildOptions& options, const Sampled& sampled, proto::Plan& plan) {
  double factor = 1;
  for (int up = 0; up < plan.levels_size(); ++up) {
    if (up < static_cast<int>(sampled.levels.size())) {
      const double wanted = kept_share(options, up) * 2 * sampled.levels[0].valid;
      if (wanted > 0) factor = sampled.levels[static_cast<std::size_t>(up)].triangles / wanted;
    }
    proto::LevelPlan& level = *plan.mutable_levels(up);
    level.set_target(std::clamp(level.target() * factor, 0.001, greatest_target_m(plan, static_cast<int>(level.level()))));
    derive_level(plan, level);
  }
}

/// Sums of every level: scaled where there are samples, above them as the last sampled level grew.
std::vector<LevelSum> extrapolate(const proto::Plan& plan, const Sampled& sampled, const std::vector<proto::TileAddress>& nodes) {
  std::vector<LevelSum> sums;
  const double with_data = sampled.places > 0 ? static_cast<double>(sampled.filled) / static_cast<double>(sampled.places) : 0;
  double growth = 0.3;
  for (int up = 0; up < plan.levels_size(); ++up) {
    LevelSum sum;
    if (up < static_cast<int>(sampled.levels.size())) {
      sum = sampled.levels[static_cast<std::size_t>(up)];
      for (double* part : {&sum.tiles, &sum.triangles, &sum.drc, &sum.valid}) *part *= sampled.scale();
      if (up > 0 && sums.back().triangles > 0)
        growth = std::clamp(sum.triangles / sums.back().triangles, kLeastGrowth, kMostGrowth);
    } else {
      const LevelSum& below = sums.back();
      const int above = up - static_cast<int>(sampled.levels.size()) + 1;
      const double empty_share = std::pow(1 - with_data, std::pow(4.0, above));
      sum.tiles = static_cast<double>(count_at(nodes, static_cast<int>(plan.finest_level()) - up)) * (1 - empty_share);
      sum.triangles = std::max(2 * sum.tiles, growth * below.triangles);
      const double a_triangle = below.triangles > 0 ? std::max(0.0, below.drc - kDrcOverhead * below.tiles) / below.triangles : 0;
      sum.drc = kDrcOverhead * sum.tiles + a_triangle * sum.triangles;
    }
    sums.push_back(sum);
  }
  return sums;
}

/// keep=: triangles are what the shares say; bytes go with them.
void take_shares(const proto::BuildOptions& options, std::vector<LevelSum>& sums) {
  const double grid = 2 * sums[0].valid;
  for (std::size_t up = 0; up < sums.size(); ++up) {
    const double wanted = std::max(2 * sums[up].tiles, kept_share(options, static_cast<int>(up)) * grid);
    const double factor = sums[up].triangles > 0 ? wanted / sums[up].triangles : 1;
    sums[up].triangles = wanted;
    sums[up].drc *= factor;
  }
}

std::uint32_t whole(double value) { return static_cast<std::uint32_t>(std::clamp(std::round(value), 0.0, 4e9)); }

void fill_in(const proto::Plan& plan, const std::vector<LevelSum>& sums, proto::Manifest& manifest) {
  LevelSum all;
  for (std::size_t up = 0; up < sums.size(); ++up) {
    proto::LevelSummary* summary = manifest.add_levels();
    const proto::LevelPlan& level = plan.levels(static_cast<int>(up));
    summary->set_level(level.level());
    summary->set_target(level.target());
    summary->set_height_step(level.height_step());
    summary->set_tiles(whole(sums[up].tiles));
    summary->set_triangles(whole(sums[up].triangles));
    summary->set_drc_bytes(std::round(sums[up].drc));
    all.tiles += summary->tiles();
    all.triangles += summary->triangles();
    all.drc += summary->drc_bytes();
  }
  manifest.set_tiles(whole(all.tiles));
  manifest.set_triangles(whole(all.triangles));
  manifest.set_bytes(all.drc);
}

/// A build's seconds, and before it those of the search for shares; all threads take part in both.
double seconds_for(const Sampled& sampled, const std::vector<LevelSum>& sums, unsigned threads, bool shares) {
  const double cpu = sampled.cpu_seconds * sampled.scale(), tiles = sums[0].tiles;
  const double part = static_cast<double>(kPilotTiles) / std::max(tiles, 1.0);
  const double runs = !shares                                     ? 0
                      : tiles <= static_cast<double>(kWholeTiles) ? kPilotRunsOfWhole
                                                                  : kPilotRuns * std::min(1.0, part);
  return (1 + runs) * cpu / threads;
}

}  // namespace

proto::Result<Estimate> estimate(const BuildRequest& request) {
  const auto source = open_source(request);
  if (!source.ok()) return source.problem();
  auto plan = plan_of(request, **source);
  if (!plan.ok()) return plan.problem();
  const std::atomic<bool> never = false;
  Workshop shop(request, *plan, never);
  Builder& builder = shop.builder;
  const unsigned threads = shop.workers.threads();
  if (const auto ready = builder.prepare(); !ready.ok()) return ready.problem();
  // Before processor time is counted.
  if (const auto ready = builder.opened(); !ready.ok()) return ready.problem();
  const auto level = is_small(*plan) ? plan->block_level() : plan->finest_level();
  const std::vector<proto::TileAddress> nodes = filled_nodes(*plan, **source, static_cast<int>(level));
  Sampler sampler(builder, nodes);
  proto::Plan aimed = *plan;
  auto sampled = sampler.build(aimed);
  const bool shares = request.options.keep_size() > 0;
  if (shares && sampled.ok() && sampled->filled > 0) {
    aim_at_shares(request.options, *sampled, aimed);
    sampled = sampler.build(aimed);
  }
  if (!sampled.ok()) return sampled.problem();
  if (sampled->filled == 0 && sampled->places == sampled->all_places) return without_data(request);
  std::vector<LevelSum> sums = extrapolate(*plan, *sampled, nodes);
  if (shares) take_shares(request.options, sums);
  Estimate estimate;
  estimate.manifest = blank_manifest(request, *plan, (*source)->description(), {threads, builder.device()});
  estimate.values = request.members.empty() ? look_at_values(**source) : look_at_values(request.members);
  note_values(estimate.values, estimate.manifest);
  note_cut_voids(**source, *plan, estimate.manifest);
  note_datums(estimate.manifest);
  fill_in(*plan, sums, estimate.manifest);
  estimate.seconds = seconds_for(*sampled, sums, threads, shares);
  return estimate;
}

}  // namespace cordillera::pipeline
