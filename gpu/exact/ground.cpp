#include "gpu/exact/ground.h"

#include <algorithm>
#include <array>
#include <string>

#include "gpu/exact/cut.h"

namespace cordillera::gpu::exact {
namespace {

/// From the nearest square with has(its depth); kMost: farther than was looked.
template <class Has>
std::vector<std::uint16_t> squares_apart(const Ground& ground, const std::vector<Depth>& depths, const Has& has) {
  constexpr std::uint16_t kMost = 1 << 14;
  if (depths.empty()) return {};
  const auto across = static_cast<std::int32_t>(ground.across()), up = static_cast<std::int32_t>(ground.up());
  std::vector<std::uint16_t> apart(depths.size());
  const auto at = [&](std::int32_t x, std::int32_t y) -> std::uint16_t {
    return x < 0 || y < 0 || x >= across || y >= up
               ? kMost
               : apart[static_cast<std::size_t>(y) * static_cast<std::size_t>(across) + static_cast<std::size_t>(x)];
  };
  for (std::size_t i = 0; i < depths.size(); ++i) apart[i] = has(depths[i]) ? 0 : kMost;
  // Neighbours before a square, then those after it: exact where a step goes to any of eight.
  const auto sweep = [&](std::int32_t x, std::int32_t y, std::int32_t row) {
    std::uint16_t& here = apart[static_cast<std::size_t>(y) * static_cast<std::size_t>(across) + static_cast<std::size_t>(x)];
    for (const std::uint16_t near : {at(x + row, y), at(x - 1, y + row), at(x, y + row), at(x + 1, y + row)})
      here = std::min<std::uint16_t>(here, near + 1);
  };
  for (std::int32_t y = 0; y < up; ++y)
    for (std::int32_t x = 0; x < across; ++x) sweep(x, y, -1);
  for (std::int32_t y = up; y-- > 0;)
    for (std::int32_t x = across; x-- > 0;) sweep(x, y, 1);
  return apart;
}

/// Samples of squares so far apart are within 2^r of each other; the least such r.
int reach_of(std::uint16_t apart) {
  int r = 3;
  while (r < kFarthest && (1 << (r - 3)) < apart + 1) ++r;
  return r;
}

proto::Problem invalid(std::string detail) {
  return {"option-invalid", std::move(detail), "a triangulation of the rectangle", "start"};
}

/// The neighbours of a vertex, from two after one another in each triangle.
class Fan {
 public:
  bool add(std::uint32_t from, std::uint32_t to) {
    if (count_ == kRingWidth) return false;
    pairs_[count_++] = {from, to};
    return true;
  }
  /// Counter-clockwise; a closed one from its least neighbour on. 0: they are no fan.
  int order(bool open, std::uint32_t* ring) const {
    if (count_ == 0) return 0;
    std::uint32_t at = pairs_[0][0];
    for (std::size_t k = 1; k < count_; ++k) at = open ? at : std::min(at, pairs_[k][0]);
    if (open) {
      for (std::size_t k = 0; k < count_; ++k) {
        bool begins = true;
        for (std::size_t j = 0; j < count_; ++j) begins = begins && pairs_[j][1] != pairs_[k][0];
        if (begins) at = pairs_[k][0];
      }
    }
    int length = 0;
    for (std::size_t step = 0; step < count_; ++step) {
      const auto next = std::find_if(pairs_.begin(), pairs_.begin() + count_, [at](const auto& pair) { return pair[0] == at; });
      if (next == pairs_.begin() + count_) return 0;
      ring[length++] = at;
      at = (*next)[1];
    }
    if (!open) return at == ring[0] ? length : 0;
    if (length == kRingWidth) return 0;
    ring[length++] = at;
    return length;
  }

