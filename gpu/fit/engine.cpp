#include "gpu/fit/engine.h"

#include <algorithm>
#include <charconv>
#include <cmath>

namespace cordillera::gpu::fit {

#ifndef CORDILLERA_HAS_CUDA
proto::Result<std::unique_ptr<FitEngine>> make_cuda_fit(int) {
  return proto::Problem{"device-unavailable", "this program was built without CUDA", "auto, cpu", "device"};
}
#endif

proto::Result<std::unique_ptr<FitEngine>> make_engine(const std::string& device, unsigned threads) {
  if (device == "cpu") return make_host_fit(threads);
  if (device.empty() || device == "auto") {
    auto cuda = make_cuda_fit(0);
    if (cuda.ok()) return cuda;
    return make_host_fit(threads);
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
