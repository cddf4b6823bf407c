#include "pipeline/build/regions_above.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "pipeline/build/build.h"
#include "pipeline/build/exact/error_statement.h"
#include "pipeline/build/exact/exact_above.h"
#include "pipeline/build/exact/ground_meter.h"
#include "pipeline/build/exact/kept_block.h"
#include "pipeline/build/exact/quarter_grid.h"
#include "pipeline/build/in_flight.h"
#include "pipeline/build/tile_output.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/plan.h"
#include "proto/integers.h"

namespace cordillera::pipeline {
namespace {

using gpu::exact::BlockMesh;
using gpu::exact::Ground;

/// Pieces of one tile as one: they share vertices on their common sides.
BuiltTile put_together(std::vector<BuiltTile>& pieces) {
  BuiltTile tile = std::move(pieces.front());
  std::map<std::pair<std::int32_t, std::int32_t>, std::uint32_t> number;
  for (std::uint32_t v = 0; v < tile.mesh.vertices(); ++v) number.emplace(std::pair(tile.mesh.x[v], tile.mesh.y[v]), v);
  for (auto piece = pieces.begin() + 1; piece != pieces.end(); ++piece) {
    const proto::TileMesh& mesh = piece->mesh;
    std::vector<std::uint32_t> to(mesh.vertices());
    for (std::size_t v = 0; v < to.size(); ++v) {
      const auto [there, added] = number.try_emplace({mesh.x[v], mesh.y[v]}, static_cast<std::uint32_t>(tile.mesh.vertices()));
      to[v] = there->second;
      if (!added) continue;
      tile.mesh.x.push_back(mesh.x[v]);
      tile.mesh.y.push_back(mesh.y[v]);
      tile.mesh.height.push_back(mesh.height[v]);
      tile.mesh.mark.push_back(mesh.mark[v]);
    }
    for (const auto& t : mesh.triangles) tile.mesh.triangles.push_back({to[t[0]], to[t[1]], to[t[2]]});
    tile.max_error_m = std::max(tile.max_error_m, piece->max_error_m);
    tile.put_back += piece->put_back;
    tile.measured.sum_squared_m2 += piece->measured.sum_squared_m2;
    tile.measured.samples += piece->measured.samples;
  }
  return tile;
}

/// What a region gives beside finished tiles.
struct MadeRegion {
  std::vector<proto::TileMesh> quarters;  ///< row by row; without vertices where they have no data
  std::vector<BuiltTile> pieces;          ///< of tiles that are larger than quarters
};

/// Memory of grounds that are done: to have it anew takes as long as to fill it.
class IdleGrounds {
 public:
  struct Taken {
    explicit Taken(IdleGrounds& from) : idle(from), ground(from.take()) {}
    ~Taken() { idle.put(std::move(ground)); }
    Taken(const Taken&) = delete;
    Taken& operator=(const Taken&) = delete;
    IdleGrounds& idle;
    Ground ground;
  };

 private:
  Ground take() {
    const std::lock_guard lock(mutex_);
    if (grounds_.empty()) return {};
    Ground ground = std::move(grounds_.back());
    grounds_.pop_back();
    return ground;
  }
  void put(Ground&& ground) {
    const std::lock_guard lock(mutex_);
    grounds_.push_back(std::move(ground));
  }

  std::mutex mutex_;
  std::vector<Ground> grounds_;
};

class RegionsBuild {
 public:
  RegionsBuild(const proto::Plan& plan, const GatheredBlocks::MeshOf& mesh_of, const RegionsTeam& team, std::int32_t quarter_side)
      : plan_(plan),
        mesh_of_(mesh_of),
        team_(team),
        lattice_(lattice_of(plan)),
        blocks_(grid_of(plan)),
        block_side_(block_side(plan)),
        quarters_(plan, quarter_side),
        levels_(levels_above(plan)),
        code_unit_(code_unit(plan)),
        left_(static_cast<std::size_t>(blocks_.across) * static_cast<std::size_t>(blocks_.up)) {}

  proto::Result<FinishedTask> run() {
    FinishedTask task;
    task.node = node_above(plan_);
    for (std::size_t l = 0; l < levels_.levels.size(); ++l) {
      if (const auto made = make_level(l, task.tiles); !made.ok()) return made.problem();
    }
    for (std::int32_t k = 0; k < blocks_.count(); ++k) {
      if (has_left(k)) task.consumed.push_back(node_at(plan_, blocks_, k));
    }
    return task;
  }

