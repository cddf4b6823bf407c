#include "pipeline/build/exact_build.h"

#include <algorithm>
#include <cmath>
#include <future>
#include <numeric>
#include <optional>
#include <set>

#include "gpu/measure/sample_frames.h"
#include "gpu/measure/surface_memory.h"
#include "pipeline/build/exact/error_statement.h"
#include "pipeline/build/exact/kept_block.h"
#include "pipeline/build/tile_output.h"
#include "pipeline/finest/pixel_error.h"
#include "pipeline/finest/side_vertices.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/plan.h"
#include "pipeline/tile/tile_error.h"

namespace cordillera::pipeline {
namespace {

using gpu::exact::BlockMesh;

/// A level above its target is made again with less: where steep walls meet rounded points.
constexpr int kMostRuns = 3;
constexpr double kTakenOff = 1.5, kMoreCareful = 0.998;  // of what it is above; of its tolerance

/// Tiles of a level, encoded, and how far the worst is above its target.
struct EncodedLevel {
  std::vector<EncodedTile> tiles;
  std::vector<EncodedTile> lost;  ///< records of tiles with data and without triangles
  double above_m = 0;
};

class BlockBuild {
 public:
  BlockBuild(const proto::Plan& plan, const proto::TileAddress& node, const BlockPlace& place, const proto::Samples& samples,
             const BlockReaders& team)
      : plan_(plan),
        node_(node),
        lattice_(lattice_of(plan)),
        samples_(samples),
        team_(team),
        place_(place),
        curve_(curve_of(plan, place_)),
        frames_(lattice_, samples),
        counts_(lattice_, samples, team.workers, Workers::Haste::somebody_waits),  // the simplifier does
        asked_(levels_of_block(plan, node.z, place, samples)),
        merged_above_(place.merged_above) {
    if (merged_above_) asked_.known_reach = most_rim_reach(plan);
  }

  proto::Result<FinishedTask> run(ExactSimplifiers& simplifiers, const std::function<void(double)>& share) {
    std::vector<EncodedLevel> levels;
    for (int run = 1;; ++run) {
      if (const auto made = one_run(simplifiers, share, levels); !made.ok()) return made.problem();
      const std::size_t again = run < kMostRuns ? ask_for_more(levels) : levels.size();
      if (again < levels.size()) {
        levels.resize(again);
        continue;
      }
      FinishedTask task;
      task.node = node_;
      for (EncodedLevel& level : levels) {
        for (auto* const tiles : {&level.tiles, &level.lost})
          std::move(tiles->begin(), tiles->end(), std::back_inserter(task.tiles));
      }
      if (merged_above_) task.mesh = {node_, to_bytes(kept_, code_unit(plan_))};
      return task;
    }
  }

 private:
  /// Levels that are there stay: what they are made of is asked for as before, so their meshes would be the same.
  proto::Result<void> one_run(ExactSimplifiers& simplifiers, const std::function<void(double)>& share,
                              std::vector<EncodedLevel>& levels) {
    const gpu::exact::Block block = block_at(plan_, place_, samples_, curve_);
    std::vector<std::future<EncodedLevel>> under_way;
    const auto take = [&](std::size_t l, BlockMesh&& mesh) {
      if (l == 0) under_way.clear();  // a lost device's
      if (merged_above_ && l + 1 == asked_.levels.size()) kept_.mesh = tile_mesh_of_block(mesh, block.columns - 1);
      if (l < levels.size()) return;
      const int z = lattice_.finest_level - static_cast<int>(l);
      under_way.push_back(std::async(std::launch::async,
                                     [this, &simplifiers, z, kept = std::move(mesh)] { return encoded(simplifiers, z, kept); }));
      share(1 - 0.5 / static_cast<double>(std::size_t{1} << std::min<std::size_t>(l, 20)));
    };
    const bool somebody_waits = team_.finest.haste() == Workers::Haste::somebody_waits;
    const auto keep = [this](gpu::exact::Squares&& squares) { kept_.squares = std::move(squares); };
    const auto made =
        simplifiers.simplify(block, asked_, take, merged_above_ ? ExactSimplifiers::TakeSquares(keep) : nullptr, somebody_waits);
    for (auto& level : under_way) levels.push_back(level.get());
    return made;
  }

