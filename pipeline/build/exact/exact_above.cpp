#include "pipeline/build/exact/exact_above.h"

#include <algorithm>
#include <map>
#include <stdexcept>

#include "gpu/exact/side_chain.h"
#include "pipeline/build/exact/error_statement.h"
#include "pipeline/plan/ecef_step.h"
#include "pipeline/plan/plan.h"
#include "pipeline/tile/border.h"
#include "pipeline/tile/void_tile.h"
#include "proto/integers.h"

namespace cordillera::pipeline {
namespace {

using gpu::exact::BlockMesh;
using gpu::exact::Ground;

constexpr double kLeastSteps = 4;  // of height in a tolerance: the engine's bound

std::int64_t block_units(const proto::Plan& plan) { return lattice_of(plan).tile_units(static_cast<int>(plan.block_level())); }

/// Blocks by row and column; those without data get a mesh of void triangles that fits their neighbours.
class Mosaic {
 public:
  Mosaic(const BlockGrid& grid, std::int32_t side, const std::vector<const proto::TileMesh*>& meshes)
      : grid_(grid), side_(side), meshes_(meshes) {}

  BlockMesh mesh() {
    BlockMesh all;
    std::map<std::uint64_t, std::uint32_t> on_sides;  // where blocks meet
    for (std::int32_t k = 0; k < grid_.count(); ++k) {
      const proto::TileMesh stand_in = mesh_of(k) ? proto::TileMesh() : without_data(k);
      append(mesh_of(k) ? *mesh_of(k) : stand_in, k, on_sides, all);
    }
    return all;
  }

 private:
  const proto::TileMesh* mesh_of(std::int32_t k) const { return meshes_[static_cast<std::size_t>(k)]; }
  const proto::TileMesh* at(std::int32_t column, std::int32_t row) const {
    if (grid_.closes) column = static_cast<std::int32_t>(proto::modulo(column, grid_.across));
    return column < 0 || row < 0 || column >= grid_.across || row >= grid_.up ? nullptr : mesh_of(row * grid_.across + column);
  }
  proto::TileMesh without_data(std::int32_t k) const {
    const std::int32_t column = k % grid_.across, row = k / grid_.across;
    const auto beside = [&](const proto::TileMesh* mesh, Side facing) {
      return mesh ? border_chain(*mesh, facing) : void_chain(side_, side_ / gpu::exact::kVoidChords);
    };
    std::array<Chain, 4> border;
    border[static_cast<std::size_t>(Side::west)] = beside(at(column - 1, row), Side::east);
    border[static_cast<std::size_t>(Side::east)] = beside(at(column + 1, row), Side::west);
    border[static_cast<std::size_t>(Side::south)] = beside(at(column, row - 1), Side::north);
    border[static_cast<std::size_t>(Side::north)] = beside(at(column, row + 1), Side::south);
    return void_tile(side_, border);
  }
  void append(const proto::TileMesh& mesh, std::int32_t k, std::map<std::uint64_t, std::uint32_t>& on_sides,
              BlockMesh& all) const {
    const std::int32_t west = k % grid_.across * side_, south = k / grid_.across * side_;
    std::vector<std::uint32_t> number(mesh.vertices());
    for (std::size_t v = 0; v < number.size(); ++v) {
      const bool on_side = mesh.x[v] == 0 || mesh.y[v] == 0 || mesh.x[v] == side_ || mesh.y[v] == side_;
      const std::int32_t x = west + mesh.x[v], y = south + mesh.y[v];
      const auto next = static_cast<std::uint32_t>(all.vertices());
      const std::uint8_t is_void = proto::is_void(mesh, v) ? 1 : 0;
      number[v] = next;
      if (on_side) {
        const auto [there, added] =
            on_sides.try_emplace(static_cast<std::uint64_t>(x) << 32 | static_cast<std::uint64_t>(y), next);
        number[v] = there->second;
        if (!added) {
          if (all.height[number[v]] != mesh.height[v] || all.is_void[number[v]] != is_void)
            throw std::logic_error("exact blocks differ on the side between them");
          continue;
        }
      }
      all.x.push_back(static_cast<std::uint16_t>(x));
      all.y.push_back(static_cast<std::uint16_t>(y));
      all.height.push_back(mesh.height[v]);
      all.is_void.push_back(is_void);
    }
    for (const auto& t : mesh.triangles) all.triangles.push_back({number[t[0]], number[t[1]], number[t[2]]});
  }

