#pragma once
// A source whose voids are filled where data encloses them.
#include <memory>

#include "cordillera.pb.h"
#include "raster/source.h"

namespace cordillera::raster {

/// Widest and highest void that is filled, in cells of the lattice asked for.
inline constexpr std::uint32_t kFillLimit_cells = 512;
inline constexpr std::uint32_t kGreatestFillLimit_cells = 1024;

/// The widest void that a build fills by its options, in cells; 0: none. Options have been checked.
std::uint32_t fill_limit_cells(const proto::BuildOptions& options);

/// How far a vertex's fill looks around it, in vertices, when voids up to the limit are filled.
std::int64_t fill_reach(std::uint32_t limit_cells);

/// The same source, but void vertices of the lattice have heights where data encloses them: a void is a set of vertices without
/// data, each beside (not across) another; it is filled when it is at most limit_cells wide and high, does not reach the rim of
/// the source's window, and no pole. All others stay void. A fill depends on the void and the vertices up to two around it alone,
/// so that windows, threads and machines see the same. Filled samples are marked kFilledVoid. limit_cells: 0 gives the source
/// itself; at most kGreatestFillLimit_cells. Memory: some 10 MB for what was read lately, and while a void is filled 90 bytes a
/// cell of the rectangle around it (25 MB for 512 x 512). nearest() and pixels() are those of the source: nothing is known of a
/// filled place.
std::unique_ptr<Source> fill_enclosed_voids(std::unique_ptr<Source> source, std::uint32_t limit_cells);

}  // namespace cordillera::raster
