#include "raster/mosaic/window_index.h"

#include <algorithm>
#include <utility>

#include "proto/integers.h"
#include "raster/mosaic/mosaic.h"

namespace cordillera::raster {
namespace {

constexpr int kIndexLevel = 7;  // a tile of it is 1.4 degrees wide: a one-degree cell lies in four cells of the index at most
constexpr std::int64_t kMostCells = 64;  // of a window that is listed in each of them

using proto::floor_divide;
using proto::modulo;

bool is_empty(const Source::Window& w) { return w.west > w.east || w.south > w.north; }

}  // namespace

WindowIndex::WindowIndex(std::vector<Source::Window> windows, const proto::Lattice& lattice)
    : windows_(std::move(windows)), lattice_(lattice) {
  const int level = std::min(kIndexLevel, lattice.finest_level);
  across_ = proto::tiles_across(level);
  up_ = proto::tiles_up(level);
  units_ = lattice.tile_units(level);
  cells_.resize(static_cast<std::size_t>(across_ * up_));
  for (std::size_t k = 0; k < windows_.size(); ++k) {
    if (is_empty(windows_[k])) continue;
    const auto number = static_cast<std::uint32_t>(k);
    if (cells_of(windows_[k]) > kMostCells) {
      large_.push_back(number);
    } else {
      each_cell(windows_[k], [&](std::size_t cell) { cells_[cell].push_back(number); });
    }
  }
}

std::int64_t WindowIndex::cells_of(const Source::Window& window) const {
  const std::int64_t columns = floor_divide(window.east, units_) - floor_divide(window.west, units_) + 1;
  return std::min(columns, across_) * (floor_divide(window.north, units_) - floor_divide(window.south, units_) + 1);
}

template <typename Visit>
void WindowIndex::each_cell(const Source::Window& window, Visit visit) const {
  const std::int64_t west = floor_divide(window.west, units_),
                     east = std::min(floor_divide(window.east, units_), west + across_ - 1);
  // The northernmost row of vertices lies on the rim of the last row of cells; beyond the poles there is nothing.
  const std::int64_t south = std::clamp<std::int64_t>(floor_divide(window.south, units_), 0, up_ - 1);
  const std::int64_t north = std::clamp<std::int64_t>(floor_divide(window.north, units_), 0, up_ - 1);
  for (std::int64_t row = south; row <= north; ++row) {
    for (std::int64_t column = west; column <= east; ++column) {
      visit(static_cast<std::size_t>(row * across_ + proto::modulo(column, across_)));
    }
  }
}

std::vector<std::uint32_t> WindowIndex::touching(const Source::Window& window) const {
  std::vector<std::uint32_t> found;
  if (is_empty(window)) return found;
  const auto try_one = [&](std::uint32_t k) {
    if (touch(windows_[k], window, lattice_)) found.push_back(k);
  };
  for (const std::uint32_t k : large_) try_one(k);
  each_cell(window, [&](std::size_t cell) {
    for (const std::uint32_t k : cells_[cell]) try_one(k);
  });
  std::sort(found.begin(), found.end());
  found.erase(std::unique(found.begin(), found.end()), found.end());
  return found;
}

Source::Window hull(std::vector<Source::Window> windows, std::int64_t circle) {
  std::sort(windows.begin(), windows.end(), [](const Source::Window& a, const Source::Window& b) { return a.west < b.west; });
  Source::Window all = windows.front();
  std::int64_t reach = all.east, gap = -1, from = all.west, to = all.east;
  for (const Source::Window& w : windows) {
    all.south = std::min(all.south, w.south);
    all.north = std::max(all.north, w.north);
    if (w.west - reach > gap && &w != &windows.front()) {
      gap = w.west - reach;
      from = w.west;
      to = reach + circle;
    }
    reach = std::max(reach, w.east);
  }
  // What is open between the last and, once round, the first.
  if (windows.front().west + circle - reach >= gap) from = windows.front().west, to = reach;
  const std::int64_t turn = from - modulo(from, circle);
  all.west = from - turn;
  all.east = std::min(to - turn, all.west + circle);
  return all;
}

}  // namespace cordillera::raster
