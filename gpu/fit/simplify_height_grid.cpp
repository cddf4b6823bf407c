#include "gpu/fit/simplify_height_grid.h"

#include "gpu/fit/check.h"
#include "gpu/fit/engine.h"

namespace cordillera::gpu::fit {
namespace {

std::optional<proto::Problem> check_grid(const HeightGrid& grid) {
  const std::string size = std::to_string(grid.columns) + " columns and " + std::to_string(grid.rows) + " rows";
  if (grid.z && grid.columns >= 2 && grid.rows >= 2 && std::uint64_t{grid.columns} * grid.rows <= std::uint64_t{1} << 28 &&
      grid.cell_x > 0 && grid.cell_y > 0)
    return {};
  return proto::Problem{"grid-broken", "the grid has " + size + ", or cells without a size",
                        "2 or more of both, at most 2^28 samples", "grid"};
}

}  // namespace

GridSimplifier::GridSimplifier(std::unique_ptr<FitEngine> engine) : engine_(std::move(engine)) {}
GridSimplifier::GridSimplifier(GridSimplifier&&) noexcept = default;
GridSimplifier& GridSimplifier::operator=(GridSimplifier&&) noexcept = default;
GridSimplifier::~GridSimplifier() = default;

proto::Result<GridSimplifier> GridSimplifier::make(const std::string& device, unsigned threads) {
  auto engine = make_engine(device, threads);
  if (!engine.ok()) return engine.problem();
  return GridSimplifier(std::move(*engine));
}

HeightGrid GridSimplifier::keep(const HeightGrid& grid) {
  HeightGrid kept = grid;
  kept.z = engine_->keep(grid);
  kept.on_device = true;
  return kept;
}

proto::Result<SimplifiedMesh> GridSimplifier::simplify(const HeightGrid& grid, const MeshTarget& target,
                                                       const MeshOptions& options) {
  if (auto problem = check_grid(grid)) return *problem;
  const std::uint64_t all = std::uint64_t{2} * (grid.columns - 1) * (grid.rows - 1);
  const auto wanted = triangles_wanted(target, all);
  if (!wanted.ok()) return wanted.problem();
  FitRequest request = request_of(*wanted, target, options);
  if (!request.by_error && *wanted >= all) request.recipe = recipe_of_nothing();
  PlanScale scale{grid.x0, grid.y0, grid.cell_x / LatticeSamples::kStep, grid.cell_y / LatticeSamples::kStep};
  const FittedMesh fitted = engine_->fit(grid, request, scale);
  if (fitted.fault == FittedMesh::Fault::not_finite) {
    return proto::Problem{"grid-not-finite", "sample " + std::to_string(fitted.fault_sample) + " is NaN or infinity",
                          "finite heights", "grid"};
  }
  SimplifiedMesh result;
  take_back(scale, std::size_t{grid.columns} * grid.rows, fitted, result);
  result.report.stages = engine_->stages();
  for (const proto::StageTime& stage : result.report.stages) result.report.seconds += stage.name == "fetch" ? 0 : stage.seconds;
  result.report.device = engine_->device();
  return result;
}

}  // namespace cordillera::gpu::fit
