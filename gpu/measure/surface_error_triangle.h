#pragma once
// All that is needed to measure one triangle of a tile, gathered from the mesh. Host and device use the same functions.
#include <cmath>
#include <cstdint>

#include "gpu/measure/ecef_steps.h"
#include "gpu/measure/surface_error_plan.h"
#include "gpu/measure/surface_error_plane.h"
#include "gpu/measure/surface_error_reach.h"

namespace cordillera::gpu {

/// A corner: tile-local units, height, its two decodings, and the frame of its row.
struct Corner {
  std::int32_t x = 0, y = 0;
  double height_m = 0;
  proto::Vec3 exact, rounded;
  proto::RowFrame row;
};

/// Facts of the tile that every triangle uses.
struct TileFacts {
  std::int32_t side = 0;
  double unit_rad = 0;  ///< one unit, along either axis
  EcefSteps ecef_steps;
  std::int32_t small_units = 0;                    ///< triangles no larger than this show no sample outside their plan
  proto::RowFrame off_south_pole, off_north_pole;  ///< the rows next to the poles
};

struct MeasuredTriangle {
  PlanTriangle plan;
  Plane exact, rounded;
  HeightRange exact_range, rounded_range;
  proto::Vec3 exact_corner[3], rounded_corner[3];
  double edge_m = 0;  ///< the longest

  /// The error at a sample beyond the edges in plan: 0 unless a ray really meets the triangle there.
  CORDILLERA_HD double error_beyond(const proto::RowFrame& row, const proto::ColumnFrame& column, double height_m) const {
    const proto::Vec3 foot = proto::ecef(row, column, 0), up = proto::normal(row, column);
    double error = 0;
    if (exact.shows() && meets(foot, up, exact_corner, edge_m)) error = distance(exact, exact_range, row, column, height_m);
    if (rounded.shows() && meets(foot, up, rounded_corner, edge_m))
      error = detail::most(error, distance(rounded, rounded_range, row, column, height_m));
    return error;
  }

