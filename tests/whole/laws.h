#pragma once
// The laws that every decoded tile set obeys. Each function returns the first violation in words, or nothing.
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "tests/whole/evaluator.h"

namespace cordillera::whole {

using Violation = std::optional<std::string>;

/// Whether the data has holes (or ends) inside the tile.
enum class Holes { none, allowed };

inline constexpr std::size_t kMostTriangles = 14;  ///< at a vertex

/// In plan: corners inside the tile, every triangle of positive integer area, no two of them overlapping, the tile covered
/// exactly. doubled_area: what the triangles' doubled areas must add up to where holes are allowed; none: no more than the tile.
Violation plan_violation(const DecodedTile& tile, Holes holes, std::optional<std::int64_t> doubled_area = std::nullopt);

/// Each directed edge used once; without holes, edges without a partner only on the tile's sides; the triangles at a vertex are
/// one fan; no more than kMostTriangles of them; no vertex without a triangle.
Violation manifold_violation(const DecodedTile& tile, Holes holes);

/// a and b of one level that touch (also over the antimeridian): along their common edge (or at the common corner) a place has
/// one height, and no vertex of one lies inside an edge of the other; without holes both have exactly the same vertices.
Violation neighbour_violation(const DecodedTile& a, const DecodedTile& b, Holes holes);

/// Seen along the ellipsoid's normal at each of its corners, every triangle is the right way up, and none has two corners at a
/// pole.
Violation space_violation(const DecodedSurface& surface);

/// What a tile must show: places of a closed rectangle, in its units, for which `must` is true. Every one of them lies under a
/// triangle.
struct Shown {
  std::int64_t west = 0, south = 0, east = 0, north = 0;
  std::function<bool(std::int64_t u, std::int64_t v)> must;
};
Violation cover_violation(const DecodedTile& tile, const Shown& shown);

/// A tile both ways a client can fetch it. points: those of the .glb's terrain primitive, ECEF, in double (float32 +
/// translation).
struct BothFaces {
  DecodedTile drc;
  std::vector<Point> points;
};

/// Every vertex that a and b share is in both .glb files, with bit-equal coordinates. step_of: what points of a
/// height in metres are rounded to.
using StepOf = std::function<double(double height_m)>;
Violation glb_neighbour_violation(const BothFaces& a, const BothFaces& b, const StepOf& step_of,
                                  double height_step_m = 1.0 / 1024);

}  // namespace cordillera::whole
