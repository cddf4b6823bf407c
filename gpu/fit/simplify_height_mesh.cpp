#include "gpu/fit/simplify_height_mesh.h"

#include <charconv>
#include <chrono>
#include <cmath>

#include "gpu/device_lost.h"
#include "gpu/fit/check.h"
#include "gpu/fit/fitter.h"

namespace cordillera::gpu::fit {
namespace {

using Clock = std::chrono::steady_clock;

proto::Result<std::unique_ptr<FitEngine>> make_engine(const std::string& device) {
  if (device == "cpu") return make_host_fit();
  if (device.empty() || device == "auto") {
    auto cuda = make_cuda_fit(0);
    if (cuda.ok()) return cuda;
    return make_host_fit();
  }
  int number = 0;
  bool known = device == "cuda";
  if (device.starts_with("cuda:")) {
    const char* const end = device.data() + device.size();
    const auto [stop, error] = std::from_chars(device.data() + 5, end, number);
    known = error == std::errc{} && stop == end && number >= 0;
  }
  if (!known)
    return proto::Problem{"unknown-device", "device \"" + device + "\" is not known", "auto, cpu, cuda, cuda:N", "device"};
  return make_cuda_fit(number);
}

proto::Problem overlapping(const HeightMesh& mesh, const Plan& plan, std::uint32_t sample) {
  const Point at = plan.point_of_sample(sample);
  const double x = plan.scale.x0 + at.x * plan.scale.unit_x, y = plan.scale.y0 + at.y * plan.scale.unit_y;
  std::size_t nearest = 0;
  double least = 1e300;
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    const double away = std::abs(mesh.x[v] - x) + std::abs(mesh.y[v] - y);
    if (away >= least) continue;
    least = away;
    nearest = v;
  }
  return {"mesh-not-height-field", "the surface lies over itself at vertex " + std::to_string(nearest),
          "a surface that covers no point of the plan twice", "mesh"};
}

void take_back(const Plan& plan, const FittedMesh& fitted, SimplifiedMesh& result) {
  HeightMesh& mesh = result.mesh;
  const std::size_t count = fitted.at.size();
  mesh.x.resize(count);
  mesh.y.resize(count);
  mesh.z.resize(count);
  for (std::size_t v = 0; v < count; ++v) {
    mesh.x[v] = plan.scale.x0 + fitted.at[v].x * plan.scale.unit_x;
    mesh.y[v] = plan.scale.y0 + fitted.at[v].y * plan.scale.unit_y;
    mesh.z[v] = plan.scale.middle_z + static_cast<double>(fitted.z[v]) / plan.scale.scale_z;
  }
  mesh.triangles = fitted.triangles;
  double sum = 0, worst = 0;
  for (const float error : fitted.error) {
    sum += static_cast<double>(error) * static_cast<double>(error);
    worst = std::max(worst, std::abs(static_cast<double>(error)));
  }
  result.report.vertices = count;
  result.report.triangles = mesh.triangles.size();
  result.report.rmse_m = std::sqrt(sum / static_cast<double>(plan.at.size())) / plan.scale.scale_z;
  result.report.max_error_m = worst / plan.scale.scale_z;
}

}  // namespace

#ifndef CORDILLERA_HAS_CUDA
proto::Result<std::unique_ptr<FitEngine>> make_cuda_fit(int) {
  return proto::Problem{"device-unavailable", "this program was built without CUDA", "auto, cpu", "device"};
}
#endif

proto::Result<SimplifiedMesh> simplify(const HeightMesh& mesh, const MeshTarget& target, const MeshOptions& options) {
  bool clockwise = false;
  if (auto problem = check_triangles(mesh, clockwise)) return *problem;
  const auto wanted = triangles_wanted(target, mesh.triangles.size());
  if (!wanted.ok()) return wanted.problem();
  auto engine = make_engine(options.device);
  if (!engine.ok()) return engine.problem();

  const Clock::time_point start = Clock::now();
  const Plan plan = make_plan(mesh, clockwise);
  SimplifiedMesh result;
  result.report.stages.push_back({"plan", std::chrono::duration<double>(Clock::now() - start).count()});
  FitRequest request{*wanted, target.kind == MeshTarget::Kind::error_m, static_cast<float>(target.value * plan.scale.scale_z),
                     recipe_of(options.quality)};
  if (options.sweeps != MeshOptions::kOfQuality) request.recipe.sweeps = options.sweeps;
  if (options.exchanges != MeshOptions::kOfQuality) request.recipe.exchanges = options.exchanges;
  FittedMesh fitted;
  try {
    fitted = (*engine)->fit(plan, request);
  } catch (const DeviceLost&) {
    engine = make_host_fit();
    fitted = (*engine)->fit(plan, request);
  }
  if (fitted.fault == FittedMesh::Fault::not_manifold) {
    if (auto problem = find_non_manifold(mesh)) return *problem;
    return proto::Problem{"mesh-not-manifold", "a vertex has more than 255 edges", "at most 255 edges at a vertex", "mesh"};
  }
  if (fitted.fault == FittedMesh::Fault::overlap) return overlapping(mesh, plan, fitted.fault_sample);
  take_back(plan, fitted, result);
  for (const MeshStage& stage : (*engine)->stages()) result.report.stages.push_back(stage);
  for (const MeshStage& stage : result.report.stages) result.report.seconds += stage.seconds;
  result.report.device = (*engine)->device();
  return result;
}

}  // namespace cordillera::gpu::fit
