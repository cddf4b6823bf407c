#include "pipeline/tile/weld.h"

#include <string>
#include <vector>

#include "pipeline/tile/border.h"
#include "pipeline/tile/void_tile.h"

namespace cordillera::pipeline {
namespace {

using proto::kNoHeight;
using proto::TileMesh;

// A border between two children, seen from both; first has the lower index.
struct Seam {
  std::size_t first = 0, second = 0;
  Side of_first{}, of_second{};
};
constexpr std::array<Seam, 4> kSeams{{{0, 1, Side::east, Side::west},
                                      {2, 3, Side::east, Side::west},
                                      {0, 2, Side::north, Side::south},
                                      {1, 3, Side::north, Side::south}}};

// Heights at the nine points where the children's corners are, row by row from the south-west; void where nobody has data.
using Corners = std::array<std::int32_t, 9>;

struct Ends {
  std::size_t from = 0, to = 0;
};

// The two of the nine points between which a side of a child runs.
Ends ends_of(std::size_t child, Side side) {
  const std::size_t sw = (child & 1) + 3 * (child >> 1);
  switch (side) {
    case Side::west: return {sw, sw + 3};
    case Side::east: return {sw + 1, sw + 4};
    case Side::south: return {sw, sw + 1};
    default: return {sw + 3, sw + 4};
  }
}

void note_corners(Corners& corners, Ends ends, const Chain& chain) {
  if (chain.height.front() != kNoHeight) corners[ends.from] = chain.height.front();
  if (chain.height.back() != kNoHeight) corners[ends.to] = chain.height.back();
}

// What is known of a side of a missing child, from the child across the seam or from outside; void corners where nothing is.
Chain known_side(const WeldInput& input, std::size_t child, Side side) {
  for (const Seam& seam : kSeams) {
    const bool first = seam.first == child && seam.of_first == side;
    const bool second = seam.second == child && seam.of_second == side;
    if (!first && !second) continue;
    const TileMesh* across = input.children[first ? seam.second : seam.first];
    return across ? border_chain(*across, first ? seam.of_second : seam.of_first) : void_chain(input.child_side);
  }
  const Chain* outside = input.outer[child][static_cast<std::size_t>(side)];
  return outside ? *outside : void_chain(input.child_side);
}

constexpr std::array<Side, 4> kAllSides{Side::west, Side::east, Side::south, Side::north};

TileMesh stand_in(const WeldInput& input, std::size_t child, const Corners& corners) {
  std::array<Chain, 4> border;
  for (const Side side : kAllSides) {
    Chain& chain = border[static_cast<std::size_t>(side)] = known_side(input, child, side);
    const Ends ends = ends_of(child, side);
    chain.height.front() = corners[ends.from];
    chain.height.back() = corners[ends.to];
  }
  return void_tile(input.child_side, border);
}

Corners corners_of(const WeldInput& input) {
  Corners corners;
  corners.fill(kNoHeight);
  for (std::size_t child = 0; child < 4; ++child) {
    for (const Side side : kAllSides) {
      const TileMesh* mesh = input.children[child];
      note_corners(corners, ends_of(child, side), mesh ? border_chain(*mesh, side) : known_side(input, child, side));
    }
  }
  return corners;
}

constexpr std::uint32_t kNew = UINT32_MAX;

// Gives the vertices that the second child shares the numbers that they have got in the first one.
bool join(const Seam& seam, const std::array<const TileMesh*, 4>& children, std::array<std::vector<std::uint32_t>, 4>& number) {
  const TileMesh &a = *children[seam.first], &b = *children[seam.second];
  if (!(border_chain(a, seam.of_first) == border_chain(b, seam.of_second))) return false;
  const auto of_a = side_vertices(a, seam.of_first), of_b = side_vertices(b, seam.of_second);
  for (std::size_t k = 0; k < of_a.size(); ++k) number[seam.second][of_b[k]] = number[seam.first][of_a[k]];
  return true;
}

void append(TileMesh& parent, const TileMesh& child, std::size_t index, std::vector<std::uint32_t>& number) {
  const std::int32_t east = index & 1 ? child.side : 0, north = index & 2 ? child.side : 0;
  for (std::uint32_t v = 0; v < child.vertices(); ++v) {
    if (number[v] != kNew) continue;
    number[v] = static_cast<std::uint32_t>(parent.vertices());
    const std::int32_t x = child.x[v] + east, y = child.y[v] + north;
    const bool corner = (x == 0 || x == parent.side) && (y == 0 || y == parent.side);
    parent.x.push_back(x);
    parent.y.push_back(y);
    parent.height.push_back(child.height[v]);
    parent.mark.push_back(static_cast<std::uint8_t>((child.mark[v] & proto::kVoid) | (corner ? proto::kKeep : 0)));
  }
  for (const auto& t : child.triangles) parent.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
}

}  // namespace

proto::Result<TileMesh> weld(const WeldInput& input) {
  const Corners corners = corners_of(input);
  std::array<TileMesh, 4> made;
  std::array<const TileMesh*, 4> children = input.children;
  std::array<std::vector<std::uint32_t>, 4> number;
  for (std::size_t c = 0; c < 4; ++c) {
    if (!children[c]) children[c] = &(made[c] = stand_in(input, c, corners));
    if (children[c]->side != input.child_side)
      return proto::Problem{"weld-mismatch", "child " + std::to_string(c) + " of a weld has a side of its own", "", ""};
    number[c].assign(children[c]->vertices(), kNew);
  }
  TileMesh parent;
  parent.side = 2 * input.child_side;
  for (std::size_t c = 0; c < 4; ++c) {
    for (const Seam& seam : kSeams) {
      if (seam.second == c && !join(seam, children, number))
        return proto::Problem{
            "weld-mismatch",
            "children " + std::to_string(seam.first) + " and " + std::to_string(c) + " differ on their common border", "", ""};
    }
    append(parent, *children[c], c, number[c]);
  }
  return parent;
}

}  // namespace cordillera::pipeline
