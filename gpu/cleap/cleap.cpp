#include "gpu/cleap/cleap.h"

#include "gpu/cleap/engine.h"
#include "gpu/cleap/metrics.h"
#include "gpu/device/device_choice.h"
#include "gpu/device/device_lost.h"
#include "gpu/fit/check.h"

namespace cordillera::gpu::cleap {

#ifndef CORDILLERA_HAS_CUDA
proto::Result<std::unique_ptr<Engine>> make_cuda_engine(int) { return built_without_cuda(); }
#endif

namespace {

proto::Result<std::unique_ptr<Engine>> make_engine(const std::string& device, unsigned threads) {
  return on_device(
      device, [threads] { return make_host_engine(threads); }, make_cuda_engine);
}

std::optional<proto::Problem> check_options(const Options& options) {
  if (!with_metric(AllMetrics{}, options.metric, [](auto) {})) {
    std::string names;
    for (const auto& [name, help] : metrics()) names += (names.empty() ? "" : ", ") + name;
    return proto::Problem{"option-invalid", "metric \"" + options.metric + "\" is not known", names, "metric"};
  }
  if (!(options.pool > 0 && options.pool <= 1)) {
    return proto::Problem{"option-invalid", "pool is " + std::to_string(options.pool), "a share above 0, at most 1", "pool"};
  }
  if (options.most_triangles < 3 || options.most_triangles > 1000) {
    return proto::Problem{"option-invalid", "a vertex may have " + std::to_string(options.most_triangles) + " triangles",
                          "3 to 1000", "most-triangles"};
  }
  return {};
}

std::optional<proto::Problem> check_mesh(const fit::HeightMesh& mesh) {
  bool clockwise = false;
  if (auto problem = fit::check_triangles(mesh, clockwise)) return problem;
  constexpr std::size_t kMostTriangles = std::size_t{1} << 29;  // a place in the triangles array is a signed number of 32 bits
  if (mesh.triangles.size() <= kMostTriangles) return {};
  return proto::Problem{"mesh-broken", std::to_string(mesh.triangles.size()) + " triangles are too many",
                        "at most " + std::to_string(kMostTriangles) + " triangles", "mesh"};
}

proto::Problem not_manifold(const fit::HeightMesh& mesh) {
  if (auto problem = fit::find_non_manifold(mesh)) return *problem;
  return {"mesh-not-manifold", "an edge has more than two triangles", "one or two triangles at every edge", "mesh"};
}

}  // namespace

const char* name_of(Fate fate) {
  static constexpr const char* kNames[kFates] = {"collapsed", "collapsed_on_border", "edge_gone",  "lock_down",
                                                 "inversion", "border_edge",         "neighbours", "past_target"};
  return kNames[static_cast<std::size_t>(fate)];
}

std::vector<std::pair<std::string, std::string>> metrics() {
  std::vector<std::pair<std::string, std::string>> all;
  each_metric(AllMetrics{}, [&](const char* name, const char* help) { all.emplace_back(name, help); });
  return all;
}

proto::Result<Simplified> simplify(const fit::HeightMesh& mesh, const CollapseTarget& target, const Options& options) {
  if (auto problem = check_options(options)) return *problem;
  if (auto problem = check_mesh(mesh)) return *problem;
  auto engine = make_engine(options.device, options.threads);
  if (!engine.ok()) return engine.problem();
  Outcome outcome;
  try {
    outcome = (*engine)->simplify(mesh, target, options);
  } catch (const DeviceLost&) { outcome = make_host_engine(options.threads)->simplify(mesh, target, options); }
  if (outcome.crowded_edge) return not_manifold(mesh);
  return std::move(outcome.result);
}

proto::Result<fit::HeightMesh> smooth(const fit::HeightMesh& mesh, std::uint32_t steps, const std::string& device,
                                      unsigned threads, double lambda, double mu) {
  if (auto problem = check_mesh(mesh)) return *problem;
  auto engine = make_engine(device, threads);
  if (!engine.ok()) return engine.problem();
  fit::HeightMesh smoothed;
  try {
    smoothed = (*engine)->smooth(mesh, steps, lambda, mu);
  } catch (const DeviceLost&) { smoothed = make_host_engine(threads)->smooth(mesh, steps, lambda, mu); }
  if (smoothed.vertices() == 0) return not_manifold(mesh);
  return smoothed;
}

}  // namespace cordillera::gpu::cleap
