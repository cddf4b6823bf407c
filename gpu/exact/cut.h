#pragma once
// Cuts the blocks of a call into windows: squares of a quadtree over each block, as large as a window has room for. Vertices are
// sorted into bins along a curve that runs through the quadtree, so that every square is a run of bins and its vertices are
// counted by two look-ups.
#include "gpu/device/atomic.h"
#include "gpu/exact/window_pass.h"

namespace cordillera::gpu::exact {

inline constexpr int kBinShift =
    4;  ///< a bin has 16 x 16 samples, which fit the smallest window, or more where it is known that its vertices do
/// Vertices on a window's rim wait for the next pass, so small windows leave up to a quarter more triangles. Blocks of fewer
/// samples mostly go several together on a GPU, and one alone takes some milliseconds more; a large one has smaller windows where
/// that gives so many of them.
inline constexpr std::int64_t kSamplesOfLarge = 1 << 23;
inline constexpr std::uint32_t kWindowsWanted = 132;

CORDILLERA_HD inline std::uint32_t spread_bits(std::uint32_t v) {
  v = (v | v << 8) & 0x00ff00ffu;
  v = (v | v << 4) & 0x0f0f0f0fu;
  v = (v | v << 2) & 0x33333333u;
  return (v | v << 1) & 0x55555555u;
}
CORDILLERA_HD inline void add_one(std::uint32_t* at) {
#ifdef __CUDA_ARCH__
  count_one(at);
#else
  __atomic_fetch_add(at, 1u, __ATOMIC_RELAXED);
#endif
}

/// Bits of a bin's number along one axis, with room for the shift of a pass.
inline int bin_bits_of(const Field& field, int bin_shift) {
  const int bins = std::max(field.columns, field.rows) >> bin_shift;
  int bits = 1;
  while (bins + 1 + (1 << bits) / 3 > 1 << bits) ++bits;
  return bits;
}

struct CutView {
  MeshView mesh;
  const BlockView* views = nullptr;             ///< indexed by block; where it is cut
  const std::uint32_t* first_vertex = nullptr;  ///< indexed by block; one more at the end
  std::uint32_t blocks = 0;
  int bits = 0;  ///< of the bins of the largest block, a way
  int bin_shift = kBinShift;
  int pass = 0;
  std::uint32_t* bin = nullptr;     ///< indexed by vertex
  std::uint32_t* count = nullptr;   ///< indexed by bin, one more at the end; later 1 where a window starts
  std::uint32_t* first = nullptr;   ///< indexed by bin, one more at the end: vertices before
  std::uint32_t* start = nullptr;   ///< indexed by bin: the first bin of its window
  std::uint32_t* number = nullptr;  ///< indexed by bin, one more at the end: windows before

  CORDILLERA_HD std::uint32_t block_of(std::uint32_t v) const {
    std::uint32_t low = 0, high = blocks;
    while (high - low > 1) {
      const std::uint32_t middle = (low + high) / 2;
      if (first_vertex[middle] <= v)
        low = middle;
      else
        high = middle;
    }
    return low;
  }
  CORDILLERA_HD std::uint32_t bins() const { return blocks << 2 * bits; }
  /// Of a block's squares, in bins: seams of one pass lie inside windows of the next. Thirds of every square: no seam of one pass
  /// is a seam of another. A rule of the block alone.
  CORDILLERA_HD std::uint32_t shift(std::uint32_t b) const {
    return pass == 0 ? 0 : pass == 1 ? views[b].third : views[b].third / 2;
  }
  /// Room of a window: likewise.
  CORDILLERA_HD std::uint32_t capacity(std::uint32_t block) const {
    const Field& field = views[block].field;
    if (std::int64_t{field.columns} * field.rows < kSamplesOfLarge) return kWindowCapacity;
    const std::uint32_t wanted = (first_vertex[block + 1] - first_vertex[block]) / kWindowsWanted & ~3u;
    return wanted < kSmallestWindow ? kSmallestWindow : wanted > kWindowCapacity ? kWindowCapacity : wanted;
  }
};

struct SortIntoBins {
  CutView cut;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto v = static_cast<std::uint32_t>(i);
    const std::uint32_t position = cut.mesh.position[v], block = cut.block_of(v), shift = cut.shift(block);
    const std::uint32_t x = (static_cast<std::uint32_t>(position_x(position)) >> cut.bin_shift) + shift;
    const std::uint32_t y = (static_cast<std::uint32_t>(position_y(position)) >> cut.bin_shift) + shift;
    cut.bin[v] = block << 2 * cut.bits | spread_bits(y) << 1 | spread_bits(x);
    add_one(cut.count + cut.bin[v]);
  }
};
struct FindStart {
  CutView cut;
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto bin = static_cast<std::uint32_t>(i);
    if (cut.first[bin] == cut.first[bin + 1]) return;
    const std::uint32_t most = cut.capacity(bin >> 2 * cut.bits);
    std::uint32_t start = bin;
    for (int s = 1; s <= cut.bits; ++s) {
      const std::uint32_t square = bin >> 2 * s << 2 * s;
      if (cut.first[square + (1u << 2 * s)] - cut.first[square] > most) break;
      start = square;
    }
    cut.start[bin] = start;
    set_shared(cut.count + start, 1u);
  }
};
struct NumberWindows {
  CutView cut;
  std::uint32_t* first;     ///< indexed by window
  std::uint32_t* block_of;  ///< indexed by window
  CORDILLERA_HD void operator()(std::size_t i) const {
    const auto bin = static_cast<std::uint32_t>(i);
    const std::uint32_t number = cut.number[bin];
    if (bin == cut.bins()) {
      first[number] = cut.first[bin];
    } else if (cut.number[bin + 1] != number) {
      first[number] = cut.first[bin];
      block_of[number] = bin >> 2 * cut.bits;
    }
  }
};
struct NameWindow {
  CutView cut;
  std::uint32_t* window;    ///< indexed by vertex
  std::uint32_t* vertices;  ///< 0, 1, 2 …
  CORDILLERA_HD void operator()(std::size_t v) const {
    window[v] = cut.number[cut.start[cut.bin[v]]];
    vertices[v] = static_cast<std::uint32_t>(v);
  }
};

}  // namespace cordillera::gpu::exact
