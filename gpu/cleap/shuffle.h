#pragma once
// Fisher and Yates' shuffle (Algorithm 4), on the host, one element after the other. The listing starts one behind the pool's
// end, seeds by the clock and takes rand(); ours starts at the last element, takes the seed it is given and splitmix64, so that a
// run can be repeated anywhere. Numbers that would favour some places are thrown away, as in the listing.
#include <cstdint>
#include <utility>
#include <vector>

namespace cordillera::gpu::cleap {

class Splitmix {
 public:
  explicit Splitmix(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    state_ += 0x9e3779b97f4a7c15u;
    std::uint64_t x = state_;
    x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
    x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
    return x ^ (x >> 31);
  }
  /// Below a number, all alike.
  std::uint64_t below(std::uint64_t count) {
    const std::uint64_t limit = ~std::uint64_t{0} - ~std::uint64_t{0} % count;
    std::uint64_t drawn = limit;
    while (drawn >= limit) drawn = next();
    return drawn % count;
  }

 private:
  std::uint64_t state_;
};

inline void fisher_yates(std::vector<std::uint32_t>& pool, std::uint64_t seed) {
  Splitmix random(seed);
  for (std::size_t i = pool.size(); i-- > 1;) std::swap(pool[i], pool[random.below(i + 1)]);
}

}  // namespace cordillera::gpu::cleap