 private:
  proto::Result<void> make_level(std::size_t l, std::vector<EncodedTile>& tiles) {
    const int z = static_cast<int>(plan_.block_level()) - 1 - static_cast<int>(l);
    const LevelContext context{&lattice_, &level_plan(plan_, z), nullptr};
    std::vector<Region> regions = quarters_.regions(l);
    std::vector<MadeRegion> made(regions.size());
    std::map<std::pair<std::int64_t, std::int64_t>, proto::TileMesh> quarters;
    std::map<proto::TileAddress, std::vector<BuiltTile>> pieces;
    double done = 0;
    const auto make = [&](std::size_t k) { return make_region(context, l, regions[k], made[k]); };
    const auto take = [&](std::size_t k, FinishedTask&& task) -> proto::Result<void> {
      std::move(task.tiles.begin(), task.tiles.end(), std::back_inserter(tiles));
      for (BuiltTile& piece : made[k].pieces) pieces[piece.tile].push_back(std::move(piece));
      for (std::size_t n = 0; n < made[k].quarters.size(); ++n) {
        const auto across = regions[k].across, column = static_cast<std::int32_t>(n) % across,
                   row = static_cast<std::int32_t>(n) / across;
        if (made[k].quarters[n].vertices() > 0)
          quarters.emplace(quarters_.key(regions[k].column + column, regions[k].row + row), std::move(made[k].quarters[n]));
      }
      made[k] = {};
      // All levels read the same, which is most of what they take.
      team_.share((static_cast<double>(l) + ++done / static_cast<double>(regions.size())) /
                  static_cast<double>(levels_.levels.size()));
      return {};
    };
    const auto all_made = in_flight(
        regions.size(), [&] { return team_.at_once; }, make, take);
    if (!all_made.ok()) return all_made;
    before_ = std::move(quarters);
    std::vector<BuiltTile> whole;
    for (auto& [at, parts] : pieces) whole.push_back(put_together(parts));
    std::vector<EncodedTile> encoded = encode_tiles(context, whole, plan_.options(), team_.workers);
    std::move(encoded.begin(), encoded.end(), std::back_inserter(tiles));
    return {};
  }

  /// Its tiles, and what becomes of it beside; nothing where it has no data. What of it is made is in `region`.
  proto::Result<FinishedTask> make_region(const LevelContext& context, std::size_t l, Region& region, MadeRegion& made) {
    FinishedTask task;
    std::map<std::int32_t, proto::TileMesh> meshes;  // of blocks, by their numbers
    if (l == 0) {
      if (auto read = read_meshes(quarters_.place_of(region), meshes); !read.ok()) return read.problem();
    }
    region = with_data(l, region);
    if (region.across == 0) return task;
    BlockMesh start = l == 0 ? joined_blocks(quarters_.place_of(region), meshes) : joined_quarters(region);
    const BlockPlace place = quarters_.place_of(region);
    const BlockCurve curve = curve_of(plan_, place);
    IdleGrounds::Taken taken(idle_);
    Ground& ground = taken.ground;
    make_unknown(plan_, place, ground);
    ground.goes_on = quarters_.goes_on(region);
    ground.cut_column = region.across == 2 ? quarters_.side() : 0;
    ground.cut_row = region.up == 2 ? quarters_.side() : 0;
    ground.curve = curve.rows, ground.curve_up = curve.up;
    if (auto read = read_squares(place, ground); !read.ok()) return read.problem();
    gpu::exact::BlockPlan level = levels_;
    level.levels = {levels_.levels[l]};
    level.tile_side = static_cast<std::int32_t>(std::min<std::int64_t>(std::int64_t{levels_.tile_side} << l, quarters_.side()));
    BlockMesh mesh;
    const auto simplified =
        team_.simplifiers.simplify_above(ground, start, level, [&](std::size_t, BlockMesh&& of) { mesh = std::move(of); });
    if (team_.stop) return kCancelled;
    if (!simplified.ok()) return simplified.problem();
    start = {};
    const int z = static_cast<int>(context.level->level());
    if (l + 1 < levels_.levels.size()) made.quarters = cut_mesh(mesh, region.across, region.up, quarters_.side());
    std::vector<BuiltTile> built = tiles_of_block(plan_, place, z, mesh);
    const KnownGround known(lattice_, ground);
    if (lattice_.tile_units(z) <= quarters_.side()) {
      state_errors(context, known, team_.workers.loop(), built);
      task.tiles = encode_tiles(context, built, plan_.options(), team_.workers);
    } else {
      state_errors_of_pieces(context, place, known, built);
      made.pieces = std::move(built);
    }
    return task;
  }

