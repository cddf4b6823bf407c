#pragma once
// Cuts the tiles of a batch into windows: a quadtree over each tile, split until a leaf holds at most kWindowVertices, so that
// windows are as small as dense terrain needs and as large as plain terrain allows. All tiles at once, level by level; a level is
// a count of the vertices in its nodes. Nothing but the number of nodes leaves the device.
#include <cstdint>
#include <span>

#include "gpu/device/atomic.h"
#include "gpu/waves/collapse/batch_tile.h"
#include "gpu/waves/collapse/window_pass.h"

namespace cordillera::gpu {

struct QuadBox {
  std::int64_t west = 0, south = 0, size = 0;

  CORDILLERA_HD unsigned quarter(std::int32_t x, std::int32_t y) const {
    return (x >= west + size / 2 ? 1u : 0u) | (y >= south + size / 2 ? 2u : 0u);
  }
  CORDILLERA_HD QuadBox child(unsigned quarter) const {
    const std::int64_t half = size / 2;
    return {quarter & 1 ? west + half : west, quarter & 2 ? south + half : south, size - half};
  }
};

/// Pass 0 is aligned with the tile; passes 1 and 2 are shifted by one and two thirds of it, so that at every leaf size no seam of
/// one pass is a seam of another.
CORDILLERA_HD inline QuadBox root_box(std::int32_t side, int pass) {
  const std::int64_t shift = std::int64_t{side} * (3 - pass % 3) / 3;
  return pass == 0 ? QuadBox{0, 0, side} : QuadBox{-shift, -shift, 2 * std::int64_t{side}};
}

struct QuadNode {
  enum : std::uint32_t { kLeaf = 0, kAsleep = 0xffffffffu };

  QuadBox box;
  std::uint32_t tile = 0;
  std::uint32_t count = 0;      ///< vertices
  std::uint32_t child = kLeaf;  ///< the first of four; kAsleep: the root of a tile that is done

  CORDILLERA_HD bool is_split() const { return child != kLeaf && child != kAsleep; }
  CORDILLERA_HD bool is_window() const { return child == kLeaf && count > 0; }
};

struct TileProgress {
  std::uint32_t alive = 0;  ///< vertices before the last pass
  std::uint32_t done = 0;
};

struct CutFacts {
  std::uint32_t nodes = 0;
  std::uint32_t in_work = 0;  ///< vertices of tiles that are not done
};

/// What a cut reads and writes; nodes 0 .. tiles - 1 are the roots.
struct CutArrays {
  MeshView mesh;
  TileFinder tiles;
  const std::uint32_t* vertices = nullptr;  ///< of the batch, ascending
  std::uint32_t count = 0;
  QuadNode* nodes = nullptr;
  std::uint32_t* node_of = nullptr;      ///< indexed like vertices
  std::uint32_t* node_counts = nullptr;  ///< indexed by node: vertices that belong to no child of it
  TileProgress* progress = nullptr;      ///< indexed by tile
  CutFacts* facts = nullptr;
};

struct PlantRoot {
  CutArrays cut;
  int pass;
  CORDILLERA_HD void operator()(std::size_t t) const {
    cut.nodes[t] = {root_box(cut.tiles.tiles[t].side, pass), static_cast<std::uint32_t>(t), 0, QuadNode::kLeaf};
    if (pass == 0) cut.progress[t] = {};
    if (t == 0) *cut.facts = {static_cast<std::uint32_t>(cut.tiles.count), 0};
  }
};

struct EnterRoot {
  CutArrays cut;
  CORDILLERA_HD void operator()(std::size_t i) const {
    cut.node_of[i] = cut.tiles.of(cut.vertices[i]);
    count_one(&cut.nodes[cut.node_of[i]].count);
  }
};

/// Plain terrain goes on while passes still pay; a rule of the tile alone, whatever it is batched with.
struct WakeTile {
  CutArrays cut;
  bool may_sleep;
  CORDILLERA_HD void operator()(std::size_t t) const {
    QuadNode& root = cut.nodes[t];
    TileProgress& progress = cut.progress[t];
    if (may_sleep && 6 * std::uint64_t{root.count} > 5 * std::uint64_t{progress.alive}) progress.done = 1;
    if (progress.done)
      root.child = QuadNode::kAsleep;
    else
      fetch_add(&cut.facts->in_work, root.count);
    progress.alive = root.count;
  }
};

/// The four children of a node that is too full take the next places, in no particular order.
struct SplitNode {
  CutArrays cut;
  std::uint32_t from;
  CORDILLERA_HD void operator()(std::size_t i) const {
    QuadNode& node = cut.nodes[from + i];
    if (!node.is_window() || node.count <= kWindowVertices || node.box.size <= 1) return;
    node.child = fetch_add(&cut.facts->nodes, 4);
    for (unsigned q = 0; q < 4; ++q) cut.nodes[node.child + q] = {node.box.child(q), node.tile, 0, QuadNode::kLeaf};
  }
};

struct Descend {
  CutArrays cut;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const QuadNode& node = cut.nodes[cut.node_of[i]];
    if (!node.is_split()) return;
    const std::uint32_t v = cut.vertices[i];
    cut.node_of[i] = node.child + node.box.quarter(cut.mesh.x[v], cut.mesh.y[v]);
    count_one(&cut.nodes[cut.node_of[i]].count);
  }
};

