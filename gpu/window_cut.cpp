#include "gpu/window_cut.h"

#include <algorithm>
#include <array>

namespace cordillera::gpu {
namespace {

struct Box {
  std::int64_t west = 0, south = 0, size = 0;
};

struct Cutter {
  const std::int32_t* x;
  const std::int32_t* y;
  std::uint32_t tile;
  WindowCut* cut;
  std::vector<std::uint32_t> scratch;

  void split(std::span<std::uint32_t> vertices, const Box& box) {
    if (vertices.empty()) return;
    if (vertices.size() <= kWindowVertices || box.size <= 1) {
      emit(vertices);
      return;
    }
    const std::int64_t half = box.size / 2;
    const std::int64_t middle_x = box.west + half, middle_y = box.south + half;
    const auto quarter = [&](std::uint32_t v) { return (x[v] >= middle_x ? 1u : 0u) | (y[v] >= middle_y ? 2u : 0u); };
    std::array<std::size_t, 5> start{};
    for (const std::uint32_t v : vertices) ++start[quarter(v) + 1];
    for (int q = 1; q < 5; ++q) start[q] += start[q - 1];
    scratch.resize(vertices.size());
    std::array<std::size_t, 4> at{start[0], start[1], start[2], start[3]};
    for (const std::uint32_t v : vertices) scratch[at[quarter(v)]++] = v;
    std::copy(scratch.begin(), scratch.end(), vertices.begin());
    for (unsigned q = 0; q < 4; ++q) {
      const Box child{q & 1 ? middle_x : box.west, q & 2 ? middle_y : box.south, box.size - half};
      split(vertices.subspan(start[q], start[q + 1] - start[q]), child);
    }
  }

  void emit(std::span<const std::uint32_t> vertices) {
    cut->windows.push_back({static_cast<std::uint32_t>(cut->order.size()), static_cast<std::uint32_t>(vertices.size()), tile});
    cut->order.insert(cut->order.end(), vertices.begin(), vertices.end());
  }
};

}  // namespace

void cut_windows(std::span<const std::uint32_t> alive, const std::int32_t* x, const std::int32_t* y, std::int32_t side, int pass,
                 std::uint32_t tile, WindowCut& cut) {
  std::vector<std::uint32_t> vertices(alive.begin(), alive.end());
  Cutter cutter{x, y, tile, &cut, {}};
  const std::int64_t shift = pass == 0 ? 0 : std::int64_t{side} * (3 - pass % 3) / 3;
  cutter.split(vertices, pass == 0 ? Box{0, 0, side} : Box{-shift, -shift, 2 * std::int64_t{side}});
}

}  // namespace cordillera::gpu
