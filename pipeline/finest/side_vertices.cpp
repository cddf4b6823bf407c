#include "pipeline/finest/side_vertices.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <utility>

#include "gpu/refine/height_step.h"
#include "gpu/refine/refine.h"
#include "pipeline/plan/plan.h"
#include "pipeline/tile/border.h"
#include "pipeline/tile/sample_at.h"

namespace cordillera::pipeline {
namespace {

using gpu::MeshPoint;

/// Vertices that pixels need on sides of tiles may need others.
constexpr int kMostSideRounds = 4;

/// A side of a tile, as a line: its vertices, and its samples.
class SideLine {
 public:
  /// p: on the side, at no corner of the tile.
  SideLine(const LevelContext& context, const BuiltTile& built, const MeshPoint& p)
      : samples_(*context.samples),
        lattice_(*context.lattice),
        tile_(built.tile),
        side_(built.mesh.side),
        runs_north_(p.x == 0 || p.x == side_),
        across_(runs_north_ ? p.x : p.y),
        vertices_(border_chain(built.mesh,
                               runs_north_ ? (p.x == 0 ? Side::west : Side::east) : (p.y == 0 ? Side::south : Side::north))) {}

  bool runs_north() const { return runs_north_; }
  const Chain& vertices() const { return vertices_; }
  /// The tile beyond it, and the same point there.
  proto::TileAddress tile_beyond() const {
    const std::int32_t step = across_ == 0 ? -1 : 1;
    if (!runs_north_) return {tile_.z, tile_.x, tile_.y + step};
    const std::int32_t across = proto::tiles_across(tile_.z);
    return {tile_.z, (tile_.x + step + across) % across, tile_.y};
  }
  MeshPoint point(std::int32_t along, std::int32_t height) const {
    return runs_north_ ? MeshPoint{across_, along, height} : MeshPoint{along, across_, height};
  }
  MeshPoint beyond(const MeshPoint& p) const {
    const std::int32_t there = side_ - across_;
    return runs_north_ ? MeshPoint{there, p.y, p.height} : MeshPoint{p.x, there, p.height};
  }

  /// Beyond the edge at `along` no sample of the next row has data: the mesh ends there, for triangles cover none at the finest
  /// level.
  bool is_rim(std::int32_t along) const {
    const auto edge = edge_at(along);
    if (!edge) return false;
    for (std::int32_t at = edge->first.first; at <= edge->second.first; ++at) {
      if (sample(at, across_ == 0 ? -1 : 1) != proto::kNoHeight) return false;
    }
    return true;
  }
  /// Samples that have to become vertices with the one at `along`, for no edge to be farther from a sample than the edge that is
  /// there now. None where there is no such edge or something has no data.
  std::vector<MeshPoint> needed(std::int32_t along, std::int32_t step) const {
    const auto edge = edge_at(along);
    if (!edge) return {};
    const auto& [from, to] = *edge;
    for (std::int32_t at = from.first; at <= to.first; ++at) {
      if (sample(at) == proto::kNoHeight) return {};
    }
    if (from.second == proto::kNoHeight || to.second == proto::kNoHeight) return {};
    const double allowed = std::max(farthest(from, to).distance, 0.5 * step);
    std::vector<MeshPoint> out;
    std::vector<std::pair<Vertex, Vertex>> open;
    const auto cut = [&](const Vertex& a, const Vertex& b, std::int32_t at) {
      const Vertex middle{at, gpu::rounded_height(sample(at), step)};
      out.push_back(point(middle.first, middle.second));
      open.emplace_back(a, middle);
      open.emplace_back(middle, b);
    };
    cut(from, to, along);
    while (!open.empty()) {
      const auto [a, b] = open.back();
      open.pop_back();
      if (const Far far = farthest(a, b); far.distance > allowed) cut(a, b, far.along);
    }
    return out;
  }