  const BlockGrid& grid_;
  const std::int32_t side_;
  const std::vector<const proto::TileMesh*>& meshes_;
};

}  // namespace

/// Its last row and column are its neighbours' first, but at the end of the rectangle.
void place_squares(const proto::Plan& plan, std::int32_t k, const gpu::exact::Squares& from, Ground& ground) {
  const BlockGrid grid = grid_of(plan);
  gpu::exact::Squares& to_squares = ground.squares;
  const std::int32_t column = k % grid.across, row = k / grid.across, squares = static_cast<std::int32_t>(block_units(plan) / 8);
  const std::int32_t columns = squares + (column + 1 == grid.across ? 1 : 0), rows = squares + (row + 1 == grid.up ? 1 : 0);
  for (std::int32_t y = 0; y < rows; ++y) {
    const std::size_t to =
        static_cast<std::size_t>(row * squares + y) * ground.across() + static_cast<std::size_t>(column * squares);
    const std::size_t of = static_cast<std::size_t>(y) * static_cast<std::size_t>(squares + 1);
    for (std::int32_t x = 0; x < columns; ++x) {
      const std::size_t n = static_cast<std::size_t>(x);
      to_squares.plane[to + n] = from.plane[of + n];
      std::copy_n(from.code.begin() + static_cast<std::ptrdiff_t>(64 * (of + n)), 64,
                  to_squares.code.begin() + static_cast<std::ptrdiff_t>(64 * (to + n)));
      to_squares.depth[to + n] = from.depth.empty() ? gpu::exact::valid_depth(gpu::exact::kFarthest) : from.depth[of + n];
    }
  }
}

BlockPlace place_above(const proto::Plan& plan) {
  const BlockGrid grid = grid_of(plan);
  const std::int64_t units = block_units(plan);
  BlockPlace place;
  place.west = grid.west * units, place.east = place.west + grid.across * units;
  place.south = grid.south * units, place.north = place.south + grid.up * units;
  return place;
}

Ground unknown_ground(const proto::Plan& plan) {
  const BlockGrid grid = grid_of(plan);
  const BlockPlace place = place_above(plan);
  const auto side = static_cast<std::int32_t>(block_units(plan));
  Ground ground;
  ground.west = place.west, ground.south = place.south;
  ground.columns = grid.across * side + 1, ground.rows = grid.up * side + 1;
  ground.closes = grid.closes;
  const std::size_t squares = ground.across() * ground.up();
  ground.squares.plane.assign(squares, {0, 0, 0, gpu::exact::kNothing});
  ground.squares.code.assign(64 * squares, 0);
  ground.squares.depth.assign(squares, gpu::exact::void_depth(gpu::exact::kFarthest));
  return ground;
}

BlockMesh joined_mesh(const proto::Plan& plan, const std::vector<const proto::TileMesh*>& meshes) {
  return Mosaic(grid_of(plan), static_cast<std::int32_t>(block_units(plan)), meshes).mesh();
}

namespace {

/// Of rows of so many squares and one more, whose samples lie on the side: the halves change places, and the last square is that
/// of the new side. It says more than is there: its other samples lie beyond the rectangle.
template <class T>
std::vector<T> half_turned_rows(const std::vector<T>& from, std::size_t across, std::size_t a_square) {
  std::vector<T> to(from.size());
  const std::size_t row = (across + 1) * a_square, half = across / 2 * a_square;
  for (std::size_t begin = 0; begin < from.size(); begin += row) {
    const auto at = from.begin() + static_cast<std::ptrdiff_t>(begin);
    const auto middle = at + static_cast<std::ptrdiff_t>(half), last = middle + static_cast<std::ptrdiff_t>(half);
    auto next = std::copy(middle, last, to.begin() + static_cast<std::ptrdiff_t>(begin));
    next = std::copy(at, middle, next);
    std::copy_n(middle, a_square, next);
  }
  return to;
}

}  // namespace

Ground half_turned(const Ground& ground) {
  Ground turned;
  turned.west = ground.west + (ground.columns - 1) / 2, turned.south = ground.south;
  turned.columns = ground.columns, turned.rows = ground.rows;
  turned.closes = ground.closes;
  turned.curve = ground.curve, turned.curve_up = ground.curve_up;
  turned.sample_m = ground.sample_m;
  const std::size_t across = ground.across() - 1;
  turned.squares.plane = half_turned_rows(ground.squares.plane, across, 1);
  turned.squares.code = half_turned_rows(ground.squares.code, across, 64);
  turned.squares.depth = half_turned_rows(ground.squares.depth, across, 1);
  return turned;
}

BlockMesh half_turned(const BlockMesh& mesh, std::int32_t columns) {
  const std::int32_t last = columns - 1, half = last / 2;
  BlockMesh turned;
  const auto add = [&](std::size_t v, std::int32_t x) {
    turned.x.push_back(static_cast<std::uint16_t>(x));
    turned.y.push_back(mesh.y[v]);
    turned.height.push_back(mesh.height[v]);
    turned.is_void.push_back(mesh.is_void[v]);
    return static_cast<std::uint32_t>(turned.vertices() - 1);
  };
  std::map<std::uint16_t, std::uint32_t> on_side;  // by y, as numbered in the new mesh
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    if (mesh.x[v] == 0) on_side.emplace(mesh.y[v], add(v, half));
  }
  if (static_cast<std::size_t>(std::count(mesh.x.begin(), mesh.x.end(), last)) != on_side.size())
    throw std::logic_error("a mesh around the earth does not close");
  // As a corner of what lies west of the meridian halfway around, and of what lies east of it.
  std::vector<std::array<std::uint32_t, 2>> number(mesh.vertices());
  for (std::size_t v = 0; v < mesh.vertices(); ++v) {
    const std::int32_t x = mesh.x[v];
    if (x == half) {
      number[v] = {add(v, last), add(v, 0)};
      continue;
    }
    if (x > 0 && x < last) {
      number[v].fill(add(v, x < half ? x + half : x - half));
      continue;
    }
    const auto there = on_side.find(mesh.y[v]);
    if (there == on_side.end() || turned.height[there->second] != mesh.height[v] ||
        turned.is_void[there->second] != mesh.is_void[v])
      throw std::logic_error("a mesh around the earth does not close");
    number[v].fill(there->second);
  }
  for (const auto& t : mesh.triangles) {
    const std::size_t is_east = std::max({mesh.x[t[0]], mesh.x[t[1]], mesh.x[t[2]]}) > half ? 1 : 0;
    turned.triangles.push_back({number[t[0]][is_east], number[t[1]][is_east], number[t[2]][is_east]});
  }
  return turned;
}

gpu::exact::BlockPlan levels_above(const proto::Plan& plan) {
  gpu::exact::BlockPlan levels = levels_of_block(plan, static_cast<int>(plan.min_level()));
  const auto below = static_cast<std::ptrdiff_t>(plan.finest_level() - plan.block_level() + 1);
  levels.levels.erase(levels.levels.begin(), levels.levels.begin() + below);
  levels.tile_side <<= below;
  for (std::size_t l = 0; l < levels.levels.size(); ++l) {
    const proto::LevelPlan& level = level_plan(plan, static_cast<int>(plan.block_level()) - 1 - static_cast<int>(l));
    gpu::exact::BlockLevel& asked = levels.levels[l];
    // Where a target is hardly more than what a float32 can tell, the engine is asked for no less than it takes; the error is
    // stated as it is.
    const double least_m = kLeastSteps * asked.height_step * proto::kHeightStep_m;
    asked.tolerance_m = std::max({asked.tolerance_m - kMildSlope * usual_step_m(plan, level), asked.tolerance_m / 2, least_m});
    if (l > 0) asked.tolerance_m = std::max(asked.tolerance_m, least_tolerance_m(levels.levels[l - 1], asked.height_step));
  }
  return levels;
}

}  // namespace cordillera::pipeline
