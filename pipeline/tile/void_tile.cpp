#include "pipeline/tile/void_tile.h"

#include <algorithm>
#include <vector>

namespace cordillera::pipeline {
namespace {

using proto::TileMesh;

// One side of a square: way is the distance from its first corner, counter-clockwise, measured on the outermost square.
struct Run {
  std::vector<std::uint32_t> vertex;
  std::vector<std::int32_t> way;
  std::size_t segments() const { return vertex.size() - 1; }
};
// South (eastward), east (northward), north (westward), west (southward).
using Square = std::array<Run, 4>;

constexpr std::array<Side, 4> kTurn{Side::south, Side::east, Side::north, Side::west};

struct Point {
  std::int32_t x = 0, y = 0;
};

// The point at a way along the turn-th side of the square that lies inset units inside the tile's border.
Point point_on(std::int32_t side, std::int32_t inset, std::size_t turn, std::int32_t way) {
  const std::int32_t along = inset + static_cast<std::int32_t>(std::int64_t{way} * (side - 2 * inset) / side);
  switch (turn) {
    case 0: return {along, inset};
    case 1: return {side - inset, along};
    case 2: return {side - along, side - inset};
    default: return {inset, side - along};
  }
}

std::uint32_t add_vertex(TileMesh& mesh, Point p, std::int32_t height) {
  const bool none = height == proto::kNoHeight;
  const bool corner = (p.x == 0 || p.x == mesh.side) && (p.y == 0 || p.y == mesh.side);
  mesh.x.push_back(p.x);
  mesh.y.push_back(p.y);
  mesh.height.push_back(none ? 0 : height);
  mesh.mark.push_back(static_cast<std::uint8_t>((none ? proto::kVoid : 0) | (corner ? proto::kKeep : 0)));
  return static_cast<std::uint32_t>(mesh.vertices() - 1);
}

Square outer_square(TileMesh& mesh, const std::array<Chain, 4>& border) {
  Square square;
  for (std::size_t turn = 0; turn < 4; ++turn) {
    const Chain& chain = border[static_cast<std::size_t>(kTurn[turn])];
    const std::size_t count = chain.position.size();
    // The last vertex of a side is the first of the next one.
    for (std::size_t k = 0; k + 1 < count; ++k) {
      const std::size_t at = turn < 2 ? k : count - 1 - k;
      const std::int32_t way = turn < 2 ? chain.position[at] : mesh.side - chain.position[at];
      square[turn].way.push_back(way);
      square[turn].vertex.push_back(add_vertex(mesh, point_on(mesh.side, 0, turn, way), chain.height[at]));
    }
  }
  for (std::size_t turn = 0; turn < 4; ++turn) {
    square[turn].way.push_back(mesh.side);
    square[turn].vertex.push_back(square[(turn + 1) % 4].vertex.front());
  }
  return square;
}

// Every other vertex of the square, moved inward. A last odd segment joins the pair before it, so that gaps at least double: that
// keeps the moved positions apart without looking at them.
Square inner_square(TileMesh& mesh, const Square& outer, std::int32_t inset) {
  Square square;
  for (std::size_t turn = 0; turn < 4; ++turn) {
    const std::size_t half = std::max<std::size_t>(1, outer[turn].segments() / 2);
    for (std::size_t k = 0; k < half; ++k) {
      const std::int32_t way = outer[turn].way[2 * k];
      square[turn].way.push_back(way);
      square[turn].vertex.push_back(add_vertex(mesh, point_on(mesh.side, inset, turn, way), proto::kNoHeight));
    }
  }
  for (std::size_t turn = 0; turn < 4; ++turn) {
    square[turn].way.push_back(mesh.side);
    square[turn].vertex.push_back(square[(turn + 1) % 4].vertex.front());
  }
  return square;
}

// The strip between two parallel runs: any order of triangles along it has positive area.
void fill_strip(TileMesh& mesh, const Run& outer, const Run& inner) {
  const auto &o = outer.vertex, &i = inner.vertex;
  if (outer.segments() == 1) {
    mesh.triangles.push_back({o[0], o[1], i[1]});
    mesh.triangles.push_back({o[0], i[1], i[0]});
    return;
  }
  for (std::size_t k = 0; k < inner.segments(); ++k) {
    const std::size_t end = k + 1 == inner.segments() ? outer.segments() : 2 * k + 2;
    for (std::size_t j = 2 * k; j + 1 < end; ++j) mesh.triangles.push_back({o[j], o[j + 1], i[k]});
    mesh.triangles.push_back({o[end - 1], i[k + 1], i[k]});
    mesh.triangles.push_back({o[end - 1], o[end], i[k + 1]});
  }
}

// A square without vertices between its corners. Only where it is the tile's border can it have data.
void fill_square(TileMesh& mesh, const Square& square) {
  const std::array<std::uint32_t, 4> c{square[0].vertex[0], square[1].vertex[0], square[2].vertex[0], square[3].vertex[0]};
  const auto none = [&](std::size_t k) { return is_void(mesh, c[k]); };
  // Both triangles contain the diagonal: a void end of it makes both void.
  for (std::size_t turn = 0; turn < 2; ++turn) {
    if (!none(turn) && !none(turn + 2)) continue;
    mesh.triangles.push_back({c[turn], c[turn + 1], c[turn + 2]});
    mesh.triangles.push_back({c[turn], c[turn + 2], c[(turn + 3) % 4]});
    return;
  }
  const std::uint32_t centre = add_vertex(mesh, {mesh.side / 2, mesh.side / 2}, proto::kNoHeight);
  for (std::size_t k = 0; k < 4; ++k) mesh.triangles.push_back({c[k], c[(k + 1) % 4], centre});
}

}  // namespace

TileMesh void_tile(std::int32_t side, const std::array<Chain, 4>& border) {
  TileMesh mesh;
  mesh.side = side;
  Square square = outer_square(mesh, border);
  std::size_t most = 1;
  for (const Run& run : square) most = std::max(most, run.segments());
  std::int32_t squares = 0;
  while ((most >> (squares + 1)) > 0) ++squares;
  for (std::int32_t k = 1; k <= squares; ++k) {
    const auto inset = static_cast<std::int32_t>(std::int64_t{side} * k / (2 * (squares + 1)));
    const Square next = inner_square(mesh, square, inset);
    for (std::size_t turn = 0; turn < 4; ++turn) fill_strip(mesh, square[turn], next[turn]);
    square = next;
  }
  fill_square(mesh, square);
  return mesh;
}

}  // namespace cordillera::pipeline
