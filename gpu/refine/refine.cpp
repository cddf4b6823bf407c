#include "gpu/refine/refine.h"

#include "gpu/refine/refinement.h"

namespace cordillera::gpu {

Refined refine(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::span<const std::uint32_t> over,
               std::size_t most) {
  return over.empty() ? Refined{} : Refinement(mesh, meter, limit_m).run(over, most);
}

}  // namespace cordillera::gpu
