#pragma once
// Which way up a triangle is in space. Positive area in longitude and latitude is not enough: an edge is straight in space, so
// beside a pole, where parallels turn, and on needles, a triangle may show its back to whoever looks along the ellipsoid's
// normal.
#include <array>

#include "gpu/measure/ecef_steps.h"
#include "gpu/refine/refine.h"

namespace cordillera::gpu {

/// Where a tile is, and what its points are rounded to.
struct TilePlace {
  const proto::Lattice* lattice = nullptr;
  proto::TileAddress tile;
  std::int32_t side = 0;
  EcefSteps ecef_steps;
};

class Upright {
 public:
  explicit Upright(const TilePlace& place);
  /// Seen along the normal at each corner, is the triangle the right way up, its points exact and rounded? One with two corners
  /// at a pole counts as if it were: it is a line, and nobody sees it. Corners are counter-clockwise in plan.
  bool is(const std::array<MeshPoint, 3>& corners) const;

 private:
  bool cannot_turn(const std::array<MeshPoint, 3>& corners) const;
  bool at_pole(const MeshPoint& p) const;

  TilePlace at_;
  std::int64_t west_, south_;
  double unit_rad_, least_cos_;
};

/// Published triangles of a mesh that are not, by index.
std::vector<std::uint32_t> turned_triangles(const Upright& upright, const proto::TileMesh& mesh);

/// To it a triangle that is turned over is infinitely far off. Borrows both.
class UprightMeter final : public ErrorMeter {
 public:
  UprightMeter(const ErrorMeter& meter, const Upright& upright) : meter_(meter), upright_(upright) {}
  TriangleError measure(const std::array<MeshPoint, 3>& corners, double limit_m) const override;
  double error_m(const std::array<MeshPoint, 3>& corners, const Glance& asked) const override;
  std::optional<std::array<MeshPoint, 3>> wanted(const std::array<MeshPoint, 3>& corners, double limit_m) const override {
    return meter_.wanted(corners, limit_m);
  }

 private:
  const ErrorMeter& meter_;
  const Upright& upright_;
};

}  // namespace cordillera::gpu
