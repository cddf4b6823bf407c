#include "gpu/fit/simplify_height_mesh.h"

#include <chrono>
#include <cmath>

#include "gpu/device/device_lost.h"
#include "gpu/fit/check.h"
#include "gpu/fit/engine.h"

namespace cordillera::gpu::fit {
namespace {

using Clock = std::chrono::steady_clock;

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

}  // namespace

proto::Result<SimplifiedMesh> simplify(const HeightMesh& mesh, const MeshTarget& target, const MeshOptions& options) {
  bool clockwise = false;
  if (auto problem = check_triangles(mesh, clockwise)) return *problem;
  const auto wanted = triangles_wanted(target, mesh.triangles.size());
  if (!wanted.ok()) return wanted.problem();
  auto engine = make_engine(options.device, options.threads);
  if (!engine.ok()) return engine.problem();

  const Clock::time_point start = Clock::now();
  const Plan plan = make_plan(mesh, clockwise);
  SimplifiedMesh result;
  result.report.stages.push_back({"plan", std::chrono::duration<double>(Clock::now() - start).count()});
  FitRequest request = request_of(*wanted, target, options);
  request.error = static_cast<float>(request.error_m * plan.scale.scale_z);
  FittedMesh fitted;
  try {
    fitted = (*engine)->fit(plan, request);
  } catch (const DeviceLost&) {
    engine = make_host_fit(options.threads);
    fitted = (*engine)->fit(plan, request);
  }
  if (fitted.fault == FittedMesh::Fault::not_manifold) {
    if (auto problem = find_non_manifold(mesh)) return *problem;
    return proto::Problem{"mesh-not-manifold", "a vertex has more than 255 edges", "at most 255 edges at a vertex", "mesh"};
  }
  if (fitted.fault == FittedMesh::Fault::overlap) return overlapping(mesh, plan, fitted.fault_sample);
  take_back(plan.scale, plan.at.size(), fitted, result);
  for (const proto::StageTime& stage : (*engine)->stages()) result.report.stages.push_back(stage);
  for (const proto::StageTime& stage : result.report.stages) result.report.seconds += stage.seconds;
  result.report.device = (*engine)->device();
  return result;
}

}  // namespace cordillera::gpu::fit
