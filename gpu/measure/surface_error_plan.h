#pragma once
// One triangle in plan: which samples of a lattice row belong to it, and which it may show besides. Exact integers throughout.
#include <cstdint>

#include "proto/host_device.h"

namespace cordillera::gpu {

/// floor(n / d), d > 0.
CORDILLERA_HD inline std::int64_t floor_div(std::int64_t n, std::int64_t d) {
#ifdef __CUDA_ARCH__
  // For a GPU a division of 64 bits is a long program.
  const auto small_n = static_cast<std::int32_t>(n), small_d = static_cast<std::int32_t>(d);
  if (small_n == n && small_d == d) {
    const std::int32_t q = small_n / small_d;
    return q - (q * small_d > small_n ? 1 : 0);
  }
#endif
  const std::int64_t q = n / d;
  return q - (q * d > n ? 1 : 0);
}

/// A directed edge with the triangle on its left: cross(d, X - p) >= 0 inside.
struct PlanEdge {
  std::int64_t x = 0, y = 0, dx = 0, dy = 0;
  /// The chord in space may show samples up to cross >= -slack.
  std::int64_t slack = 0;
  /// Samples on the edge (its ends apart) count for this triangle, not for the one across.
  bool owned = false;
};

/// Inclusive; empty when first > last.
struct Span {
  std::int64_t first = 0, last = -1;
};

/// The samples of one row.
struct RowSpans {
  Span shown;   ///< every sample that a ray might see on this triangle; contains closed
  Span owned;   ///< samples that count for this triangle: interior and owned edges. Corners belong to the vertices
  Span strict;  ///< interior
  Span closed;  ///< with all edges and corners
};

struct PlanTriangle {
  PlanEdge edge[3];
  Span columns;  ///< no ray outside can meet the triangle
  Span rows;
  bool slack = false;  ///< any edge has some

  CORDILLERA_HD RowSpans row(std::int64_t y) const;
};

namespace detail {

/// The closed triangle's end on one side of a row, counted outward: position, whether exactly on an edge, and whose.
struct RowEnd {
  std::int64_t at;
  bool on_edge = false, owned = false;
  CORDILLERA_HD void cut(std::int64_t limit, bool exact, bool edge_owned) {
    if (limit < at) {
      at = limit;
      on_edge = exact;
      owned = edge_owned;
    } else if (limit == at && exact) {
      on_edge = true;
      owned = edge_owned;
    }
  }
};

}  // namespace detail

CORDILLERA_HD inline RowSpans PlanTriangle::row(std::int64_t y) const {
  constexpr std::int64_t kFar = std::int64_t{1} << 40;
  detail::RowEnd west{kFar}, east{kFar};  // west counts westward
  Span shown = columns;
  bool flat = false, flat_owned = false, beside = false;
  for (const PlanEdge& e : edge) {
    const std::int64_t along = e.dx * (y - e.y);
    if (e.dy == 0) {
      if (along < -e.slack) shown = {};
      if (along < 0) beside = true;
      if (along == 0) flat = true, flat_owned = e.owned;
      continue;
    }
    const std::int64_t d = e.dy < 0 ? -e.dy : e.dy;
    const std::int64_t q = floor_div(along, d);
    const bool exact = q * d == along;
    const std::int64_t reach = e.slack == 0 ? q : floor_div(along + e.slack, d);
    if (e.dy < 0) {
      west.cut(q - e.x, exact, e.owned);
      if (e.x - reach > shown.first) shown.first = e.x - reach;
    } else {
      east.cut(e.x + q, exact, e.owned);
      if (e.x + reach < shown.last) shown.last = e.x + reach;
    }
  }
  RowSpans spans{shown, {}, {}, {}};
  if (beside || -west.at > east.at) return spans;
  spans.closed = {-west.at, east.at};
  bool west_corner = false, east_corner = false;
  for (const PlanEdge& e : edge) {
    west_corner |= e.y == y && e.x == spans.closed.first;
    east_corner |= e.y == y && e.x == spans.closed.last;
  }
  if (flat) {
    if (flat_owned) spans.owned = {spans.closed.first + 1, spans.closed.last - 1};
    return spans;
  }
  spans.strict = {spans.closed.first + (west.on_edge ? 1 : 0), spans.closed.last - (east.on_edge ? 1 : 0)};
  spans.owned = {spans.closed.first + (west_corner || (west.on_edge && !west.owned) ? 1 : 0),
                 spans.closed.last - (east_corner || (east.on_edge && !east.owned) ? 1 : 0)};
  return spans;
}

}  // namespace cordillera::gpu
