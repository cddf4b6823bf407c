#pragma once
// Places in a tile's plan, between lattice vertices too.
namespace cordillera::pipeline {

/// A point between lattice vertices, tile-local units.
struct PlanPoint {
  double x = 0, y = 0;
};

/// Positive when counter-clockwise: c is to the left of a -> b then.
inline double twice_area(PlanPoint a, PlanPoint b, PlanPoint c) { return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x); }

}  // namespace cordillera::pipeline
