#include "pipeline/exports/hilbert.h"

#include <utility>

namespace cordillera::pipeline::exports {
namespace {

/// Tiles of all zooms below this one: (4^zoom - 1) / 3.
std::uint64_t before(int zoom) { return ((std::uint64_t{1} << (2 * zoom)) - 1) / 3; }

/// Into the frame of a quadrant of the curve and out of it again: the same step does both.
void turn(std::uint32_t side, bool right, bool upper, std::uint32_t& x, std::uint32_t& y) {
  if (upper) return;
  if (right) {
    x = side - 1 - x;
    y = side - 1 - y;
  }
  std::swap(x, y);
}

}  // namespace

std::uint64_t hilbert_id(const SquareAddress& address) {
  std::uint64_t id = before(address.zoom);
  std::uint32_t x = address.x, y = address.y;
  for (int bit = address.zoom - 1; bit >= 0; --bit) {
    const std::uint32_t side = std::uint32_t{1} << bit;
    const bool right = (x & side) != 0, upper = (y & side) != 0;
    const std::uint64_t quadrant = right ? (upper ? 2 : 3) : (upper ? 1 : 0);
    id += quadrant << (2 * bit);
    x &= side - 1;
    y &= side - 1;
    turn(side, right, upper, x, y);
  }
  return id;
}

SquareAddress hilbert_address(std::uint64_t id) {
  SquareAddress address;
  while (before(address.zoom + 1) <= id) ++address.zoom;
  std::uint64_t rest = id - before(address.zoom);
  for (int bit = 0; bit < address.zoom; ++bit, rest >>= 2) {
    const std::uint32_t side = std::uint32_t{1} << bit;
    const bool right = (rest & 2) != 0, upper = ((rest ^ (rest >> 1)) & 1) != 0;
    turn(side, right, upper, address.x, address.y);
    address.x |= right ? side : 0;
    address.y |= upper ? side : 0;
  }
  return address;
}

}  // namespace cordillera::pipeline::exports
