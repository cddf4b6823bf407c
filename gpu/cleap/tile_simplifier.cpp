#include "gpu/cleap/tile_simplifier.h"

#include <algorithm>
#include <numeric>
#include <stdexcept>

#include "gpu/cleap/engine.h"
#include "gpu/device/device_choice.h"
#include "gpu/waves/border/empty_border.h"
#include "gpu/waves/collapse/waves.h"

namespace cordillera::gpu::cleap {
namespace {

// A sum of squared distances from planes, in tolerances: by it tiles of a promise get fewest triangles.
constexpr double kCostPerTolerance = 1;
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
  TileTags tags;
  tags.rim_units = static_cast<double>(job.rim_units);
  for (std::uint32_t v = 0; v < tile.vertices(); ++v) {
    const int sides = sides_of(tile, v);
    const int place = sides == 0 ? 0 : sides == 1 ? kOnSide : kOnSide | kOnCorner;
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
  proto::Result<Rings> rings = rings_from_triangles(mesh);
  if (!rings.ok()) throw std::logic_error("tile simplifier: " + rings.problem().detail);
  return with_border_emptied(*rings, mesh, job.rim_units);
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
      if (outcome.crowded_edge) refuse_broken({&job, 1});
      triangles.push_back(std::move(outcome.result.mesh.triangles));
    }
    std::vector<proto::TileMesh> results(jobs.size());
    parallel_(jobs.size(), [&](std::size_t k) { results[k] = tile_mesh(jobs[k], tags[k], triangles[k]); });
    return results;
  }
  std::string device() const override { return engine_->device(); }
  std::span<const proto::StageTime> stages() const override { return {}; }

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
