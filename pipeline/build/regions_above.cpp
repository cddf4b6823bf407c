#include "pipeline/build/regions_above.h"

#include <algorithm>
#include <map>
#include <mutex>
#include <optional>
#include <utility>
#include <vector>

#include "pipeline/build/exact/error_statement.h"
#include "pipeline/build/exact/exact_above.h"
#include "pipeline/build/exact/ground_meter.h"
#include "pipeline/build/exact/kept_block.h"
#include "pipeline/build/in_flight.h"
#include "pipeline/build/tile_output.h"
#include "pipeline/plan/block_grid.h"
#include "pipeline/plan/plan.h"
#include "proto/integers.h"

namespace cordillera::pipeline {
namespace {

using gpu::exact::BlockMesh;
using gpu::exact::Ground;
using proto::floor_divide;

/// Which quarters; columns of a grid that closes are modulo the circle.
struct Region {
  std::int64_t column = 0, row = 0;
  std::int32_t across = 0, up = 0;  ///< 1 or 2 each
};

/// All quarters that the blocks of a plan lie in.
class QuarterGrid {
 public:
  QuarterGrid(const proto::Plan& plan, std::int32_t side) : side_(side), closes_(grid_of(plan).closes) {
    const BlockPlace all = place_above(plan);
    west_ = floor_divide(all.west, side), east_ = floor_divide(all.east - 1, side) + 1;
    south_ = floor_divide(all.south, side), north_ = floor_divide(all.north - 1, side) + 1;
  }
  /// Of a level that is so many above the blocks, row by row.
  std::vector<Region> regions(std::size_t level) const {
    const auto shift = static_cast<std::int64_t>(level % 2);
    std::vector<Region> all;
    for (const auto& [row, up] : spans(south_, north_, shift, false)) {
      for (const auto& [column, across] : spans(west_, east_, shift, closes_)) all.push_back({column, row, across, up});
    }
    return all;
  }
  BlockPlace place_of(const Region& region) const {
    BlockPlace place;
    place.west = region.column * side_, place.east = place.west + std::int64_t{side_} * region.across;
    place.south = region.row * side_, place.north = place.south + std::int64_t{side_} * region.up;
    return place;
  }
  /// South, east, north, west.
  std::array<bool, 4> goes_on(const Region& region) const {
    return {region.row > south_, closes_ || region.column + region.across < east_, region.row + region.up < north_,
            closes_ || region.column > west_};
  }
  std::pair<std::int64_t, std::int64_t> key(std::int64_t column, std::int64_t row) const {
    return {row, closes_ ? proto::modulo(column, east_) : column};
  }
  std::int32_t side() const { return side_; }

 private:
  /// Pairs from multiples of two on, shifted.
  static std::vector<std::pair<std::int64_t, std::int32_t>> spans(std::int64_t from, std::int64_t to, std::int64_t shift,
                                                                  bool around) {
    std::vector<std::pair<std::int64_t, std::int32_t>> all;
    for (std::int64_t first = floor_divide(from - shift, 2) * 2 + shift; first < to; first += 2) {
      const std::int64_t begin = around ? first : std::max(first, from), end = around ? first + 2 : std::min(first + 2, to);
      if (around && first < from) continue;  // the last one holds it
      all.emplace_back(begin, static_cast<std::int32_t>(end - begin));
    }
    return all;
  }

  std::int32_t side_;
  bool closes_;
  std::int64_t west_ = 0, east_ = 0, south_ = 0, north_ = 0;
};

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
        left_(static_cast<std::size_t>(blocks_.across) * static_cast<std::size_t>(blocks_.up)) {}

  proto::Result<FinishedTask> run() {
    FinishedTask task;
    task.node = node_above(plan_);
    for (std::size_t l = 0; l < levels_.levels.size(); ++l) {
      if (const auto made = make_level(l, task.tiles); !made.ok()) return made.problem();
    }
    for (std::int32_t k = 0; k < blocks_.count(); ++k) {
      if (left_[static_cast<std::size_t>(k)]) task.consumed.push_back(node_at(plan_, blocks_, k));
    }
    return task;
  }

 private:
  proto::Result<void> make_level(std::size_t l, std::vector<EncodedTile>& tiles) {
    const int z = static_cast<int>(plan_.block_level()) - 1 - static_cast<int>(l);
    const LevelContext context{&lattice_, &level_plan(plan_, z), plan_.promise(), nullptr};
    const std::vector<Region> regions = quarters_.regions(l);
    std::vector<MadeRegion> made(regions.size());
    std::map<std::pair<std::int64_t, std::int64_t>, proto::TileMesh> quarters;
    std::map<proto::TileAddress, std::vector<BuiltTile>> pieces;
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
      return {};
    };
    const auto done = in_flight(
        regions.size(), [&] { return team_.at_once; }, make, take);
    if (!done.ok()) return done;
    before_ = std::move(quarters);
    std::vector<BuiltTile> whole;
    for (auto& [at, parts] : pieces) whole.push_back(put_together(parts));
    std::vector<EncodedTile> encoded = encode_tiles(context, whole, plan_.options(), team_.workers);
    std::move(encoded.begin(), encoded.end(), std::back_inserter(tiles));
    return {};
  }

