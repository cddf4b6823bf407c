#include "raster/mosaic/grid_neighbours.h"

#include <algorithm>

#include "raster/pixels/decimation.h"

namespace cordillera::raster {
namespace {

/// All of a member's pixels, without opening it.
PixelWindow pixels_of(const MosaicMember& member) {
  if (member.decimation) return {0, 0, member.decimation->columns, member.decimation->rows};
  return {0, 0, static_cast<int>(member.description.columns()), static_cast<int>(member.description.rows())};
}

}  // namespace

const std::vector<GridNeighbour>& GridNeighbours::of(std::size_t member) {
  const auto known = known_.find(member);
  if (known != known_.end()) return known->second;
  constexpr std::int64_t kBeside = 2;
  const MosaicMember& own = members_[member];
  std::vector<GridNeighbour> found;
  for (std::size_t k = 0; k < members_.size(); ++k) {
    const MosaicMember& next = members_[k];
    // One that is blended with this one is no part of it.
    if (k == member || sheet_of(k) != sheet_of(member) || !may_share_grid(own.description, next.description)) continue;
    // Half a pixel is open between points and areas, and a whole one between points.
    const std::int64_t apart =
        reach_of_points(is_of_points(own.description) ? own.description : next.description, kMemberLattice);
    if (!touch(next.window, widened(own.window, kBeside + apart), kMemberLattice)) continue;
    const auto shift = shift_on_grid(own.grid, next.grid);
    if (!shift || lies_within(pixels_of(next), *shift, pixels_of(own))) continue;
    found.push_back({k, *shift, pixels_of(next)});
  }
  return known_[member] = std::move(found);
}

const GridNeighbour* GridNeighbours::next(std::size_t member, std::size_t other) {
  if (last_.member == member && last_.other == other) return last_.next;
  const auto& all = of(member);
  const auto found = std::ranges::find(all, other, &GridNeighbour::member);
  last_ = {member, other, found == all.end() ? nullptr : &*found};
  return last_.next;
}

bool GridNeighbours::reads_across(std::size_t member, std::size_t other, const PixelNumber& pixel) {
  const GridNeighbour* const there = next(member, other);
  if (there == nullptr) return false;
  // Centres, in pixels of the files: of a raster that is thinned out one of them stands for many.
  const auto& thin = members_[other].decimation;
  const double across = thin ? 1.0 * thin->covered_columns / thin->columns : 1,
               down = thin ? 1.0 * members_[other].description.rows() / thin->rows : 1;
  const double x = static_cast<double>(there->shift.x) + (pixel.column + 0.5) * across,
               y = static_cast<double>(there->shift.y) + (pixel.row + 0.5) * down;
  const proto::Source& own = members_[member].description;
  return !(x >= 0 && x < own.columns() && y >= 0 && y < own.rows());
}

std::optional<PixelNumber> GridNeighbours::number_in(std::size_t member, std::size_t other, const PixelNumber& pixel) {
  const GridNeighbour* const there = next(member, other);
  if (there == nullptr || members_[member].decimation || members_[other].decimation) return std::nullopt;
  const std::int64_t column = there->shift.x + pixel.column, row = there->shift.y + pixel.row;
  const PixelWindow own = pixels_of(members_[member]);
  if (column < 0 || column >= own.columns || row < 0 || row >= own.rows) return std::nullopt;
  return PixelNumber{static_cast<std::int32_t>(column), static_cast<std::int32_t>(row)};
}

}  // namespace cordillera::raster
