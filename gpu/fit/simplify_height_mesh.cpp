#include "gpu/fit/simplify_height_mesh.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "gpu/device/device_lost.h"
#include "gpu/fit/check.h"
#include "gpu/fit/engine.h"
#include "gpu/fit/steps/crew.h"
#include "gpu/fit/vertical_error.h"
#include "proto/numbers.h"

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

std::string span_text(const std::vector<double>& values) {
  const auto [low, high] = std::minmax_element(values.begin(), values.end());
  std::string text;
  proto::append_number(text, *high - *low);
  return text;
}

/// Metres. What an error is compared with: heights are floats about the middle of all.
struct Rounding {
  double heights = 0;  ///< what rounding of heights takes
  double of_most = 0;  ///< a share of what most vertices span, not the few that may have no height
};
Rounding rounding_of(const HeightMesh& mesh) {
  constexpr double kOfAll = 0x1p-22, kOfMost = 0x1p-14;
  std::vector<double> z = mesh.z;
  std::sort(z.begin(), z.end());
  const double all = z.back() - z.front();
  for (const std::size_t share : {20, 100, 1000}) {
    const double most = z[z.size() - 1 - z.size() / share] - z[z.size() / share];
    if (most > 0) return {std::min(kOfAll * all, kOfMost * most), kOfMost * most};
  }
  return {kOfAll * all, kOfAll * all};
}

/// The input as a result, which has no error.
void give_back(const HeightMesh& mesh, bool clockwise, SimplifiedMesh& result) {
  result.mesh = mesh;
  if (clockwise) {
    for (auto& triangle : result.mesh.triangles) std::swap(triangle[1], triangle[2]);
  }
  result.report.vertices = mesh.vertices();
  result.report.triangles = mesh.triangles.size();
  result.report.rmse_m = result.report.max_error_m = 0;
}

/// Plan and heights are kept to a share of what the mesh spans. So the smallest errors are kept by the input alone, which is the
/// result then; with parts far away, or heights that mean that there is no data, so are others, which is a problem. The report
/// gets what was measured.
std::optional<proto::Problem> keep_promise(const HeightMesh& mesh, double error_m, unsigned threads, bool clockwise,
                                           SimplifiedMesh& result) {
  const HeightMesh& made = result.mesh;
  Crew crew(threads);
  const auto error = vertical_error({made.x, made.y, made.z, made.triangles}, {mesh.x, mesh.y, mesh.z}, crew.threads(),
                                    [&](std::size_t shares, const auto& work) { crew.share(shares, work); });
  result.report.max_error_m = error.max, result.report.rmse_m = error.rmse;
  if (error.max <= error_m) return {};
  const Rounding rounding = rounding_of(mesh);
  if (error.max <= error_m + rounding.heights) return {};
  if (error.max <= rounding.of_most) return give_back(mesh, clockwise, result), std::nullopt;
  std::string detail = "no surface was found within the error: vertex " + std::to_string(error.worst) + " is ";
  proto::append_number(detail, error.max);
  detail += " off. The mesh spans " + span_text(mesh.x) + " in x, " + span_text(mesh.y) + " in y and " + span_text(mesh.z) +
            " in height";
  return proto::Problem{"bad-target", detail, "a mesh without far parts and without heights that mean no data, or a larger error",
                        "error"};
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
  if (!plan.is_lattice()) {
    if (auto problem = find_step(mesh)) return *problem;
    if (auto problem = find_crowd(mesh, plan.bin_company)) return *problem;
  }
  SimplifiedMesh result;
  result.report.stages.push_back({"plan", std::chrono::duration<double>(Clock::now() - start).count()});
  FitRequest request = request_of(*wanted, target, options);
  request.error = static_cast<float>(request.error_m * plan.scale.scale_z);
  const bool whole = request.by_error ? request.error_m == 0 : *wanted >= mesh.triangles.size();
  if (whole) request.by_error = false, request.triangles = mesh.triangles.size(), request.recipe = recipe_of_nothing();
  if (!plan.is_lattice())
    spare_scattered(request.recipe, static_cast<double>(*wanted) / static_cast<double>(mesh.triangles.size()));
  FittedMesh fitted;
  try {
    fitted = (*engine)->fit(plan, request);
  } catch (const DeviceLost&) {
    engine = make_host_fit(options.threads);
    fitted = (*engine)->fit(plan, request);
  }
  if (fitted.fault == FittedMesh::Fault::not_manifold) {
    if (auto problem = find_non_manifold(mesh)) return *problem;
    return too_many_edges(mesh);
  }
  if (fitted.fault == FittedMesh::Fault::overlap) return overlapping(mesh, plan, fitted.fault_sample);
  take_back(plan.scale, plan.at.size(), fitted, result);
  for (const proto::StageTime& stage : (*engine)->stages()) result.report.stages.push_back(stage);
  for (const proto::StageTime& stage : result.report.stages) result.report.seconds += stage.seconds;
  result.report.device = (*engine)->device();
  if (whole) give_back(mesh, clockwise, result);
  if (request.by_error) {
    if (auto problem = keep_promise(mesh, request.error_m, options.threads, clockwise, result)) return *problem;
  }
  return result;
}

}  // namespace cordillera::gpu::fit
