#pragma once
// What is refused, and why.
#include <optional>

#include "gpu/fit/simplify_height_mesh.h"

namespace cordillera::gpu::fit {

/// What can be seen triangle by triangle; clockwise: all triangles turn so.
std::optional<proto::Problem> check_triangles(const HeightMesh& mesh, bool& clockwise);
/// Of a mesh that passed the former: the first edge of more than two triangles, or the first vertex of two fans.
std::optional<proto::Problem> find_non_manifold(const HeightMesh& mesh);
/// The first two vertices that lie above each other.
std::optional<proto::Problem> find_step(const HeightMesh& mesh);
/// The vertex with the most edges of a manifold, which are too many.
proto::Problem too_many_edges(const HeightMesh& mesh);
/// A vertex that is far away from all others stretches the plan over what lies between, and nearly all of them are in a few of
/// its bins. company: Plan::bin_company.
std::optional<proto::Problem> find_crowd(const HeightMesh& mesh, double company);
/// The number of triangles asked for; 0 for a target in metres.
proto::Result<std::uint64_t> triangles_wanted(const MeshTarget& target, std::uint64_t triangles);

}  // namespace cordillera::gpu::fit
