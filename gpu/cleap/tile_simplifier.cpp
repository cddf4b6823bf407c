#include "gpu/cleap/tile_simplifier.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "gpu/cleap/engine.h"
#include "gpu/cleap/half_edge.h"
#include "gpu/device/device_choice.h"

namespace cordillera::gpu::cleap {
namespace {

// Of the tolerance's square, for a sum of squared distances from planes: with less more triangles are left than errors ask for,
// with more so many vertices are put back that no fewer come of it.
constexpr double kCostPerTolerance = 100;
constexpr double kPool = 0.25;       // of the edges, in a pass: small pools keep more of the order of costs
constexpr double kIdleShare = 0.01;  // of the vertices: a pass that finds fewer is the last

Options options_of(const std::string& strategy) {
  Options options;
  options.border = Border::collapse;
  options.repair = Repair::around;
  options.order = Order::test_first;
  options.shuffle = Shuffle::keyed;
  options.come_back = true;
  options.time_phases = false;
  options.pool = kPool;
  options.idle_share = kIdleShare;
  if (strategy == "sequential") {
    options.window = 1;
    options.come_back = false;
  }
  return options;
}

/// In units on all axes.
fit::HeightMesh height_mesh(const SimplifyJob& job) {
  const proto::TileMesh& tile = *job.input;
  fit::HeightMesh mesh{{tile.x.begin(), tile.x.end()}, {tile.y.begin(), tile.y.end()}, {}, tile.triangles};
  const double units_per_m = 1 / static_cast<double>(job.unit_m);
  for (std::size_t v = 0; v < tile.vertices(); ++v) mesh.z.push_back(static_cast<double>(job.elevation[v]) * units_per_m);
  return mesh;
}

TileTags tags_of(const SimplifyJob& job) {
  const proto::TileMesh& tile = *job.input;
  const auto [west, east] = std::ranges::minmax_element(tile.x);
  const auto [south, north] = std::ranges::minmax_element(tile.y);
  TileTags tags;
  tags.rim_units = static_cast<double>(job.rim_units);
  for (std::uint32_t v = 0; v < tile.vertices(); ++v) {
    const bool on_meridian = tile.x[v] == *west || tile.x[v] == *east, on_parallel = tile.y[v] == *south || tile.y[v] == *north;
    const int place = (on_meridian || on_parallel ? kOnSide : 0) | (on_meridian && on_parallel ? kOnCorner : 0);
    tags.tags.push_back({v, 0, static_cast<std::uint8_t>(tile.mark[v] | place)});
  }
  return tags;
}

/// Of what is left, in the input's order, as whoever looks for moved vertices expects it.
proto::TileMesh tile_mesh(const SimplifyJob& job, const TileTags& tags,
                          const std::vector<std::array<std::uint32_t, 3>>& triangles) {
  const proto::TileMesh& in = *job.input;
  std::vector<std::uint32_t> order(tags.tags.size()), number(order.size());
  std::iota(order.begin(), order.end(), 0u);
  std::sort(order.begin(), order.end(),
            [&](std::uint32_t a, std::uint32_t b) { return tags.tags[a].original < tags.tags[b].original; });
  proto::TileMesh mesh;
  mesh.side = in.side;
  for (std::uint32_t i = 0; i < order.size(); ++i) {
    const std::uint32_t v = tags.tags[order[i]].original;
    number[order[i]] = i;
    mesh.x.push_back(in.x[v]);
    mesh.y.push_back(in.y[v]);
    mesh.height.push_back(in.height[v]);
    mesh.mark.push_back(in.mark[v]);
  }
  for (const auto& t : triangles) mesh.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
  return mesh;
}

class TileSimplifier final : public Simplifier {
 public:
  TileSimplifier(std::unique_ptr<Engine> engine, ParallelFor parallel, const Options& options)
      : engine_(std::move(engine)), parallel_(std::move(parallel)), options_(options) {}

  std::vector<proto::TileMesh> simplify(std::span<const SimplifyJob> jobs) override {
    std::vector<TileTags> tags;
    std::vector<std::vector<std::array<std::uint32_t, 3>>> triangles;
    Options options = options_;
    for (const SimplifyJob& job : jobs) {
      const double tolerance = static_cast<double>(job.tolerance_m) / static_cast<double>(job.unit_m);
      options.most_cost = kCostPerTolerance * tolerance * tolerance;
      tags.push_back(tags_of(job));
      Outcome outcome = engine_->simplify_tile(height_mesh(job), tags.back(), options);
      if (outcome.crowded_edge) throw std::logic_error("tile simplifier: an edge of three triangles");
      triangles.push_back(std::move(outcome.result.mesh.triangles));
    }
    std::vector<proto::TileMesh> results(jobs.size());
    parallel_(jobs.size(), [&](std::size_t k) { results[k] = tile_mesh(jobs[k], tags[k], triangles[k]); });
    return results;
  }
  std::string device() const override { return engine_->device(); }

 private:
  std::unique_ptr<Engine> engine_;
  ParallelFor parallel_;
  Options options_;
};

}  // namespace

proto::Result<std::unique_ptr<Simplifier>> make_tile_simplifier(const std::string& device, ParallelFor parallel,
                                                                const std::string& strategy) {
  const std::string where = strategy == "sequential" ? "cpu" : device;
  auto engine = on_device(
      where, [] { return make_host_engine(1); }, make_cuda_engine);
  if (!engine.ok()) return engine.problem();
  return std::unique_ptr<Simplifier>(
      std::make_unique<TileSimplifier>(std::move(*engine), std::move(parallel), options_of(strategy)));
}

void offer_strategies() { offer_published(make_tile_simplifier); }

}  // namespace cordillera::gpu::cleap
