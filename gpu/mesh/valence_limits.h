#pragma once
// Most neighbours that a vertex may have, by who asks and where the vertex lies: all of these numbers are here.
#include <cstdint>

namespace cordillera::gpu {

/// With data: the contract of every published tile.
inline constexpr std::uint32_t kMostValence = 14;
/// Width of a row. Void vertices, which nobody sees, may fill it: they border dense rims.
inline constexpr std::uint32_t kRowWidth = 24;
/// Width of a row of `exact`, whose void vertices keep to the contract, too.
inline constexpr int kRingWidth = kMostValence;

/// What collapses leave inside: below the contract, so that refinement finds room.
inline constexpr int kInnerValence = 12;
/// Inside holes: dense rims would fill up the few void vertices, and nothing could move there.
inline constexpr int kVoidValence = 9;
/// On a side and at a corner that two and four meshes share, each may use as much: welded, they keep to the contract.
inline constexpr int kSharedSideValence = 8, kSharedCornerValence = 4;
/// Collapses in single tiles (gpu/cleap) stay one below, so that refinement finds room.
inline constexpr int kSideValence = kSharedSideValence - 1, kCornerValence = kSharedCornerValence - 1;

/// Void, inside, on a side and at a corner of a simplified tile: welded, they fit a row.
inline constexpr std::uint32_t kVoidInside = 20, kVoidSide = 13, kVoidCorner = 7;
/// With data, on a side and at a corner of a refined tile: welded, they fit a row, and leave room in it.
inline constexpr std::uint32_t kRefinedSide = 11, kRefinedCorner = 6;

// Two sides share two neighbours where they are welded, four corners one each.
static_assert(2 * kSharedSideValence - 2 <= kRingWidth && 4 * kSharedCornerValence - 4 <= kRingWidth);
static_assert(2 * kVoidSide - 2 <= kRowWidth && 4 * kVoidCorner - 4 <= kRowWidth);

}  // namespace cordillera::gpu