  /// What a GPU knows of the tiles' triangles; nothing where there is no GPU, or where they are so few that a call costs more
  /// than it spares. Nor where somebody waits: all threads are there sooner.
  std::vector<gpu::SurfaceMemory> measured(ExactSimplifiers& simplifiers, const LevelContext& context,
                                           const std::vector<BuiltTile>& tiles) {
    constexpr std::size_t kWorthACall = 1 << 11;
    std::vector<gpu::SurfaceErrorInput> inputs;
    std::size_t triangles = 0;
    for (const BuiltTile& tile : tiles) {
      inputs.push_back(surface_input(context, tile));
      triangles += tile.mesh.triangles.size();
    }
    if (triangles < kWorthACall || team_.finest.haste() != Workers::Haste::none) return {};
    return simplifiers.measure(inputs, limit_of(context));
  }

  EncodedLevel encoded(ExactSimplifiers& simplifiers, int z, const BlockMesh& mesh) {
    LevelContext context{&lattice_, &level_plan(plan_, z), &samples_, plan_.promise(), &frames_};
    context.counts = &counts_;
    const bool anew = team_.strategy.is_open();
    std::vector<BuiltTile> tiles = tiles_of_block(plan_, place_, z, mesh, anew ? TileParts::whole : TileParts::published);
    if (anew) simplify_anew(context, tiles);
    std::vector<gpu::SurfaceMemory> memories = anew ? std::vector<gpu::SurfaceMemory>() : measured(simplifiers, context, tiles);
    const bool on_gpu = !memories.empty();
    memories.resize(tiles.size());
    std::vector<double> above(tiles.size());
    std::vector<std::optional<EncodedTile>> made(tiles.size());
    const bool finest = z == lattice_.finest_level, meets = finest && pixels_within_m(plan_) > 0;
    const auto haste = finest ? team_.finest.haste() : Workers::Haste::none;
    const auto finish = [&](std::size_t k, unsigned worker) {
      // A tile that was made anew is measured; one that comes again has other sides.
      const Measure measure = anew && !made[k] ? Measure::changed : Measure::always;
      FinishedFinest finished =
          finest ? finish_finest(plan_, context, tiles[k], team_.pixels(tiles[k].tile, worker), measure, memories[k])
                 : finished_coarser(context, tiles[k], measure, memories[k]);
      above[k] = anew ? 0 : finished.above_m;  // less of the block would change nothing
      made[k] = std::move(finished.tile);
      if (!meets || !on_gpu) memories[k] = {};  // they take more room than the meshes
      if (!meets) tiles[k] = {};
      return std::move(finished.on_sides);
    };
    if (meets)
      finish_with_sides(context, tiles, team_.workers, finish, haste);
    else
      team_.workers.each(tiles.size(), finish, haste);
    tiles.clear();
    EncodedLevel level;
    for (const double a : above) level.above_m = std::max(level.above_m, a);
    level.tiles = without_gaps(made);
    level.lost = lost(z, level.tiles);
    // A level above its target may be made again.
    if (finest && level.above_m == 0 && team_.finest) team_.finest.take(level.tiles);
    return level;
  }

  /// By the published algorithm that is asked for. Tiles without a published triangle go.
  void simplify_anew(const LevelContext& context, std::vector<BuiltTile>& tiles) {
    team_.workers.each(tiles.size(), [&](std::size_t k, unsigned worker) { team_.strategy.simplify(context, tiles[k], worker); });
    std::erase_if(tiles, [](const BuiltTile& tile) { return tile.mesh.triangles.empty(); });
  }

  FinishedFinest finished_coarser(const LevelContext& context, BuiltTile& tile, Measure measure,
                                  gpu::SurfaceMemory& memory) const {
    FinishedFinest finished;
    if (measure == Measure::always) finished.above_m = measure_exact(context, tile, memory);
    finished.tile = encode_tile(context, tile, plan_.options());
    return finished;
  }

  /// Records of the tiles whose data is under no triangle: single samples among voids, and narrow ones.
  std::vector<EncodedTile> lost(int z, const std::vector<EncodedTile>& shown) const {
    std::set<proto::TileAddress> others;
    for (const EncodedTile& tile : shown) others.insert(address_of(tile.record));
    std::vector<EncodedTile> all;
    for (const proto::TileAddress& tile : touched_tiles(plan_, z, node_)) {
      const SampleCount count = others.contains(tile) ? SampleCount() : counts_.of(tile);
      if (count.valid > 0) all.push_back(lost_tile(tile, count));
    }
    if (z < lattice_.finest_level) return all;
    team_.workers.each(all.size(), [&](std::size_t k, unsigned worker) {  // each of which has a source of its own
      proto::TileRecord& record = all[k].record;
      record.mutable_pixels()->set_uncovered(static_cast<std::uint32_t>(team_.pixels(address_of(record), worker).size()));
    });
    return all;
  }

