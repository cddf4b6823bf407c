#include "server/sandbox/environment.h"

#include <cstdlib>

#include "proto/parts.h"

namespace cordillera::server::sandbox {

const std::vector<Variable>& variables_of_jobs() {
  static const std::vector<Variable> table{
      {"PROJ_DATA", "where PROJ's tables are, if not in their usual place"},
      {"PROJ_LIB", "the same, by its older name"},
      {"GDAL_DATA", "where GDAL's tables are"},
      {"GDAL_CACHEMAX", "how much memory GDAL's blocks may take"},
      {"CORDILLERA_GEOIDS", "folders of geoid grids that the operator named"},
      {"GEOGRAPHICLIB_DATA", "where GeographicLib looks for its grids"},
      {"GEOGRAPHICLIB_GEOID_PATH", "the same, of geoids alone"},
      {"LD_LIBRARY_PATH", "where libraries are that the program was linked with, or the GPU's driver"},
      {"MALLOC_ARENA_MAX", "how much memory glibc keeps beside what is in use"},
      {"HOME", "CUDA keeps compiled kernels in ~/.nv; nothing else of it can be read"},
      {"CUDA_VISIBLE_DEVICES", "which GPUs this service may use"},
      {"CUDA_DEVICE_ORDER", "how those are numbered"},
      {"CUDA_MODULE_LOADING", "when kernels are loaded"},
      {"CUDA_CACHE_DISABLE", "whether CUDA keeps compiled kernels"},
      {"NVIDIA_VISIBLE_DEVICES", "which GPUs a container has"},
      {"ASAN_OPTIONS", "builds with a sanitizer: what it does with what it finds"},
      {"LSAN_OPTIONS", "the same"},
      {"TSAN_OPTIONS", "the same"},
      {"UBSAN_OPTIONS", "the same"},
  };
  return table;
}

std::vector<std::string> environment_of_jobs() {
  std::vector<std::string> environment;
  const auto take = [&](const std::string& name) {
    if (const char* value = std::getenv(name.c_str())) environment.push_back(name + "=" + value);
  };
  for (const Variable& variable : variables_of_jobs()) take(variable.name);
  const char* further = std::getenv(kFurtherVariables);
  proto::each_part(further == nullptr ? "" : further, ',', [&](std::string_view name) { take(std::string(name)); });
  return environment;
}

}  // namespace cordillera::server::sandbox
