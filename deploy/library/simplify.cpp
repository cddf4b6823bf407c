// The C functions over gpu/fit. Nothing is thrown through them.
#include "cordillera/simplify.h"

#include <algorithm>
#include <cstring>
#include <exception>
#include <memory>
#include <new>
#include <optional>

#include "gpu/fit/simplify_height_mesh.h"

using namespace cordillera;
using gpu::fit::HeightMesh;
using gpu::fit::MeshOptions;
using gpu::fit::MeshTarget;
using gpu::fit::Quality;

struct cordillera_result {
  std::optional<proto::Problem> problem;
  std::string line;
  gpu::fit::SimplifiedMesh simplified;
};

namespace {

proto::Problem wrong_option(const char* what, const char* accepted) { return {"option-invalid", what, accepted, ""}; }

/// What the caller's header had of the options; the rest is zero.
cordillera_options known(const cordillera_options* given) {
  cordillera_options options = {};
  if (given != nullptr) std::memcpy(&options, given, std::min(given->size, sizeof options));
  return options;
}

proto::Result<MeshTarget> target_of(const cordillera_options& options) {
  switch (options.target) {
    case CORDILLERA_KEEP: return MeshTarget::keep(options.value);
    case CORDILLERA_TRIANGLES: return MeshTarget{MeshTarget::Kind::triangles, options.value};
    case CORDILLERA_ERROR: return MeshTarget::error_m(options.value);
    default: return wrong_option("no such target", "a value of cordillera_target");
  }
}

proto::Result<Quality> quality_of(const cordillera_options& options) {
  switch (options.quality) {
    case CORDILLERA_DEFAULT: return Quality::default_;
    case CORDILLERA_FAST: return Quality::fast;
    case CORDILLERA_BEST: return Quality::best;
    case CORDILLERA_MINIMAX: return Quality::minimax;
    default: return wrong_option("no such quality", "a value of cordillera_quality");
  }
}

HeightMesh copied(const cordillera_mesh& mesh) {
  HeightMesh copy;
  copy.x.assign(mesh.x, mesh.x + mesh.vertices);
  copy.y.assign(mesh.y, mesh.y + mesh.vertices);
  copy.z.assign(mesh.z, mesh.z + mesh.vertices);
  copy.triangles.resize(mesh.triangle_count);
  for (std::size_t t = 0; t < mesh.triangle_count; ++t)
    copy.triangles[t] = {mesh.triangles[3 * t], mesh.triangles[3 * t + 1], mesh.triangles[3 * t + 2]};
  return copy;
}

proto::Result<gpu::fit::SimplifiedMesh> simplified(const cordillera_mesh& mesh, const cordillera_options& options) {
  const auto target = target_of(options);
  if (!target) return target.problem();
  const auto quality = quality_of(options);
  if (!quality) return quality.problem();
  MeshOptions words;
  words.quality = *quality;
  words.device = options.device == nullptr ? "auto" : options.device;
  words.threads = options.threads;
  return gpu::fit::simplify(copied(mesh), *target, words);
}

}  // namespace

cordillera_result* cordillera_simplify(const cordillera_mesh* mesh, const cordillera_options* options) try {
  auto result = std::make_unique<cordillera_result>();
  try {
    auto made = simplified(*mesh, known(options));
    if (made)
      result->simplified = *std::move(made);
    else
      result->problem = made.problem();
  } catch (const std::bad_alloc&) {
    result->problem = {"memory-limit", "there is not enough memory for this mesh", "a smaller one", ""};
  } catch (const std::exception& error) {
    result->problem = {"internal", error.what(), "", ""};
  }
  if (result->problem) result->line = result->problem->line();
  return result.release();
} catch (...) { return nullptr; }

void cordillera_result_free(cordillera_result* result) { delete result; }

const char* cordillera_result_problem(const cordillera_result* result) {
  return result->problem ? result->line.c_str() : nullptr;
}

const char* cordillera_result_problem_type(const cordillera_result* result) {
  return result->problem ? result->problem->type.c_str() : nullptr;
}

cordillera_mesh cordillera_result_mesh(const cordillera_result* result) {
  const HeightMesh& mesh = result->simplified.mesh;
  return {mesh.x.data(),
          mesh.y.data(),
          mesh.z.data(),
          mesh.vertices(),
          mesh.triangles.empty() ? nullptr : mesh.triangles.data()->data(),
          mesh.triangles.size()};
}

double cordillera_result_rmse(const cordillera_result* result) { return result->simplified.report.rmse_m; }
double cordillera_result_max_error(const cordillera_result* result) { return result->simplified.report.max_error_m; }
double cordillera_result_seconds(const cordillera_result* result) { return result->simplified.report.seconds; }
const char* cordillera_result_device(const cordillera_result* result) { return result->simplified.report.device.c_str(); }
const char* cordillera_version(void) { return CORDILLERA_VERSION; }