  /// Less is asked of levels above their target the next time, but on sides that other blocks share. The first of them; none: how
  /// many there are.
  std::size_t ask_for_more(const std::vector<EncodedLevel>& levels) {
    std::size_t first = levels.size();
    for (std::size_t l = 0; l < levels.size(); ++l) {
      if (levels[l].above_m == 0) continue;
      gpu::exact::BlockLevel& level = asked_.levels[l];
      const double floor_m =
          std::max({0.5 * level.tolerance_m, 4 * level.height_step * proto::kHeightStep_m, l > 0 ? least_above(l) : 0.0});
      const double less_m = std::max(level.tolerance_m * kMoreCareful - kTakenOff * levels[l].above_m, floor_m);
      if (level.side_tolerance_m == 0) level.side_tolerance_m = level.tolerance_m;
      if (less_m >= level.tolerance_m) continue;
      level.tolerance_m = less_m;
      first = std::min(first, l);
    }
    return first;
  }
  /// See gpu::exact::BlockLevel.
  double least_above(std::size_t l) const { return least_tolerance_m(asked_.levels[l - 1], asked_.levels[l].height_step); }

  const proto::Plan& plan_;
  const proto::TileAddress node_;
  const proto::Lattice lattice_;
  const proto::Samples& samples_;
  const BlockReaders team_;
  const BlockPlace place_;
  const BlockCurve curve_;
  const gpu::SampleFrames frames_;
  const SampleCounts counts_;
  gpu::exact::BlockPlan asked_;
  const bool merged_above_;  ///< levels above need its mesh and its squares
  KeptBlock kept_;
};

}  // namespace

proto::Result<FinishedTask> build_block(const proto::Plan& plan, const proto::TileAddress& node, const BlockPlace& place,
                                        const proto::Samples& samples, ExactSimplifiers& simplifiers, const BlockReaders& team,
                                        const std::function<void(double)>& share) {
  return BlockBuild(plan, node, place, samples, team).run(simplifiers, share);
}

namespace {

/// Of a level by a published algorithm.
double count_anew(const LevelContext& context, std::vector<BuiltTile> tiles, const BlockCounters& team) {
  std::vector<std::size_t> triangles(tiles.size());
  team.workers.each(tiles.size(), [&](std::size_t k, unsigned worker) {
    team.strategy.simplify(context, tiles[k], worker);
    triangles[k] = tiles[k].mesh.triangles.size();
  });
  return static_cast<double>(std::accumulate(triangles.begin(), triangles.end(), std::size_t{0}));
}

}  // namespace

proto::Result<std::vector<double>> count_block(const proto::Plan& plan, int coarsest, const BlockPlace& place,
                                               const proto::Samples& samples, const BlockCounters& team) {
  const proto::Lattice lattice = lattice_of(plan);
  const BlockCurve curve = curve_of(plan, place);
  const gpu::exact::BlockPlan asked = levels_of_block(plan, coarsest, place, samples);
  const std::optional<gpu::SampleFrames> frames =
      team.strategy.is_open() ? std::optional<gpu::SampleFrames>(std::in_place, lattice, samples) : std::nullopt;
  std::vector<double> triangles(asked.levels.size());
  const auto made = team.simplifiers.simplify(
      block_at(plan, place, samples, curve), asked,
      [&](std::size_t level, BlockMesh&& mesh) {
        const int z = lattice.finest_level - static_cast<int>(level);
        const LevelContext context{&lattice, &level_plan(plan, z), &samples, plan.promise(), frames ? &*frames : nullptr};
        triangles[level] = team.strategy.is_open()
                               ? count_anew(context, tiles_of_block(plan, place, z, mesh, TileParts::whole), team)
                               : static_cast<double>(
                                     std::ranges::count_if(mesh.triangles, [&](const auto& t) { return is_published(mesh, t); }));
      },
      nullptr);
  if (!made.ok()) return made.problem();
  return triangles;
}

namespace {

/// Levels above blocks. While the engine makes one, the tiles of those before it are finished.
class AboveBuild {
 public:
  AboveBuild(const proto::Plan& plan, Above above, Workers& workers, const std::function<void(double)>& share)
      : plan_(plan),
        workers_(workers),
        share_(share),
        place_(place_above(plan)),
        curve_(curve_of(plan, place_)),
        lattice_(lattice_of(plan)),
        above_(std::move(above)),
        levels_(levels_above(plan, above_.ground)),
        known_(lattice_, above_.ground) {
    above_.ground.curve = curve_.rows;
    above_.ground.curve_up = curve_.up;
  }