 private:
  std::array<std::array<std::uint32_t, 2>, kRingWidth> pairs_{};
  std::size_t count_ = 0;
};

}  // namespace

std::vector<std::uint16_t> squares_to_valid(const Ground& ground) {
  return squares_apart(ground, ground.squares.depth, [](Depth depth) { return has_deep_valid(depth, -1); });
}
std::vector<std::uint16_t> squares_to_void(const Ground& ground) {
  return squares_apart(ground, ground.squares.depth, [](Depth depth) { return has_deep_void(depth, -1); });
}

std::vector<Depth> joined_depths(const Ground& ground, int reach, std::span<const std::uint16_t> to_valid,
                                 std::span<const std::uint16_t> to_void) {
  std::vector<Depth> depths = ground.squares.depth;
  for (std::size_t i = 0; i < depths.size(); ++i) {
    const auto nearer = [&](int known, std::uint16_t apart) {
      const int r = reach_of(apart);
      return r <= reach ? std::min(known, r + 1) : known;
    };
    depths[i] = static_cast<Depth>(nearer(depths[i] & 15, to_void[i]) | nearer(depths[i] >> 4, to_valid[i]) << 4);
  }
  return depths;
}

int reach_of_narrow_data(const Ground& ground, int least, int most) {
  constexpr std::size_t kMostSquares = 1 << 17;  // of more of it coarse tiles would be too large
  const auto has_data = [](Depth depth) { return has_deep_valid(depth, -1); };
  const auto with_data = static_cast<std::size_t>(std::ranges::count_if(ground.squares.depth, has_data));
  if (with_data == 0 || with_data > kMostSquares || most <= std::max(least, 1)) return most;
  const std::vector<Depth> depths = joined_depths(ground, most, squares_to_valid(ground), squares_to_void(ground));
  int reach = most;
  // The rim of a void is 2^reach samples from what is deep in it.
  const auto half_stays = [&] {
    const auto apart = squares_apart(ground, depths, [reach](Depth depth) { return has_deep_void(depth, reach); });
    std::size_t stays = 0;
    for (std::size_t i = 0; i < depths.size(); ++i) stays += has_data(depths[i]) && 8 * apart[i] > 2 << reach ? 1 : 0;
    return 2 * stays >= with_data;
  };
  while (reach > least && !half_stays()) --reach;
  return reach == 1 ? least : reach;  // squares of 8 samples do not tell what a rim that moves by two would leave
}

proto::Result<RingMesh> ring_mesh(const BlockMesh& mesh, std::int32_t columns, std::int32_t rows) {
  const std::size_t n = mesh.vertices();
  std::vector<Fan> fans(n);
  for (const auto& t : mesh.triangles) {
    for (std::size_t k = 0; k < 3; ++k) {
      if (t[k] >= n) return invalid("a triangle of the start names a vertex that is not there");
      if (!fans[t[k]].add(t[(k + 1) % 3], t[(k + 2) % 3])) return invalid("a vertex of the start has more than 14 triangles");
    }
  }
  RingMesh rings;
  rings.ring.resize(n * kRingWidth);
  rings.valence.resize(n);
  for (std::size_t v = 0; v < n; ++v) {
    const bool open = mesh.x[v] == 0 || mesh.y[v] == 0 || mesh.x[v] == columns - 1 || mesh.y[v] == rows - 1;
    const int valence = fans[v].order(open, rings.ring.data() + v * kRingWidth);
    if (valence == 0)
      return invalid("triangles around vertex " + std::to_string(v) + " of the start are not one fan of at most 14 neighbours");
    rings.valence[v] = static_cast<std::uint8_t>(valence);
    rings.position.push_back(pack_position(mesh.x[v], mesh.y[v]));
    rings.height.push_back(static_cast<float>(mesh.height[v]));
    rings.mark.push_back(mesh.is_void[v] ? kVoidVertex : 0);
  }
  return rings;
}

int bin_shift_for(const Field& field, std::span<const std::uint32_t> positions) {
  constexpr int kMostShift = 8, kManyBits = 11;  // of bins, a way
  constexpr std::uint32_t kBinsOfWindow = 16;    // or seams, which lie between bins, would be the same in every pass
  for (int shift = kMostShift; shift > kBinShift; --shift) {
    const std::uint32_t room = bin_bits_of(field, shift) < kManyBits ? kSmallestWindow / kBinsOfWindow : kSmallestWindow;
    const std::size_t across = (static_cast<std::size_t>(field.columns) >> shift) + 1,
                      up = (static_cast<std::size_t>(field.rows) >> shift) + 1;
    std::vector<std::uint32_t> count(across * up, 0);
    const auto bin_of = [&](std::uint32_t p) {
      return static_cast<std::size_t>(position_y(p) >> shift) * across + static_cast<std::size_t>(position_x(p) >> shift);
    };
    if (std::all_of(positions.begin(), positions.end(), [&](std::uint32_t p) { return ++count[bin_of(p)] <= room; }))
      return shift;
  }
  return kBinShift;
}

}  // namespace cordillera::gpu::exact
