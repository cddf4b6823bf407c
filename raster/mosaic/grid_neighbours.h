#pragma once
// Which members of a mosaic go on with each other's grid, found when it is first asked, and where pixels of one lie for another.
#include <cstddef>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "raster/mosaic/mosaic.h"
#include "raster/mosaic/same_grid.h"

namespace cordillera::raster {

/// One thread's: it remembers.
class GridNeighbours {
 public:
  /// members, and their sheets (see sheets_of; empty: nothing is blended): they outlive this.
  GridNeighbours(std::span<const MosaicMember> members, std::span<const std::size_t> sheets)
      : members_(members), sheets_(sheets) {}

  /// The members whose pixels go on those of this one.
  const std::vector<GridNeighbour>& of(std::size_t member);
  /// Whether another member's pixels do.
  bool goes_on(std::size_t member, std::size_t other) { return next(member, other) != nullptr; }
  /// Whether a member's heights are interpolated to a pixel of another: it goes on there, and has none itself.
  bool reads_across(std::size_t member, std::size_t other, const PixelNumber& pixel);
  /// The number that the pixel of another has in a member, where it goes on that and lies on it in part; none elsewhere, and of
  /// those that are thinned out.
  std::optional<PixelNumber> number_in(std::size_t member, std::size_t other, const PixelNumber& pixel);

 private:
  const GridNeighbour* next(std::size_t member, std::size_t other);
  std::size_t sheet_of(std::size_t member) const { return sheets_.empty() ? 0 : sheets_[member]; }

  std::span<const MosaicMember> members_;
  std::span<const std::size_t> sheets_;
  std::map<std::size_t, std::vector<GridNeighbour>> known_;  ///< by member, of those that were asked for
  struct Pair {
    std::size_t member = SIZE_MAX, other = SIZE_MAX;
    const GridNeighbour* next = nullptr;
  } last_;  ///< that was asked for: pixels that lie beside each other ask for the same
};

}  // namespace cordillera::raster
