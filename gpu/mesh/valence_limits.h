#pragma once
// Most neighbours that collapses leave a vertex. What borders and welds allow on top: rings.h.

namespace cordillera::gpu {

/// Valence caps of the waves. Four welded tiles must stay within 14: with at most 8 on a side and 4 at a corner they do. The
/// waves stay one below on the border, so that the mend finds room to take out the last border vertices.
inline constexpr int kInnerValence = 12;
inline constexpr int kVoidValence =
    9;  ///< inside holes: dense rims would fill up the few void vertices, and nothing could move there
inline constexpr int kSideValence = 7;
inline constexpr int kCornerValence = 3;

}  // namespace cordillera::gpu
