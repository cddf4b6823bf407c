#pragma once
// Cuts a tile's mesh into windows: a quadtree over the tile, split until a leaf holds at most kWindowVertices, so that windows are as
// small as dense terrain needs and as large as plain terrain allows.
#include <cstdint>
#include <span>
#include <vector>

#include "gpu/window_pass.h"

namespace cordillera::gpu {

struct WindowCut {
  std::vector<std::uint32_t> order;   ///< vertices of the batch, window by window; ascending within a window
  std::vector<WindowRange> windows;
};

/// Appends the windows of one tile. alive: its vertices, ascending. pass 0 is aligned with the tile; passes 1 and 2 are shifted by one
/// and two thirds of the tile, so that at every leaf size no seam of one pass is a seam of another.
void cut_windows(std::span<const std::uint32_t> alive, const std::int32_t* x, const std::int32_t* y, std::int32_t side, int pass,
                 std::uint32_t tile, WindowCut& cut);

}  // namespace cordillera::gpu
