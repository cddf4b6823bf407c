// The simplifier as a library: a height field in, a tenth of its triangles out. Link cordillera_gpu; nothing else is needed.
#include <cmath>
#include <cstdio>

#include "gpu/fit/simplify_height_mesh.h"

using namespace cordillera::gpu::fit;

int main() {
  // 101 x 101 vertices, 30 m apart; x and y in the plan, z up, triangles counter-clockwise seen from above.
  HeightMesh hill;
  const std::uint32_t side = 101;
  for (std::uint32_t k = 0; k < side * side; ++k) {
    hill.x.push_back(30.0 * (k % side));
    hill.y.push_back(30.0 * (k / side));
    hill.z.push_back(400 * std::exp(-std::pow((k % side - 50.0) / 25, 2) - std::pow((k / side - 50.0) / 20, 2)));
  }
  for (std::uint32_t k = 0; k < side * (side - 1); ++k) {
    if (k % side == side - 1) continue;
    hill.triangles.push_back({k, k + 1, k + side + 1});
    hill.triangles.push_back({k, k + side + 1, k + side});
  }

  const auto result = simplify(hill, MeshTarget::keep(0.1), {Quality::default_, "cpu"});
  if (!result) {
    std::fprintf(stderr, "%s\n", result.problem().line().c_str());  // what is wrong, where, and what would be accepted
    return 1;
  }
  const MeshReport& report = result->report;
  std::printf("%zu of %zu triangles, RMSE %.3f m, greatest error %.3f m, %.3f s on %s\n", result->mesh.triangles.size(),
              hill.triangles.size(), report.rmse_m, report.max_error_m, report.seconds, report.device.c_str());
  return 0;
}
