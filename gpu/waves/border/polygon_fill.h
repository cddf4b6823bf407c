#pragma once
// Triangles for the hole that a removed vertex leaves.
#include <array>
#include <cstdint>

#include "gpu/mesh/rings.h"

namespace cordillera::gpu {

/// A simple polygon, counter-clockwise; vertices may lie on straight lines.
struct Polygon {
  std::uint32_t count = 0;
  std::array<std::int64_t, kRowWidth> x{}, y{};
  std::array<std::int32_t, kRowWidth> budget{};  ///< how many diagonals may end here
};

/// Of three of its vertices; positive when counter-clockwise.
inline std::int64_t twice_area(const Polygon& p, std::uint32_t a, std::uint32_t b, std::uint32_t c) {
  return (p.x[b] - p.x[a]) * (p.y[c] - p.y[a]) - (p.y[b] - p.y[a]) * (p.x[c] - p.x[a]);
}

struct Diagonal {
  std::uint8_t from = 0, to = 0;
};

/// The diagonals of one triangulation.
struct Diagonals {
  std::uint32_t count = 0;
  std::array<Diagonal, kRowWidth> at{};
};

enum class Filled : std::uint8_t { yes, no };

/// All diagonals from one vertex, if every triangle has positive area and the budgets allow it.
Filled fill_from(const Polygon& polygon, std::uint32_t apex, Diagonals& diagonals);

/// Any triangulation of positive triangles within the budgets, found by a search that gives up after a fixed number of steps.
Filled fill_any(const Polygon& polygon, Diagonals& diagonals);

}  // namespace cordillera::gpu
