#pragma once
// Rings out of triangles. A wedge is a triangle seen from one of its corners: the other two, counter-clockwise. Wedges are
// gathered by corner (a counting sort whose order within a corner does not matter) and put end to end.
#include <array>
#include <cstdint>

#include "gpu/device/atomic.h"
#include "gpu/mesh/valence_limits.h"

namespace cordillera::gpu {

struct Wedge {
  std::uint32_t from = 0, to = 0;
};

enum class Fan : std::uint8_t { closed, open, broken };

/// count[v] += wedges of v.
struct CountWedges {
  const std::array<std::uint32_t, 3>* triangles;
  std::uint32_t* count;
  CORDILLERA_HD void operator()(std::size_t i) const {
    for (const std::uint32_t v : triangles[i]) fetch_add(count + v, 1);
  }
};

/// start[v]: where the wedges of v begin (the exclusive sum of the counts); afterwards, where they end.
struct PlaceWedges {
  const std::array<std::uint32_t, 3>* triangles;
  std::uint32_t* start;
  Wedge* wedges;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const std::array<std::uint32_t, 3>& t = triangles[i];
    for (std::size_t k = 0; k < 3; ++k) wedges[fetch_add(start + t[k], 1)] = {t[(k + 1) % 3], t[(k + 2) % 3]};
  }
};

CORDILLERA_HD inline void swap_wedges(Wedge& a, Wedge& b) {
  const Wedge c = a;
  a = b;
  b = c;
}

CORDILLERA_HD inline bool has_duplicates(const Wedge* fan, std::uint32_t count) {
  std::uint64_t seen = 0;  // a wrong alarm of this filter only costs the exact look
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint64_t bit = std::uint64_t{1} << (fan[i].from & 63);
    for (std::uint32_t j = 0; (seen & bit) && j < i; ++j)
      if (fan[i].from == fan[j].from) return true;
    seen |= bit;
  }
  return false;
}

/// Where the ring begins: the wedge that follows none (open), else the one with the lowest neighbour.
CORDILLERA_HD inline std::uint32_t first_wedge(const Wedge* fan, std::uint32_t count) {
  std::uint32_t parity = 0, lowest = 0;
  for (std::uint32_t i = 0; i < count; ++i) {
    parity ^= fan[i].from ^ fan[i].to;
    if (fan[i].from < fan[lowest].from) lowest = i;
  }
  for (std::uint32_t i = 0; i < count && parity != 0; ++i) {
    bool follows = false;
    for (std::uint32_t j = 0; j < count; ++j) follows = follows || fan[j].to == fan[i].from;
    if (!follows) return i;
  }
  return lowest;
}

/// Puts the wedges of one vertex end to end into its row; reorders fan. Whatever order they come in, the row is the same.
CORDILLERA_HD inline Fan chain_wedges(Wedge* fan, std::uint32_t count, std::uint32_t* row, std::uint8_t& valence) {
  if (count > kRowWidth || has_duplicates(fan, count)) return Fan::broken;
  swap_wedges(fan[0], fan[first_wedge(fan, count)]);
  row[0] = fan[0].from;
  for (std::uint32_t i = 0; i + 1 < count; ++i) {
    std::uint32_t next = i + 1;
    while (next < count && fan[next].from != fan[i].to) ++next;
    if (next == count) return Fan::broken;
    swap_wedges(fan[i + 1], fan[next]);
    row[i + 1] = fan[i + 1].from;
  }
  valence = static_cast<std::uint8_t>(count);
  if (fan[count - 1].to == fan[0].from) return count < 3 ? Fan::broken : Fan::closed;
  if (count == kRowWidth) return Fan::broken;
  row[valence++] = fan[count - 1].to;
  return Fan::open;
}

}  // namespace cordillera::gpu
