#pragma once
// What is known of the finest samples by way of a mesh, where they are out of reach themselves.
#include <vector>

#include "gpu/refine/refine.h"
#include "proto/mesh.h"

namespace cordillera::pipeline {

/// What a mesh leaves out: where no published triangle is, there may be data.
struct Loose {
  std::vector<gpu::MeshPoint> samples;  ///< finest samples with data, by rows from the south-west, each once
  proto::TileMesh patches;  ///< triangles of finer surfaces, all with data, which may overlap; its rectangle is not covered
  std::vector<double> patch_error_m;  ///< indexed by triangle of patches: how far samples on it may be from it

  bool empty() const { return samples.empty() && patches.triangles.empty(); }
};

/// Every finest sample with data in the mesh's rectangle is one of three: on a published triangle and no farther from it than
/// max_error_m; on a patch and no farther from it than its error; or a loose one, whose height is known. Also more than one of
/// them.
struct Surface {
  proto::TileMesh mesh;
  double max_error_m = 0;
  Loose loose{};
};

}  // namespace cordillera::pipeline
