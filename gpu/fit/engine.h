#pragma once
// What simplifiers of meshes and of grids share: a device by its name, a request, and the way back into the input's coordinates.
#include "gpu/fit/fitter.h"

namespace cordillera::gpu::fit {

proto::Result<std::unique_ptr<FitEngine>> make_engine(const std::string& device, unsigned threads);

FitRequest request_of(std::uint64_t triangles, const MeshTarget& target, const MeshOptions& options);

/// The mesh, and what the report says of it.
void take_back(const PlanScale& scale, std::size_t samples, const FittedMesh& fitted, SimplifiedMesh& result);

}  // namespace cordillera::gpu::fit
