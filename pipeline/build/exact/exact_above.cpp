#include "pipeline/build/exact/exact_above.h"

#include <algorithm>
#include <map>
#include <stdexcept>

#include "pipeline/build/exact/error_statement.h"
#include "pipeline/plan/ecef_step.h"
#include "pipeline/plan/plan.h"
#include "proto/integers.h"

namespace cordillera::pipeline {
namespace {

using gpu::exact::BlockMesh;
using gpu::exact::Ground;

constexpr double kLeastSteps = 4;  // of height in a tolerance: the engine's bound

}  // namespace

/// Its last row and column of squares are its neighbours' first, but at the end of the rectangle.
void place_squares(std::int64_t block_side, std::int64_t x, std::int64_t y, const gpu::exact::Squares& from, Ground& ground) {
  gpu::exact::Squares& to_squares = ground.squares;
  const auto squares = static_cast<std::size_t>(block_side / 8), west = static_cast<std::size_t>(x / 8),
             south = static_cast<std::size_t>(y / 8);
  const std::size_t columns = squares + (west + squares + 1 == ground.across() ? 1 : 0),
                    rows = squares + (south + squares + 1 == ground.up() ? 1 : 0);
  for (std::size_t row = 0; row < rows; ++row) {
    const std::size_t to = (south + row) * ground.across() + west, of = row * (squares + 1);
    std::copy_n(from.plane.data() + of, columns, to_squares.plane.data() + to);
    std::copy_n(from.code.data() + 64 * of, 64 * columns, to_squares.code.data() + 64 * to);
    if (from.depth.empty())
      std::fill_n(to_squares.depth.data() + to, columns, gpu::exact::valid_depth(gpu::exact::kFarthest));
    else
      std::copy_n(from.depth.data() + of, columns, to_squares.depth.data() + to);
  }
}

BlockPlace place_above(const proto::Plan& plan) {
  const BlockGrid grid = grid_of(plan);
  const std::int64_t side = block_side(plan);
  BlockPlace place;
  place.west = grid.west * side, place.east = place.west + grid.across * side;
  place.south = grid.south * side, place.north = place.south + grid.up * side;
  return place;
}

void make_unknown(const proto::Plan& plan, const BlockPlace& place, Ground& ground) {
  ground.west = place.west, ground.south = place.south;
  ground.columns = static_cast<std::int32_t>(place.east - place.west + 1);
  ground.rows = static_cast<std::int32_t>(place.north - place.south + 1);
  ground.goes_on = {}, ground.cut_column = ground.cut_row = 0;
  ground.curve = {}, ground.curve_up = 0;
  ground.sample_m = sample_m(plan);
  ground.code_unit = code_unit(plan);
  const std::size_t squares = ground.across() * ground.up();
  ground.squares.plane.assign(squares, {0, 0, 0, gpu::exact::kNothing});
  ground.squares.code.assign(64 * squares, 0);
  ground.squares.depth.assign(squares, gpu::exact::void_depth(gpu::exact::kFarthest));
}

Ground unknown_ground(const proto::Plan& plan) {
  Ground ground;
  make_unknown(plan, place_above(plan), ground);
  if (grid_of(plan).closes) {
    ground.goes_on[gpu::exact::kEast] = ground.goes_on[gpu::exact::kWest] = true;
    ground.cut_column = (ground.columns - 1) / 2;
  }
  return ground;
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
  turned.goes_on = ground.goes_on, turned.cut_column = ground.cut_column;
  turned.curve = ground.curve, turned.curve_up = ground.curve_up;
  turned.sample_m = ground.sample_m;
  turned.code_unit = ground.code_unit;
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

gpu::exact::BlockPlan levels_above(const proto::Plan& plan, const Ground& all) {
  gpu::exact::BlockPlan levels = levels_above(plan);
  // What blocks left out is not to be had again.
  const int least = levels_of_block(plan, static_cast<int>(plan.block_level())).levels.back().rim_reach;
  keep_narrow_data(all, least, levels);
  return levels;
}

float code_unit(const proto::Plan& plan) {
  constexpr double kShare = 1.0 / 512;
  return static_cast<float>(level_plan(plan, static_cast<int>(plan.block_level()) - 1).target() / proto::kHeightStep_m * kShare);
}

}  // namespace cordillera::pipeline