 private:
  using Vertex = std::pair<std::int32_t, std::int32_t>;  ///< place along the line, height
  struct Far {
    double distance = 0;  ///< in height steps
    std::int32_t along = 0;
  };
  /// The vertices around `along`, which is none.
  std::optional<std::pair<Vertex, Vertex>> edge_at(std::int32_t along) const {
    const auto end = std::lower_bound(vertices_.position.begin(), vertices_.position.end(), along);
    if (end == vertices_.position.begin() || end == vertices_.position.end() || *end == along) return std::nullopt;
    const auto k = static_cast<std::size_t>(end - vertices_.position.begin());
    const auto vertex = [&](std::size_t at) { return Vertex{vertices_.position[at], vertices_.height[at]}; };
    return std::pair{vertex(k - 1), vertex(k)};
  }
  /// The sample between two vertices that is farthest from the line between them.
  Far farthest(const Vertex& a, const Vertex& b) const {
    Far far;
    for (std::int32_t at = a.first + 1; at < b.first; ++at) {
      const double line = a.second + static_cast<double>(b.second - a.second) * (at - a.first) / (b.first - a.first);
      if (const double distance = std::abs(sample(at) - line); distance > far.distance) far = {distance, at};
    }
    return far;
  }
  std::int32_t sample(std::int32_t along, std::int32_t beyond = 0) const {
    const std::int64_t across = std::int64_t{across_} + beyond;
    const std::int64_t east = runs_north_ ? across : along, north = runs_north_ ? along : across;
    return sample_at(samples_, lattice_, lattice_.west(tile_) + east, lattice_.south(tile_) + north);
  }

  const proto::Samples& samples_;
  const proto::Lattice& lattice_;
  const proto::TileAddress tile_;
  const std::int32_t side_;
  const bool runs_north_;
  const std::int32_t across_;  ///< of the line: 0 or side
  const Chain vertices_;
};

/// All of them, or none.
bool split_all(proto::TileMesh& mesh, const std::vector<MeshPoint>& points) {
  return std::all_of(points.begin(), points.end(), [&](const MeshPoint& p) { return gpu::split_side(mesh, p); });
}

}  // namespace

std::map<std::size_t, BuiltTile> put_on_sides(const LevelContext& context, std::vector<BuiltTile>& tiles,
                                              const std::vector<std::vector<MeshPoint>>& on_sides) {
  std::map<proto::TileAddress, std::size_t> at;
  for (std::size_t k = 0; k < tiles.size(); ++k) at.emplace(tiles[k].tile, k);
  const std::int32_t step = height_step(*context.level);
  std::map<std::size_t, BuiltTile> before;
  for (std::size_t k = 0; k < tiles.size(); ++k) {
    for (const MeshPoint& p : on_sides[k]) {
      const SideLine line(context, tiles[k], p);
      const std::int32_t along = line.runs_north() ? p.y : p.x;
      const std::vector<MeshPoint> points = line.needed(along, step);
      if (points.empty()) continue;
      std::vector<std::pair<std::size_t, std::vector<MeshPoint>>> wanted{{k, points}};  // by tile
      if (!line.is_rim(along)) {
        const auto other = at.find(line.tile_beyond());
        if (other == at.end()) continue;
        const SideLine same(context, tiles[other->second], line.beyond(p));
        if (!(same.vertices() == line.vertices())) continue;
        std::vector<MeshPoint>& there = wanted.emplace_back(other->second, std::vector<MeshPoint>()).second;
        for (const MeshPoint& q : points) there.push_back(line.beyond(q));
      }
      std::vector<proto::TileMesh> cut;
      for (const auto& [tile, its_points] : wanted) cut.push_back(tiles[tile].mesh);
      bool all = true;
      for (std::size_t n = 0; n < cut.size(); ++n) all = all && split_all(cut[n], wanted[n].second);
      for (std::size_t n = 0; n < cut.size() && all; ++n) {
        const std::size_t tile = wanted[n].first;
        before.try_emplace(tile, tiles[tile]);
        tiles[tile].mesh = std::move(cut[n]);
      }
    }
  }
  return before;
}

void finish_with_sides(const LevelContext& context, std::vector<BuiltTile>& tiles, Workers& workers, const FinishTile& finish,
                       Workers::Haste haste) {
  std::vector<std::vector<MeshPoint>> on_sides(tiles.size());
  workers.each(
      tiles.size(), [&](std::size_t k, unsigned worker) { on_sides[k] = finish(k, worker); }, haste);
  for (int round = 0; round < kMostSideRounds; ++round) {
    const std::map<std::size_t, BuiltTile> before = put_on_sides(context, tiles, on_sides);
    if (before.empty()) return;
    std::vector<std::size_t> changed;
    for (const auto& [k, tile] : before) changed.push_back(k);
    const auto finish_again = [&] {
      workers.each(
          changed.size(), [&](std::size_t k, unsigned worker) { on_sides[changed[k]] = finish(changed[k], worker); }, haste);
    };
    finish_again();
    const bool is_worse = std::any_of(before.begin(), before.end(), [&](const auto& was) {
      return tiles[was.first].max_error_m > std::max(context.level->target(), was.second.max_error_m);
    });
    if (!is_worse) continue;
    for (const auto& [k, tile] : before) tiles[k] = tile;
    finish_again();
    return;
  }
}

}  // namespace cordillera::pipeline
