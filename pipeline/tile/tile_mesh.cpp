#include "pipeline/tile/tile_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <stdexcept>
#include <tuple>

#include "gpu/measure/surface_memory.h"
#include "gpu/mesh/rings.h"
#include "gpu/refine/height_step.h"
#include "pipeline/bound/cover.h"
#include "pipeline/bound/loose.h"
#include "pipeline/bound/overlay.h"
#include "pipeline/plan/plan.h"
#include "pipeline/tile/border.h"
#include "pipeline/tile/chain.h"
#include "pipeline/tile/moved.h"
#include "pipeline/tile/support.h"
#include "pipeline/tile/tile_error.h"
#include "pipeline/tile/to_void.h"
#include "pipeline/tile/weld.h"

namespace cordillera::pipeline {
namespace {

constexpr std::array kSides{Side::west, Side::east, Side::south, Side::north};
constexpr int kAttempts = 20;              // to empty the border of what its chain dropped
constexpr std::int64_t kVoidGapCells = 8;  // between void vertices of a border
// Between vertices of a pole's row, of the level's cells. Each must have triangles of its own, and they fill up the vertices
// around the pole: with one a cell, needles were left between these that no edge could part. With one in 32, single ones were
// left.
constexpr std::int64_t kPoleGapCells = 16;
// Of these, how many make the inside denser. Where that does not help, corners are full of it: the others make it sparser, rims
// too, and refinement puts back what the promise needs.
constexpr int kCarefulAttempts = 6;
constexpr int kSparseAttempts = 2;  // with a sparse start
// Of the target, for what a promised tile's start may leave out. Measured on ten elevation models: a half takes 0 to 15 % less
// processor time than a quarter for the same triangles (0.5 % fewer to 0.1 % more), and a GPU a sixth less; the RMSE is 0 to 3 %
// greater.
constexpr double kSparseShare = 1.0 / 2;
// Where the tile has voids: with a quarter, levels above left out twice as much along ragged rims, and a promise was broken
// there.
constexpr double kRimSparseShare = 1.0 / 8;
constexpr double kMoreCaution = 1.5;     // from one of these to the next: a denser inside has more for the border to hold on to
constexpr std::size_t kMostHelped = 16;  // of samples left uncovered, what is kept around before another attempt
constexpr int kPromiseAttempts = 6;      // to keep a promise that refinement could not
// Where nothing but triangles upside down is left, away from poles: what helps them helps soon. Twelve attempts more at two tiles
// of a coast range took an eighth of its build, and turned one triangle of three.
constexpr int kUprightAttempts = 2;
// Of the error left to a collapse. What it sees, added up from collapse to collapse, is more than the error: refinement repairs
// the few places where it is not, and so tiles get a quarter of the triangles that a cautious guard would leave.
constexpr double kGuardShare = 2;

/// Heights minus the sag of the ellipsoid relative to the tile's centre, so that a flat sea costs what its curvature costs.
/// Second order is enough: it steers the collapse only; errors are measured exactly.
std::vector<float> elevations(const proto::Lattice& lattice, const proto::TileAddress& tile, const proto::TileMesh& mesh) {
  const double radians = lattice.cell_deg() * std::numbers::pi / 180;
  const double middle = mesh.side / 2.0;
  const proto::RowFrame row = proto::row_frame(lattice, lattice.south(tile) + mesh.side / 2);
  const double along_column = proto::kSemiMajor_m * radians * radians / 2;
  const double along_row = along_column * row.cos_lat * row.cos_lat;
  std::vector<float> elevation(mesh.vertices());
  for (std::size_t v = 0; v < elevation.size(); ++v) {
    const double dx = mesh.x[v] - middle, dy = mesh.y[v] - middle;
    elevation[v] = static_cast<float>(mesh.height[v] * proto::kHeightStep_m - along_row * dx * dx - along_column * dy * dy);
  }
  return elevation;
}

std::int32_t void_gap(const LevelContext& context, int level) {
  return static_cast<std::int32_t>(kVoidGapCells * context.lattice->cell_units(level));
}

ChainRule chain_rule(const LevelContext& context) {
  ChainRule rule;
  rule.tolerance_m = context.level->chain_tolerance();
  rule.rim_units = static_cast<std::int32_t>(context.level->rim_tolerance());
  rule.void_gap_units = void_gap(context, static_cast<int>(context.level->level()));
  rule.pole_gap_units =
      static_cast<std::int32_t>(kPoleGapCells * context.lattice->cell_units(static_cast<int>(context.level->level())));
  return rule;
}

/// Positions first .. first + count - 1 of an edge.
struct Stretch {
  std::int64_t first = 0, count = 0;
};
Stretch whole(const Edge& edge) { return {0, edge.units + 1}; }

/// The stretch of an edge that the samples can cover: a coarse edge may be a thousand times as long as the data.
Stretch covered(const proto::Samples& samples, const proto::Lattice& lattice, const Edge& edge) {
  std::int64_t from = edge.along == Along::east ? samples.west - edge.column : samples.south - edge.row;
  const std::int64_t length = edge.along == Along::east ? samples.columns : samples.rows;
  if (edge.along == Along::east) {
    while (from > edge.units) from -= lattice.columns();
    while (from + length <= 0) from += lattice.columns();
  }
  const std::int64_t first = std::max<std::int64_t>(from, 0);
  return {first, std::max<std::int64_t>(std::min(from + length, edge.units + 1) - first, 0)};
}

/// Finest samples along a stretch of an edge; columns are modulo the circle, outside the window there is no data.
std::vector<std::int32_t> edge_samples(const proto::Lattice& lattice, const proto::Samples& samples, const Edge& edge,
                                       const Stretch& at) {
  std::vector<std::int32_t> heights(static_cast<std::size_t>(at.count), proto::kNoHeight);
  for (std::int64_t k = 0; k < at.count; ++k) {
    const std::int64_t j = edge.row + (edge.along == Along::north ? at.first + k : 0);
    std::int64_t i = edge.column + (edge.along == Along::east ? at.first + k : 0);
    while (i < samples.west) i += lattice.columns();
    while (i - lattice.columns() >= samples.west) i -= lattice.columns();
    if (j < samples.south || j >= samples.south + samples.rows || i >= samples.west + samples.columns) continue;
    heights[static_cast<std::size_t>(k)] = samples.at(i, j);
  }
  return heights;
}

/// The edge's samples, and lines at doubling distances up to one cell of the level on both sides.
struct EdgeLines {
  std::vector<std::int32_t> edge;
  std::vector<EdgeHeights::Line> beside;
  std::vector<std::int32_t> to_void;
  std::int64_t cell, reach;
  Stretch stretch;