  /// A block of a place, and its column and row there.
  struct PlacedBlock {
    std::int32_t number = 0;  ///< among all
    std::int32_t column = 0, row = 0;
  };
  std::vector<PlacedBlock> blocks_in(const BlockPlace& place) const {
    std::vector<PlacedBlock> all;
    for (std::int64_t y = place.south / block_side_; y < place.north / block_side_; ++y) {
      for (std::int64_t x = place.west / block_side_; x < place.east / block_side_; ++x) {
        if (const auto number = number_of_block(x, y))
          all.push_back({*number, static_cast<std::int32_t>(x - place.west / block_side_),
                         static_cast<std::int32_t>(y - place.south / block_side_)});
      }
    }
    return all;
  }
  /// By column and row of its node.
  std::optional<std::int32_t> number_of_block(std::int64_t x, std::int64_t y) const {
    return blocks_.number_at(x - blocks_.west, y - blocks_.south);
  }
  std::uint8_t& mark_of(std::int32_t block) { return left_[static_cast<std::size_t>(block)]; }
  bool has_left(std::int32_t block) const { return left_[static_cast<std::size_t>(block)] != 0; }
  /// take(block, what it left) for each that left something, by several threads.
  proto::Result<void> read_blocks(const std::vector<PlacedBlock>& blocks, KeptParts parts,
                                  const std::function<void(const PlacedBlock& block, KeptBlock&& left)>& take) {
    std::vector<std::optional<proto::Problem>> problems(blocks.size());
    team_.workers.each(blocks.size(), [&](std::size_t n, unsigned) {
      if (team_.stop) return;
      const auto bytes = mesh_of_(node_at(plan_, blocks_, blocks[n].number));
      if (!bytes.ok()) problems[n] = bytes.problem();
      if (!bytes.ok() || !*bytes) return;
      auto left = kept_block_from(**bytes, block_side_, code_unit_, parts);
      if (!left.ok())
        problems[n] = left.problem();
      else
        take(blocks[n], std::move(*left));
    });
    if (team_.stop) return kCancelled;
    for (const auto& problem : problems) {
      if (problem) return *problem;
    }
    return {};
  }
  proto::Result<void> read_meshes(const BlockPlace& place, std::map<std::int32_t, proto::TileMesh>& meshes) {
    std::mutex mutex;
    return read_blocks(blocks_in(place), KeptParts::mesh, [&](const PlacedBlock& block, KeptBlock&& left) {
      mark_of(block.number) = 1;
      const std::lock_guard lock(mutex);
      meshes.emplace(block.number, std::move(left.mesh));
    });
  }
  proto::Result<void> read_squares(const BlockPlace& place, Ground& ground) {
    std::vector<PlacedBlock> blocks = blocks_in(place);
    const auto all =
        static_cast<std::size_t>((place.east - place.west) / block_side_ * ((place.north - place.south) / block_side_));
    std::erase_if(blocks, [this](const PlacedBlock& block) { return !has_left(block.number); });
    std::atomic<bool> voids{blocks.size() < all};
    auto read = read_blocks(blocks, KeptParts::squares, [&](const PlacedBlock& block, KeptBlock&& left) {
      if (!left.squares.depth.empty()) voids = true;
      place_squares(block_side_, block.column * block_side_, block.row * block_side_, left.squares, ground);
    });
    if (!voids) ground.squares.depth.clear();
    return read;
  }
  /// Of blocks without data all sides are the same, whoever is beside them.
  BlockMesh joined_blocks(const BlockPlace& place, const std::map<std::int32_t, proto::TileMesh>& meshes) const {
    const std::int64_t west = place.west / block_side_, south = place.south / block_side_,
                       across = place.east / block_side_ - west, up = place.north / block_side_ - south;
    const auto at = [&](std::int32_t column, std::int32_t row) -> const proto::TileMesh* {
      if (column < 0 || row < 0 || column >= across || row >= up) return nullptr;
      const auto number = number_of_block(west + column, south + row);
      const auto found = number ? meshes.find(*number) : meshes.end();
      return found == meshes.end() ? nullptr : &found->second;
    };
    return joined_mesh(
        {static_cast<std::int32_t>(across), static_cast<std::int32_t>(up), static_cast<std::int32_t>(block_side_), at});
  }