  /// Its tiles, and what becomes of it beside; nothing where it has no data.
  proto::Result<FinishedTask> make_region(const LevelContext& context, std::size_t l, const Region& region, MadeRegion& made) {
    FinishedTask task;
    std::optional<BlockMesh> start;
    if (l > 0) {
      start = joined_quarters(region);
      if (!start) return task;
    }
    const BlockPlace place = quarters_.place_of(region);
    const BlockCurve curve = curve_of(plan_, place);
    IdleGrounds::Taken taken(idle_);
    Ground& ground = taken.ground;
    make_unknown(plan_, place, ground);
    ground.goes_on = quarters_.goes_on(region);
    ground.cut_column = region.across == 2 ? quarters_.side() : 0;
    ground.cut_row = region.up == 2 ? quarters_.side() : 0;
    ground.curve = curve.rows, ground.curve_up = curve.up;
    if (auto read = read_blocks(place, ground, l == 0 ? &start : nullptr); !read.ok()) return read.problem();
    if (!start) return task;
    gpu::exact::BlockPlan level = levels_;
    level.levels = {levels_.levels[l]};
    level.tile_side = static_cast<std::int32_t>(std::min<std::int64_t>(std::int64_t{levels_.tile_side} << l, quarters_.side()));
    BlockMesh mesh;
    const auto simplified =
        team_.simplifiers.simplify_above(ground, *start, level, [&](std::size_t, BlockMesh&& of) { mesh = std::move(of); });
    if (team_.stop) return kCancelled;
    if (!simplified.ok()) return simplified.problem();
    start.reset();
    const int z = static_cast<int>(context.level->level());
    if (l + 1 < levels_.levels.size()) made.quarters = cut_mesh(mesh, region.across, region.up, quarters_.side());
    std::vector<BuiltTile> built = tiles_of_block(plan_, place, z, mesh);
    const KnownGround known(lattice_, ground);
    if (lattice_.tile_units(z) <= quarters_.side()) {
      state_errors(context, known, team_.workers, built);
      task.tiles = encode_tiles(context, built, plan_.options(), team_.workers);
    } else {
      state_errors_of_pieces(context, place, known, built);
      made.pieces = std::move(built);
    }
    return task;
  }

  /// What the blocks of a place left, into the ground. start: their meshes as one; none, if there are none.
  proto::Result<void> read_blocks(const BlockPlace& place, Ground& ground, std::optional<BlockMesh>* start) {
    const auto across = static_cast<std::int32_t>((place.east - place.west) / block_side_),
               up = static_cast<std::int32_t>((place.north - place.south) / block_side_);
    const auto count = static_cast<std::size_t>(across) * static_cast<std::size_t>(up);
    std::vector<std::optional<proto::Problem>> problems(count);
    std::vector<std::optional<proto::TileMesh>> meshes(count);
    std::atomic<bool> voids{false};
    team_.workers.each(count, [&](std::size_t n, unsigned) {
      if (team_.stop) return;
      const auto column = static_cast<std::int64_t>(n) % across, row = static_cast<std::int64_t>(n) / across;
      const auto k = number_of_block(place.west / block_side_ + column, place.south / block_side_ + row);
      if (!k || !(start || left_[*k])) {
        voids = true;
        return;
      }
      const auto bytes = mesh_of_(node_at(plan_, blocks_, static_cast<std::int32_t>(*k)));
      if (!bytes.ok()) {
        problems[n] = bytes.problem();
      } else if (!*bytes) {
        voids = true;
      } else {
        auto block = kept_block_from(**bytes, block_side_, start ? KeptParts::all : KeptParts::squares);
        if (!block.ok()) {
          problems[n] = block.problem();
          return;
        }
        left_[*k] = 1;
        if (!block->squares.depth.empty()) voids = true;
        place_squares(block_side_, column * block_side_, row * block_side_, block->squares, ground);
        if (start) meshes[n] = std::move(block->mesh);
      }
    });
    if (team_.stop) return kCancelled;
    for (const auto& problem : problems) {
      if (problem) return *problem;
    }
    if (!voids) ground.squares.depth.clear();
    if (!start || std::none_of(meshes.begin(), meshes.end(), [](const auto& mesh) { return mesh.has_value(); })) return {};
    // Of blocks without data all sides are the same, whoever is beside them.
    *start = joined_mesh({across, up, static_cast<std::int32_t>(block_side_), [&](std::int32_t column, std::int32_t row) {
                            const bool inside = column >= 0 && row >= 0 && column < across && row < up;
                            const auto n = static_cast<std::size_t>(row * across + column);
                            return inside && meshes[n] ? &*meshes[n] : nullptr;
                          }});
    return {};
  }
  /// Among all blocks; by column and row of its node.
  std::optional<std::size_t> number_of_block(std::int64_t x, std::int64_t y) const {
    std::int64_t column = x - blocks_.west;
    const std::int64_t row = y - blocks_.south;
    if (blocks_.closes) column = proto::modulo(column, blocks_.across);
    if (column < 0 || row < 0 || column >= blocks_.across || row >= blocks_.up) return std::nullopt;
    return static_cast<std::size_t>(row * blocks_.across + column);
  }

  const proto::TileMesh* quarter(std::int64_t column, std::int64_t row) const {
    const auto found = before_.find(quarters_.key(column, row));
    return found == before_.end() ? nullptr : &found->second;
  }
  std::optional<BlockMesh> joined_quarters(const Region& region) const {
    const auto at = [&](std::int32_t column, std::int32_t row) { return quarter(region.column + column, region.row + row); };
    bool has_data = false;
    for (std::int32_t n = 0; n < region.across * region.up; ++n) has_data = has_data || at(n % region.across, n / region.across);
    if (!has_data) return std::nullopt;
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
    state_errors(context, known, team_.workers, pieces, step);
    LevelContext as_it_is = context;
    as_it_is.promise = false;
    for (std::size_t n = 0; n < pieces.size(); ++n) {
      if (met(place, pieces[n]) == met(place, before[n])) continue;
      std::vector<BuiltTile> again{before[n]};
      state_errors(as_it_is, known, team_.workers, again, step);
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
