#pragma once
// Which edges are tried (section 4.3 and its future work): the cheapest by a sort, by a threshold, the best at both their ends,
// or any.
#include <bit>

#include "gpu/cleap/metrics.h"
#include "gpu/device/atomic.h"
#include "gpu/device/bits.h"

namespace cordillera::gpu::cleap {

/// By edge: its cost as a key that sorts like it. Bits of a float that is not negative do.
template <class Metric>
struct PriceEdge {
  Arrays mesh;
  std::uint64_t* key;
  std::uint32_t* number;
  CORDILLERA_HD void operator()(std::size_t e) const {
    const auto cost = static_cast<float>(Metric::cost(mesh, mesh.edge[e]));
    key[e] = std::bit_cast<std::uint32_t>(cost > 0 ? cost : 0.0f);
    number[e] = static_cast<std::uint32_t>(e);
  }
};
struct NumberEdges {
  std::uint32_t* number;
  CORDILLERA_HD void operator()(std::size_t e) const { number[e] = static_cast<std::uint32_t>(e); }
};

/// Classes of cost: exponent and four bits more, so within 1/16.
inline constexpr std::size_t kCostClasses = 4096;
CORDILLERA_HD inline std::uint32_t class_of_key(std::uint64_t key) { return static_cast<std::uint32_t>(key >> 19) & 0xfffu; }
struct ClassOfKey {
  const std::uint64_t* key;
  CORDILLERA_HD std::uint32_t operator()(std::size_t e) const { return class_of_key(key[e]); }
};
struct IsDearer {
  const std::uint64_t* key;
  std::uint32_t most;
  CORDILLERA_HD std::uint32_t operator()(std::size_t e) const { return key[e] > most ? 1 : 0; }
};
struct IsCheap {
  const std::uint64_t* key;
  std::uint32_t most;
  CORDILLERA_HD bool operator()(std::uint32_t e) const { return class_of_key(key[e]) <= most; }
};

/// One to one. On flat ground edges cost the same, and those that lie in a row are numbered in a row: by number, only the first
/// of it would be anybody's best.
CORDILLERA_HD inline std::uint32_t scattered(std::uint32_t e) { return hash32(e); }
/// By edge: both ends learn of it. Best: indexed by vertex, the least of cost and scattered number.
struct OfferToEnds {
  Arrays mesh;
  const std::uint64_t* key;
  std::uint64_t* best;
  CORDILLERA_HD void operator()(std::size_t e) const {
    const std::uint64_t offer = key[e] << 32 | scattered(static_cast<std::uint32_t>(e));
    for (int k = 0; k < 2; ++k) lower_to(best + mesh.edge[e].n[k], offer);
  }
};
struct ForgetBest {
  std::uint64_t* best;
  CORDILLERA_HD void operator()(std::size_t v) const { best[v] = ~std::uint64_t{0}; }
};
struct IsBestAtBothEnds {
  Arrays mesh;
  const std::uint64_t* best;
  CORDILLERA_HD bool operator()(std::uint32_t e) const {
    const Edge& edge = mesh.edge[e];
    const std::uint32_t number = scattered(e);
    return static_cast<std::uint32_t>(best[edge.n[0]]) == number && static_cast<std::uint32_t>(best[edge.n[1]]) == number;
  }
};

/// A permutation of 0..count-1 that any place can be asked for: four rounds of a Feistel network over a square, walked on until
/// it is inside.
class KeyedPermutation {
 public:
  KeyedPermutation() = default;
  KeyedPermutation(std::uint32_t count, std::uint64_t seed) : count_(count) {
    const int bits = std::bit_width(count > 1 ? count - 1 : 1u);
    half_bits_ = static_cast<std::uint32_t>(bits + 1) / 2;
    for (std::uint32_t round = 0; round < kRounds; ++round) key_[round] = mixed(seed + (round + 1) * 0x9e3779b97f4a7c15u);
  }
  CORDILLERA_HD std::uint32_t operator()(std::uint32_t i) const {
    std::uint32_t at = i;
    do at = once(at);
    while (at >= count_);
    return at;
  }

 private:
  static constexpr std::uint32_t kRounds = 4;
  CORDILLERA_HD static std::uint64_t mixed(std::uint64_t x) {
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  }
  CORDILLERA_HD std::uint32_t once(std::uint32_t i) const {
    const std::uint32_t mask = (1u << half_bits_) - 1;
    std::uint32_t high = i >> half_bits_, low = i & mask;
    for (std::uint32_t round = 0; round < kRounds; ++round) {
      const std::uint32_t next = high ^ (static_cast<std::uint32_t>(mixed(key_[round] ^ low)) & mask);
      high = low;
      low = next;
    }
    return high << half_bits_ | low;
  }

  std::uint32_t count_ = 0, half_bits_ = 1;
  std::uint64_t key_[kRounds] = {};
};

struct Permute {
  KeyedPermutation permutation;
  const std::uint32_t* from;
  std::uint32_t* to;
  CORDILLERA_HD void operator()(std::size_t i) const { to[i] = from[permutation(static_cast<std::uint32_t>(i))]; }
};

}  // namespace cordillera::gpu::cleap
