#pragma once
// Refinement: vertices go in where a simplified mesh is farther from the truth than was promised.
//
// Greedy insertion (M. Garland, P. Heckbert, "Fast polygonal approximation of terrains and height fields", 1995): the worst
// triangle gets the point that is worst in it, and edges around the new vertex are turned while that lessens the greater error of
// their two triangles. Collapses see one vertex at a time; this is what makes an error in metres a promise.
#include <array>
#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "gpu/mesh/mesh_point.h"
#include "proto/mesh.h"

namespace cordillera::gpu {

struct TriangleError {
  double error_m = 0;
  /// Points that could become vertices, the best first; looked for only where the error exceeds the limit. In the triangle or
  /// near it, not on the tile's border; those that are vertices already are passed over.
  std::array<MeshPoint, 4> points{};
  int count = 0;
  void offer(const MeshPoint& p) { points[static_cast<std::size_t>(count++)] = p; }
};

/// What a trial asks of an error. A number alone is enough_m.
struct Glance {
  double enough_m;  ///< once the error is known to exceed it, any value that does. Most trials fail, and many at the first glance
  double floor_m = -1;    ///< errors up to it need not be told apart: any value up to it
  std::int32_t row = -1;  ///< where the worst is to be feared: it is looked at first
  Glance(double enough, double floor = -1, std::int32_t at = -1) : enough_m(enough), floor_m(floor), row(at) {}
};

/// Measures triangles with data at all corners. Pure: the same corners get the same answer.
class ErrorMeter {
 public:
  virtual ~ErrorMeter() = default;
  virtual TriangleError measure(const std::array<MeshPoint, 3>& corners, double limit_m) const = 0;
  /// The error alone, as far as it is asked for.
  virtual double error_m(const std::array<MeshPoint, 3>& corners, const Glance& asked) const = 0;
  /// The smallest triangle of the lattice whose being there would mend these corners' error over the limit, counter-clockwise; a
  /// corner without data has kNoHeight, and no triangle should be there. None: that error is within the limit, or has no such
  /// triangle.
  virtual std::optional<std::array<MeshPoint, 3>> wanted(const std::array<MeshPoint, 3>& /*corners*/, double /*limit_m*/) const {
    return std::nullopt;
  }
};

struct Refined {
  std::uint32_t inserted = 0;  ///< vertices, appended to the mesh
  std::uint32_t flipped = 0;   ///< edges
  std::uint32_t over = 0;      ///< triangles still over the limit: no point helps there, or valences leave no room
  /// Of refine_stuck: points of the tile's sides that are no vertices, and that triangles still over the limit would need. See
  /// split_side.
  std::vector<MeshPoint> on_sides;
};

/// Inserts points until no triangle reachable from `over` exceeds limit_m. over: indices of mesh.triangles, those that may exceed
/// it; all others must not. At most `most` points go in: samples come to an end by themselves, points of a surface need not.
/// Keeps the laws of a tile: positive area, exact cover, labels (a needle along a rim may go: a rim moves by less than half a
/// unit), its border; and valences: kMostValence inside, on sides and at corners what fits a row when welded.
Refined refine(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::span<const std::uint32_t> over,
               std::size_t most);

/// For triangles that refine has left over, one after the other: the triangle that the meter wants there is made, with more
/// neighbours for a while than a vertex has room for, and what is over limit_m then is refined. Where part of it would lie beyond
/// the mesh, its other points become vertices, those on the rim's edges too. Where the meter wants one with a corner that has no
/// data, triangles that no sample needs go from the rim, one after the other, and are cut off first where they are part of a
/// larger one; so does a needle along the rim where nothing else helps. A vertex that is left without triangles is void. What
/// does not come to within limit_m, with valences as they must be or were, stays as it was. Costs some copies of the mesh a
/// triangle. Laws and `over` as for refine.
Refined refine_stuck(proto::TileMesh& mesh, const ErrorMeter& meter, double limit_m, std::span<const std::uint32_t> over);

/// Makes a point of one of the tile's sides a vertex: the triangle there is cut in two. The tile beyond the side must get the
/// same vertex. Where the corner opposite has no room for a neighbour more, an edge is turned there, of all that can be the one
/// that changes the surface least. False, and the mesh is as it was: p is a vertex or on no side, an end of its edge has no data,
/// or there is no such edge. No error is measured: triangles around may be over any limit afterwards.
bool split_side(proto::TileMesh& mesh, const MeshPoint& p);

}  // namespace cordillera::gpu
