#include "raster/mosaic/sheets.h"

#include <algorithm>
#include <cstdint>

#include "raster/mosaic/same_grid.h"

namespace cordillera::raster {
namespace {

// Tiles of SRTM share a row. With two rows more are cut by tools that take care of seams.
constexpr std::int64_t kMostShared_px = 2;

/// Pixels that both have along one direction; shift: of the second one's first.
std::int64_t shared(std::int64_t first, std::int64_t second, std::int64_t shift) {
  return std::min(first, shift + second) - std::max<std::int64_t>(0, shift);
}

bool is_next_sheet(const MosaicMember& a, const MosaicMember& b) {
  if (!may_share_grid(a.description, b.description)) return false;
  const auto shift = shift_on_grid(a.grid, b.grid);
  return shift && (shared(a.description.columns(), b.description.columns(), shift->x) <= kMostShared_px ||
                   shared(a.description.rows(), b.description.rows(), shift->y) <= kMostShared_px);
}

}  // namespace

std::vector<std::size_t> sheets_of(const std::vector<MosaicMember>& members) {
  std::vector<std::size_t> first(members.size());
  for (std::size_t k = 0; k < members.size(); ++k) {
    first[k] = k == 0 ? 0 : first[k - 1];
    for (std::size_t sheet = first[k]; sheet < k; ++sheet) {
      if (is_next_sheet(members[sheet], members[k])) continue;
      first[k] = k;
      break;
    }
  }
  return first;
}

}  // namespace cordillera::raster