  proto::Result<std::vector<EncodedTile>> run(ExactSimplifiers& simplifiers) {
    const auto made = grid_of(plan_).closes ? run_around(simplifiers) : run_levels(simplifiers);
    if (!made.ok()) return made.problem();
    std::vector<EncodedTile> all;
    for (auto& level : under_way_) {
      std::vector<EncodedTile> tiles = level.get();
      std::move(tiles.begin(), tiles.end(), std::back_inserter(all));
    }
    return all;
  }

 private:
  proto::Result<void> run_levels(ExactSimplifiers& simplifiers) {
    return simplifiers.simplify_above(above_.ground, above_.start, levels_, [&](std::size_t l, BlockMesh&& mesh) {
      if (l == 0) under_way_.clear();  // a lost device's
      finish(l, place_.west, std::move(mesh));
    });
  }
  /// The sides of a ground that closes stay as they are. So each level is cut where the one before was simplified.
  proto::Result<void> run_around(ExactSimplifiers& simplifiers) {
    const gpu::exact::BlockPlan& all = levels_;
    const std::size_t levels = all.levels.size();
    const gpu::exact::Ground turned = levels > 1 ? half_turned(above_.ground) : gpu::exact::Ground();
    for (std::size_t l = 0; l < levels; ++l) {
      gpu::exact::BlockPlan level = all;
      level.levels = {all.levels[l]};
      level.tile_side <<= l;
      const gpu::exact::Ground& ground = l % 2 == 0 ? above_.ground : turned;
      BlockMesh made;
      const auto result =
          simplifiers.simplify_above(ground, above_.start, level, [&](std::size_t, BlockMesh&& mesh) { made = std::move(mesh); });
      if (!result.ok()) return result;
      if (l + 1 < levels) above_.start = half_turned(made, ground.columns);
      finish(l, ground.west, std::move(made));
    }
    return {};
  }
  /// Its tiles, meanwhile. west: of the mesh, on the lattice.
  void finish(std::size_t l, std::int64_t west, BlockMesh&& mesh) {
    const int z = static_cast<int>(plan_.block_level()) - 1 - static_cast<int>(l);
    under_way_.push_back(
        std::async(std::launch::async, [this, z, west, kept = std::move(mesh)] { return finished(z, west, kept); }));
    share_(1 - std::exp2(-1 - static_cast<double>(l)));  // a level has fewer vertices than the one below it
  }
  std::vector<EncodedTile> finished(int z, std::int64_t west, const BlockMesh& mesh) {
    const LevelContext context{&lattice_, &level_plan(plan_, z), nullptr};
    BlockPlace place = place_;
    place.west = west, place.east = west + place_.east - place_.west;
    std::vector<BuiltTile> tiles = tiles_of_block(plan_, place, z, mesh);
    state_errors(context, known_, workers_.loop(), tiles);
    return encode_tiles(context, tiles, plan_.options(), workers_);
  }

  const proto::Plan& plan_;
  Workers& workers_;
  const std::function<void(double)>& share_;
  const BlockPlace place_;
  const BlockCurve curve_;
  const proto::Lattice lattice_;
  Above above_;
  const gpu::exact::BlockPlan levels_;
  const KnownGround known_;
  std::vector<std::future<std::vector<EncodedTile>>> under_way_;  ///< of levels; they borrow what is above
};

}  // namespace

proto::Result<FinishedTask> build_above(const proto::Plan& plan, Above above, ExactSimplifiers& simplifiers, Workers& workers,
                                        const std::function<void(double)>& share) {
  FinishedTask task;
  task.node = node_above(plan);
  auto tiles = AboveBuild(plan, std::move(above), workers, share).run(simplifiers);
  if (!tiles.ok()) return tiles.problem();
  task.tiles = std::move(*tiles);
  return task;
}

}  // namespace cordillera::pipeline