struct CountNode {
  CutArrays cut;
  CORDILLERA_HD void operator()(std::size_t k) const { cut.node_counts[k] = cut.nodes[k].is_split() ? 0 : cut.nodes[k].count; }
};

struct NameWindow {
  CutArrays cut;
  CORDILLERA_HD void operator()(std::size_t i) const { cut.mesh.window[cut.vertices[i]] = cut.node_of[i]; }
};

struct CutTiles {
  CutArrays cut;
  int pass;
  bool may_sleep;

  template <class Team>
  CORDILLERA_HD void operator()(Team& team) const {
    team.each(cut.tiles.count, PlantRoot{cut, pass});
    team.barrier();
    team.each(cut.count, EnterRoot{cut});
    team.barrier();
    team.each(cut.tiles.count, WakeTile{cut, may_sleep});
    std::uint32_t from = 0, to = static_cast<std::uint32_t>(cut.tiles.count);
    while (from < to) {
      team.barrier();
      team.each(to - from, SplitNode{cut, from});
      team.barrier();
      from = to;
      to = cut.facts->nodes;
      if (from < to) team.each(cut.count, Descend{cut});
    }
    team.each(to, CountNode{cut});
    team.each(cut.count, NameWindow{cut});
  }
};

/// The windows of a pass.
struct WindowCut {
  const QuadNode* nodes = nullptr;       ///< window k is node k, if it is one
  const std::uint32_t* first = nullptr;  ///< indexed by node
  const std::uint32_t* order = nullptr;  ///< vertices, window by window from first[k]; ascending within a window
  float* outer = nullptr;                ///< kOuterFloats a vertex, for the windows' use
  std::uint32_t count = 0;               ///< nodes
  std::uint32_t in_work = 0;             ///< vertices in windows

  CORDILLERA_HD WindowRange window(std::uint32_t k) const {
    return {order + first[k], outer + kOuterFloats * first[k], nodes[k].count, k, nodes[k].box.size <= kExactUnits};
  }
};

template <class Device>
class WindowCutter {
 public:
  /// vertices: the ones to cut, ascending. Writes mesh.window. From pass `passes` on, tiles at which the last pass took little
  /// are done.
  WindowCut cut(Device& device, const MeshView& mesh, const TileFinder& tiles, std::span<const std::uint32_t> vertices, int pass,
                int passes) {
    const std::size_t n = vertices.size();
    // A level has at most n / kWindowVertices nodes that are too full, and a box of 2^31 has 31 levels.
    const std::size_t most = tiles.count + 31 * 4 * (n / kWindowVertices);
    nodes_.reserve(most);
    node_counts_.reserve(most);
    first_.reserve(most);
    node_of_.reserve(n);
    order_.reserve(n);
    outer_.reserve(kOuterFloats * n);
    progress_.reserve(tiles.count);
    facts_.reserve(1);
    const CutArrays arrays{mesh,          tiles,           vertices.data(),     static_cast<std::uint32_t>(n),
                           nodes_.data(), node_of_.data(), node_counts_.data(), progress_.data(),
                           facts_.data()};
    device.cooperate(n, CutTiles{arrays, pass, pass >= passes});
    CutFacts facts;
    device.copy_out(&facts, facts_.data(), 1);
    device.exclusive_sum(node_counts_.data(), first_.data(), facts.nodes);
    device.group(vertices, node_of_.data(), {first_.data(), facts.nodes}, order_.data());
    return {nodes_.data(), first_.data(), order_.data(), outer_.data(), facts.nodes, facts.in_work};
  }

 private:
  template <class T>
  using Array = typename Device::template Array<T>;
  Array<QuadNode> nodes_;
  Array<std::uint32_t> node_of_, order_, node_counts_, first_;
  Array<TileProgress> progress_;
  Array<CutFacts> facts_;
  Array<float> outer_;
};

}  // namespace cordillera::gpu
