#include "gpu/fit/engine.h"

#include <algorithm>
#include <cmath>

#include "gpu/device/device_choice.h"

namespace cordillera::gpu::fit {

#ifndef CORDILLERA_HAS_CUDA
proto::Result<std::unique_ptr<FitEngine>> make_cuda_fit(int) { return built_without_cuda(); }
#endif

proto::Result<std::unique_ptr<FitEngine>> make_engine(const std::string& device, unsigned threads) {
  return on_device(
      device, [threads] { return make_host_fit(threads); }, make_cuda_fit);
}

FitRequest request_of(std::uint64_t triangles, const MeshTarget& target, const MeshOptions& options) {
  FitRequest request;
  request.triangles = triangles;
  request.by_error = target.kind == MeshTarget::Kind::error_m;
  request.error_m = target.value;
  request.recipe = recipe_of(options.quality);
  if (options.sweeps != MeshOptions::kOfQuality) request.recipe.sweeps = options.sweeps;
  if (options.exchanges != MeshOptions::kOfQuality) request.recipe.exchanges = options.exchanges;
  return request;
}

void take_back(const PlanScale& scale, std::size_t samples, const FittedMesh& fitted, SimplifiedMesh& result) {
  HeightMesh& mesh = result.mesh;
  const std::size_t count = fitted.at.size();
  mesh.x.resize(count);
  mesh.y.resize(count);
  mesh.z.resize(count);
  for (std::size_t v = 0; v < count; ++v) {
    mesh.x[v] = scale.x0 + fitted.at[v].x * scale.unit_x;
    mesh.y[v] = scale.y0 + fitted.at[v].y * scale.unit_y;
    mesh.z[v] = scale.middle_z + static_cast<double>(fitted.z[v]) / scale.scale_z;
  }
  mesh.triangles = fitted.triangles;
  double sum = 0, worst = 0;
  for (const float error : fitted.error) {
    sum += static_cast<double>(error) * static_cast<double>(error);
    worst = std::max(worst, std::abs(static_cast<double>(error)));
  }
  result.report.vertices = count;
  result.report.triangles = mesh.triangles.size();
  result.report.rmse_m = std::sqrt(sum / static_cast<double>(samples)) / scale.scale_z;
  result.report.max_error_m = worst / scale.scale_z;
}

}  // namespace cordillera::gpu::fit