  /// Without columns and rows of quarters that have no data: memory is for the others. across 0: there are none.
  Region with_data(std::size_t l, Region region) const {
    const auto has = [&](std::int32_t column, std::int32_t row) {
      const Region one{region.column + column, region.row + row, 1, 1};
      if (l > 0) return quarter(one.column, one.row) != nullptr;
      const std::vector<PlacedBlock> blocks = blocks_in(quarters_.place_of(one));
      return std::any_of(blocks.begin(), blocks.end(), [this](const PlacedBlock& block) { return has_left(block.number); });
    };
    const auto column_has = [&](std::int32_t column) { return has(column, 0) || (region.up == 2 && has(column, 1)); };
    const auto row_has = [&](std::int32_t row) { return has(0, row) || (region.across == 2 && has(1, row)); };
    Region with = region;
    if (!row_has(0)) ++with.row, --with.up;
    if (region.up == 2 && !row_has(1)) --with.up;
    if (!column_has(0)) ++with.column, --with.across;
    if (region.across == 2 && !column_has(1)) --with.across;
    return with.up == 0 || with.across == 0 ? Region() : with;
  }

  const proto::TileMesh* quarter(std::int64_t column, std::int64_t row) const {
    const auto found = before_.find(quarters_.key(column, row));
    return found == before_.end() ? nullptr : &found->second;
  }
  BlockMesh joined_quarters(const Region& region) const {
    const auto at = [&](std::int32_t column, std::int32_t row) { return quarter(region.column + column, region.row + row); };
    return joined_mesh({region.across, region.up, quarters_.side(), at});
  }

  /// What vertices a piece has on the sides of its region.
  std::vector<std::array<std::int32_t, 3>> met(const BlockPlace& place, const BuiltTile& piece) const {
    const std::int64_t west = lattice_.west(piece.tile), south = lattice_.south(piece.tile), circle = lattice_.columns();
    const proto::TileMesh& mesh = piece.mesh;
    std::vector<std::array<std::int32_t, 3>> all;
    for (std::size_t v = 0; v < mesh.vertices(); ++v) {
      const std::int64_t x = west + mesh.x[v], y = south + mesh.y[v];
      if ((x - place.west) % circle == 0 || (x - place.east) % circle == 0 || y == place.south || y == place.north)
        all.push_back({mesh.x[v], mesh.y[v], mesh.height[v]});
    }
    std::sort(all.begin(), all.end());
    return all;
  }
  /// Where vertices went in on a side of the region, which others do not know, none are put back, and the error is stated as it
  /// is. All pieces of a tile have the same share in its RMSE.
  void state_errors_of_pieces(const LevelContext& context, const BlockPlace& place, const KnownGround& known,
                              std::vector<BuiltTile>& pieces) {
    const int step = std::max(4, quarters_.side() / 512);
    const std::vector<BuiltTile> before = pieces;
    state_errors(context, known, team_.workers.loop(), pieces, step);
    LevelContext as_it_is = context;
    as_it_is.put_back = false;
    for (std::size_t n = 0; n < pieces.size(); ++n) {
      if (met(place, pieces[n]) == met(place, before[n])) continue;
      std::vector<BuiltTile> again{before[n]};
      state_errors(as_it_is, known, team_.workers.loop(), again, step);
      pieces[n] = std::move(again.front());
    }
  }

  const proto::Plan& plan_;
  const GatheredBlocks::MeshOf& mesh_of_;
  const RegionsTeam team_;
  const proto::Lattice lattice_;
  const BlockGrid blocks_;
  const std::int64_t block_side_;
  const QuarterGrid quarters_;
  const gpu::exact::BlockPlan levels_;
  const float code_unit_;
  std::vector<std::uint8_t> left_;  ///< whether a block left something, once its region was read; indexed as node_at
  std::map<std::pair<std::int64_t, std::int64_t>, proto::TileMesh> before_;  ///< quarters of the level below
  IdleGrounds idle_;
};

}  // namespace

proto::Result<FinishedTask> build_regions_above(const proto::Plan& plan, const GatheredBlocks::MeshOf& mesh_of,
                                                const RegionsTeam& team, std::int32_t quarter_side) {
  return RegionsBuild(plan, mesh_of, team, quarter_side).run();
}

}  // namespace cordillera::pipeline