  EdgeLines(const LevelContext& context, const Edge& at, const Stretch& where)
      : edge(edge_samples(*context.lattice, *context.samples, at, where)),
        cell(context.lattice->cell_units(static_cast<int>(context.level->level()))),
        reach(std::max(context.rim_reach, 2 * cell)),
        stretch(where) {
    for (std::int64_t distance = 1; distance <= cell; distance *= 2) {
      for (const std::int64_t offset : {-distance, distance}) {
        Edge line = at;
        (at.along == Along::east ? line.row : line.column) += offset;
        beside.push_back({offset, edge_samples(*context.lattice, *context.samples, line, where)});
      }
    }
    to_void = distances_to_void(*context.samples, at, where.first, where.count, reach);
  }
  EdgeHeights heights() const {
    EdgeHeights all(edge);
    all.first = stretch.first;
    all.beside = beside;
    all.to_void = to_void;
    all.cell = cell;
    all.reach = reach;
    return all;
  }
};

void must(const proto::Result<void>& result) {
  if (!result.ok()) throw std::logic_error("tile mesh: " + result.problem().detail);
}

void apply_chains(const LevelContext& context, PreparedTile& prepared, bool finest) {
  const ChainRule rule = chain_rule(context);
  for (const Side side : kSides) {
    const Edge edge = edge_of(*context.lattice, prepared.tile, side);
    std::optional<EdgeLines> lines;
    if (context.samples) lines.emplace(context, edge, finest ? whole(edge) : covered(*context.samples, *context.lattice, edge));
    const EdgeHeights heights = lines ? lines->heights() : EdgeHeights{};
    const Chain chain =
        finest ? chain_finest(edge, heights, rule) : simplify_chain(edge, border_chain(prepared.input, side), heights, rule);
    must(apply_chain(prepared.input, side, chain));
  }
}

}  // namespace

gpu::SimplifyJob PreparedTile::job(const LevelContext& context) const {
  gpu::SimplifyJob job;
  job.input = &input;
  job.elevation = elevation;
  job.cell_units = static_cast<float>(context.lattice->cell_units(tile.z));
  job.unit_m = static_cast<float>(proto::kSemiMajor_m * std::numbers::pi / static_cast<double>(context.lattice->rows()));
  job.tolerance_m = static_cast<float>(context.level->target() / caution);
  // Children that left too little must not make the guard keep all: then the promise would be no nearer, on this level and all
  // above.
  const double left = std::max(context.level->target() - inherited_error_m, kLeastStepShare * context.level->target());
  if (context.promise) job.guard_m = static_cast<float>(kGuardShare * left / caution);
  job.rim_units = static_cast<float>(context.level->rim_tolerance() * rim_share);
  job.start_tolerance_m = start_tolerance_m;
  return job;
}

std::optional<PreparedTile> prepare_finest(const LevelContext& context, const proto::TileAddress& tile) {
  const proto::Lattice& lattice = *context.lattice;
  const proto::Samples& samples = *context.samples;
  constexpr std::int32_t kAcross = proto::kTileCells + 1;
  std::vector<std::int32_t> heights(static_cast<std::size_t>(kAcross) * kAcross, proto::kNoHeight);
  bool any = false;
  Edge row{&lattice, lattice.west(tile), lattice.south(tile), Along::east, proto::kTileCells};
  for (std::int32_t r = 0; r < kAcross; ++r, ++row.row) {
    const std::vector<std::int32_t> line = edge_samples(lattice, samples, row, whole(row));
    std::copy(line.begin(), line.end(), heights.begin() + static_cast<std::ptrdiff_t>(r) * kAcross);
    any = any || std::any_of(line.begin(), line.end(), [](std::int32_t h) { return h != proto::kNoHeight; });
  }
  if (!any) return std::nullopt;
  PreparedTile prepared{tile, gpu::grid_mesh(proto::kTileCells, 1, heights), {}};
  prepared.elevation = elevations(lattice, tile, prepared.input);
  apply_chains(context, prepared, true);
  // At a pole a cell is a sliver in space: halves of squares are nothing there, and their chords leave what is measured of them.
  if (context.promise && context.sparse_start && !is_at_pole(tile)) {
    const bool rims = std::find(heights.begin(), heights.end(), proto::kNoHeight) != heights.end();
    prepared.start_tolerance_m = static_cast<float>((rims ? kRimSparseShare : kSparseShare) * context.level->target());
  }
  return prepared;
}

namespace {

/// Meshes of a tile's children as one. level: of which they are made.
proto::TileMesh welded(const LevelContext& context, const proto::TileAddress& tile,
                       const std::array<const proto::TileMesh*, 4>& children, int level) {
  WeldInput input;
  input.children = children;
  input.child_side = static_cast<std::int32_t>(context.lattice->tile_units(tile.z + 1));
  const Chain empty = void_chain(input.child_side, void_gap(context, level));
  for (std::size_t c = 0; c < 4; ++c)
    if (!children[c]) input.outer[c].fill(&empty);
  proto::Result<proto::TileMesh> mesh = weld(input);
  if (!mesh.ok()) throw std::logic_error("weld: " + mesh.problem().detail);
  return std::move(*mesh);
}

/// What the tile is measured against where samples are out of reach. A surface whose own error is half of the target would leave
/// the other half to a mesh that is as rough as that: hardly a vertex could go. Two levels finer it is a quarter.
Surface truth_above(const LevelContext& context, const proto::TileAddress& tile,
                    const std::array<const BuiltTile*, 4>& children) {
  const bool finer = std::all_of(children.begin(), children.end(), [](const BuiltTile* child) { return !child || child->finer; });
  std::array<const proto::TileMesh*, 4> meshes{};
  std::array<const Loose*, 4> loose{};
  Surface truth;
  for (std::size_t c = 0; c < 4; ++c) {
    if (!children[c]) continue;
    meshes[c] = finer ? &children[c]->finer->mesh : &children[c]->mesh;
    loose[c] = finer ? &children[c]->finer->loose : &children[c]->loose;
    truth.max_error_m = std::max(truth.max_error_m, finer ? children[c]->finer->max_error_m : children[c]->max_error_m);
  }
  truth.mesh = welded(context, tile, meshes, tile.z + (finer ? 2 : 1));
  truth.loose = joined(loose, truth.mesh.side / 2);
  for (const std::uint32_t v : marked_over_void(meshes, truth.mesh)) truth.mesh.mark[v] |= kOverVoid;
  return truth;
}

}  // namespace

std::optional<PreparedTile> prepare_parent(const LevelContext& context, const proto::TileAddress& tile,
                                           const std::array<const BuiltTile*, 4>& children) {
  std::array<const proto::TileMesh*, 4> meshes{};
  std::array<const Loose*, 4> loose{};
  double inherited = 0;
  std::uint32_t uncovered = 0;
  for (std::size_t c = 0; c < 4; ++c) {
    if (!children[c]) continue;
    meshes[c] = &children[c]->mesh;
    loose[c] = &children[c]->loose;
    inherited = std::max(inherited, children[c]->max_error_m);
    uncovered += children[c]->measured.uncovered;
  }
  if (std::all_of(meshes.begin(), meshes.end(), [](const proto::TileMesh* mesh) { return !mesh; })) return std::nullopt;
  PreparedTile prepared{tile, welded(context, tile, meshes, tile.z + 1), {}, inherited, uncovered};
  prepared.elevation = elevations(*context.lattice, tile, prepared.input);
  apply_chains(context, prepared, false);
  if (context.samples) return prepared;
  prepared.inherited_loose = joined(loose, prepared.input.side / 2);
  prepared.over_void = marked_over_void(meshes, prepared.input);
  prepared.truth = truth_above(context, tile, children);
  return prepared;
}

namespace {

/// Twice the published area, in units.
std::int64_t published_area2(const proto::TileMesh& mesh) {
  const auto at = [&](std::uint32_t v) { return gpu::MeshPoint{mesh.x[v], mesh.y[v], 0}; };
  std::int64_t area2 = 0;
  for (const auto& t : mesh.triangles)
    if (is_published(mesh, t)) area2 += gpu::twice_area(at(t[0]), at(t[1]), at(t[2]));
  return area2;
}

/// Small data in a large tile would vanish within what rims may move: then they move less. But where its border needs them to
/// move as far, the border goes before it.
bool has_vanished(PreparedTile& prepared, const proto::TileMesh& mesh, int attempt) {
  constexpr double kLeastShare = 1e-4;
  if (attempt > kCarefulAttempts) return false;
  if (prepared.rim_share < kLeastShare || published_area2(mesh) > 0 || published_area2(prepared.input) == 0) return false;
  prepared.rim_share /= 8;
  return true;
}

/// A sparse start may lack the vertex that a border or a promise needs: all of them from now on.
bool made_dense(PreparedTile& prepared, int attempt) {
  if (prepared.start_tolerance_m == 0 || attempt < kSparseAttempts) return false;
  prepared.start_tolerance_m = 0;
  return true;
}

/// What earlier attempts kept may go.
void release_inside(proto::TileMesh& mesh) {
  for (std::uint32_t v = 0; v < mesh.vertices(); ++v)
    if (gpu::sides_of(mesh, v) == 0) mesh.mark[v] &= static_cast<std::uint8_t>(~proto::kKeep);
}

}  // namespace

bool has_its_border(const LevelContext& context, PreparedTile& prepared, const proto::TileMesh& mesh, int attempt) {
  const auto cell = static_cast<std::int32_t>(context.lattice->cell_units(prepared.tile.z));
  if (keep_support(prepared.input, mesh, cell, attempt) == 0) return true;
  if (attempt >= kAttempts && !prepared.best)
    throw std::logic_error("tile mesh: border vertices of " + std::to_string(prepared.tile.z) + "/" +
                           std::to_string(prepared.tile.x) + "/" + std::to_string(prepared.tile.y) + " could not be removed");
  if (made_dense(prepared, attempt)) return false;
  if (attempt < kCarefulAttempts) {
    prepared.caution *= kMoreCaution;
  } else {
    release_inside(prepared.input);
    // Of less than a height's step, where a share of nearly all ends, no doubling makes anything sparser.
    const double of_a_step = std::min(context.level->target() / proto::kHeightStep_m, 1.0);
    prepared.caution = of_a_step * std::exp2(kCarefulAttempts - attempt - 1);
    prepared.rim_share *= 2;
  }
  return false;
}

namespace {

/// The border of two neighbours is rounded alike: its vertices are the same samples, or the same children's.
void round_heights(const LevelContext& context, proto::TileMesh& mesh) {
  const std::int32_t step = height_step(*context.level);
  for (std::size_t v = 0; v < mesh.vertices(); ++v)
    if (!is_void(mesh, v)) mesh.height[v] = gpu::rounded_height(mesh.height[v], step);
}

/// Where the samples are at hand; few tiles leave any uncovered at all.
std::vector<gpu::MeshPoint> bare_samples(const LevelContext& context, const BuiltTile& built) {
  if (!context.samples || built.measured.uncovered == 0) return {};
  return uncovered_inside(*context.lattice, built.tile, built.mesh, *context.samples,
                          part_in_window(*context.lattice, built.tile, *context.samples));
}

std::optional<BuiltTile> judge(const LevelContext& context, PreparedTile& prepared, proto::TileMesh mesh, int attempt) {
  if (!has_its_border(context, prepared, mesh, attempt)) {
    // What is the best so far broke the promise, or there would be no further attempt: others may keep it.
    if (attempt < kPromiseAttempts) return std::nullopt;
    return std::move(prepared.best);
  }
  if (has_vanished(prepared, mesh, attempt)) return std::nullopt;
  settle_moved(context, prepared, mesh);
  round_heights(context, mesh);
  BuiltTile built;
  built.tile = prepared.tile;
  built.mesh = std::move(mesh);
  if (!context.measured) return built;
  const double limit_m = context.promise ? context.level->target() : INFINITY;
  gpu::SurfaceMemory memory;
  const std::vector<std::uint32_t> over =
      context.samples ? measure(context, built, memory) : compose(context, prepared, built, limit_m);
  const std::vector<gpu::MeshPoint> bare = bare_samples(context, built);
  built.bare = bare.size();
  // Refinement leaves hardly anything: where valences or slivers gave it no room, another mesh will.
  const bool only_turned = over.size() == built.turned && bare.empty() && !is_at_pole(built.tile);
  const bool broken = (!over.empty() || !bare.empty()) && attempt < (only_turned ? kUprightAttempts : kPromiseAttempts);
  if (broken) {
    made_dense(prepared, attempt);
    for (const std::uint32_t k : over) keep_around(prepared.input, built.mesh, k, std::size_t{8} << attempt);
    for (std::size_t k = 0; k < bare.size(); k += bare.size() / kMostHelped + 1)
      keep_near(prepared.input, bare[k].x, bare[k].y, std::size_t{8} << attempt);
  }
  const auto faults = [&](const BuiltTile& tile) {
    return std::tuple(tile.max_error_m > limit_m, tile.turned + tile.bare, tile.max_error_m);
  };
  if (!prepared.best || faults(built) < faults(*prepared.best)) prepared.best = std::move(built);
  if (broken) return std::nullopt;
  return std::move(prepared.best);
}

}  // namespace

std::optional<BuiltTile> finish(const LevelContext& context, PreparedTile& prepared, proto::TileMesh mesh, int attempt) {
  std::optional<BuiltTile> built = judge(context, prepared, std::move(mesh), attempt);
  if (built && (context.merges_above || !context.samples)) hand_up(context, prepared, *built);
  return built;
}

BuiltTile complete(const LevelContext& context, PreparedTile& prepared, gpu::Simplifier& simplifier) {
  for (int attempt = 0;; ++attempt) {
    const gpu::SimplifyJob job = prepared.job(context);
    std::vector<proto::TileMesh> meshes = simplifier.simplify({&job, 1});
    std::optional<BuiltTile> built = finish(context, prepared, std::move(meshes.front()), attempt);
    if (built) return std::move(*built);
  }
}

}  // namespace cordillera::pipeline