 private:
  CORDILLERA_HD static double distance(const Plane& plane, const HeightRange& range, const proto::RowFrame& row,
                                       const proto::ColumnFrame& column, double height_m) {
    const double d = range.clamp(PlaneRow(plane, row).height_m(column.sin_lon, column.cos_lon)) - height_m;
    return d < 0 ? -d : d;
  }
};

namespace detail {

CORDILLERA_HD inline double distance2(const proto::Vec3& a, const proto::Vec3& b) { return proto::dot(a - b, a - b); }

/// Distances from the axis and the greatest |sin(latitude)| between two rows, s the southern one.
CORDILLERA_HD inline void set_rows(TriangleExtent& e, const TileFacts& tile, const proto::RowFrame& s, const proto::RowFrame& n) {
  const double up = most(e.high_m, 0), down = least(e.low_m, 0);
  const bool straddles = s.sin_lat < 0 && n.sin_lat > 0;
  const double rs = s.radius_m + down * s.cos_lat, rn = n.radius_m + down * n.cos_lat;
  e.least_radius_m = most(0, least(rs, rn));
  e.most_radius_m = (straddles ? proto::kSemiMajor_m : most(s.radius_m, n.radius_m)) + up;
  // Where a row is a pole's, the next row inward bounds the corners that are not on the pole.
  const proto::RowFrame& s2 = s.radius_m > 0 ? s : tile.off_south_pole;
  const proto::RowFrame& n2 = n.radius_m > 0 ? n : tile.off_north_pole;
  e.off_pole_radius_m = most(0, least(s2.radius_m + down * s2.cos_lat, n2.radius_m + down * n2.cos_lat));
  e.most_sin_lat = most(s.sin_lat < 0 ? -s.sin_lat : s.sin_lat, n.sin_lat < 0 ? -n.sin_lat : n.sin_lat);
}

/// Radians to whole units, not less, at most a little more than the tile.
CORDILLERA_HD inline double units(double rad, const TileFacts& tile) { return least(rad / tile.unit_rad, 2.0 * tile.side + 2); }

CORDILLERA_HD inline void widen(MeasuredTriangle& t, const TileFacts& tile, const TriangleExtent& extent) {
  const Reach reach = reach_of(extent);
  const double u = units(reach.lon_rad, tile), v = units(reach.lat_rad, tile), beyond = units(reach.beyond_lon_rad, tile);
  t.plan.columns.first -= static_cast<std::int64_t>(beyond);
  t.plan.columns.last += static_cast<std::int64_t>(beyond);
  t.plan.rows.first -= static_cast<std::int64_t>(v);
  t.plan.rows.last += static_cast<std::int64_t>(v);
  for (PlanEdge& e : t.plan.edge) {
    const double du = static_cast<double>(e.dx < 0 ? -e.dx : e.dx), dv = static_cast<double>(e.dy < 0 ? -e.dy : e.dy);
    e.slack = static_cast<std::int64_t>((u * dv + v * du) * 1.001);
    t.plan.slack |= e.slack > 0;
  }
}

}  // namespace detail

/// What the rounding of frames may add to an error: some micrometres on the ground, which on a sliver as steep as a wall are
/// millimetres of height. Of the steeper decoding.
CORDILLERA_HD inline double place_error_m(const MeasuredTriangle& t) {
  constexpr double kPlace_m = 2e-5, kSteepest = 1e4;
  constexpr double kPolar2 = (1 - proto::kFlattening) * (1 - proto::kFlattening);
  const proto::Vec3& p = t.exact_corner[0];
  const proto::Vec3 up{p.x, p.y, p.z / kPolar2};
  double steepest = 0;
  const Plane* const planes[] = {&t.exact, &t.rounded};
  for (const Plane* plane : planes) {
    if (!plane->shows()) continue;
    const double along = proto::dot(plane->normal, up), rise = along < 0 ? -along : along;
    const double whole = sqrt(proto::dot(plane->normal, plane->normal) * proto::dot(up, up));
    steepest = detail::most(steepest, rise * kSteepest > whole ? whole / rise : kSteepest);
  }
  return kPlace_m * steepest;
}

/// The largest square of units whose triangles surely show no sample outside their plan, whatever their place in the tile.
CORDILLERA_HD inline std::int32_t small_units(const TileFacts& tile, const proto::RowFrame& south, const proto::RowFrame& north,
                                              double low_m, double high_m) {
  TriangleExtent e;
  e.low_m = low_m;
  e.high_m = high_m;
  e.step_m = tile.ecef_steps.coarsest_m;
  detail::set_rows(e, tile, south, north);
  const double r0 = e.least_radius_m, r1 = e.most_radius_m;
  for (std::int32_t size = 1024; size > 0; size /= 2) {
    e.dlon_rad = e.dlat_rad = size * tile.unit_rad;
    const double across = 6.5e6 * e.dlat_rad, up = high_m - low_m;
    e.edge2_m2 = 2 * across * across + up * up;
    // Distances from the axis differ within the triangle only, not over the tile.
    e.least_radius_m = r0;
    e.most_radius_m = detail::least(r1, r0 + across + up);
    Reach reach = reach_of(e);
    // The bulge and the quotients are largest where the radius is largest or least: bound each by its own worst.
    e.most_radius_m = r1;
    reach.lat_rad = reach_of(e).lat_rad;
    const double worst = size * (reach.lon_rad + reach.lat_rad) / tile.unit_rad + reach.beyond_lon_rad / tile.unit_rad;
    if (worst < 0.99) return size;
  }
  return 0;
}

/// Of two triangles at an edge, the one that sees it run north (or due east) counts its samples; on the tile's border the only
/// one does.
template <class Place>
CORDILLERA_HD bool counts_edge(std::int32_t side, const Place& from, const Place& to) {
  const bool border = (from.x == to.x && (from.x == 0 || from.x == side)) || (from.y == to.y && (from.y == 0 || from.y == side));
  return border || to.y > from.y || (to.y == from.y && to.x > from.x);
}

/// owned: bit k set when samples on the edge from corner k to the next count for this triangle.
CORDILLERA_HD inline MeasuredTriangle measured_triangle(const TileFacts& tile, const Corner (&c)[3], unsigned owned) {
  using detail::least;
  using detail::most;
  MeasuredTriangle t;
  std::int32_t west = c[0].x, east = c[0].x, south = c[0].y, north = c[0].y;
  const proto::RowFrame *south_row = &c[0].row, *north_row = &c[0].row;
  TriangleExtent extent;
  extent.low_m = least(c[0].height_m, least(c[1].height_m, c[2].height_m));
  extent.high_m = most(c[0].height_m, most(c[1].height_m, c[2].height_m));
  extent.step_m = tile.ecef_steps.between(extent.low_m, extent.high_m);
  for (int k = 0; k < 3; ++k) {
    const Corner &p = c[k], &q = c[k == 2 ? 0 : k + 1];
    t.plan.edge[k] = {p.x, p.y, std::int64_t{q.x} - p.x, std::int64_t{q.y} - p.y, 0, (owned >> k & 1) != 0};
    west = p.x < west ? p.x : west;
    east = p.x > east ? p.x : east;
    south_row = p.y < south ? &p.row : south_row;
    north_row = p.y > north ? &p.row : north_row;
    south = p.y < south ? p.y : south;
    north = p.y > north ? p.y : north;
    extent.edge2_m2 = most(extent.edge2_m2, detail::distance2(p.exact, q.exact));
    t.exact_corner[k] = p.exact;
    t.rounded_corner[k] = p.rounded;
  }
  t.plan.columns = {west, east};
  t.plan.rows = {south, north};
  if (east - west > tile.small_units || north - south > tile.small_units) {
    extent.dlon_rad = (east - west) * tile.unit_rad;
    extent.dlat_rad = (north - south) * tile.unit_rad;
    detail::set_rows(extent, tile, *south_row, *north_row);
    detail::widen(t, tile, extent);
    t.plan.columns = {t.plan.columns.first > 0 ? t.plan.columns.first : 0,
                      t.plan.columns.last < tile.side ? t.plan.columns.last : tile.side};
    t.plan.rows = {t.plan.rows.first > 0 ? t.plan.rows.first : 0, t.plan.rows.last < tile.side ? t.plan.rows.last : tile.side};
  }
  t.edge_m = sqrt(extent.edge2_m2);
  t.exact = plane_of(c[0].exact, c[1].exact, c[2].exact);
  t.rounded = plane_of(c[0].rounded, c[1].rounded, c[2].rounded);
  t.exact_range = height_range(extent.low_m, extent.high_m, extent.edge2_m2, 1e-6);
  t.rounded_range =
      height_range(extent.low_m, extent.high_m, extent.edge2_m2 * 1.01 + 400 * extent.step_m * extent.step_m, extent.step_m);
  return t;
}

}  // namespace cordillera::gpu
