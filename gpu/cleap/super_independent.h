#pragma once
// Papageorgiou and Platis' selection (section 3.3.3): vertices at least three edges apart, so that their stars share nothing; of
// each, its cheapest edge. Theirs is a greedy set, cheapest vertex first, one after the other. Ours takes all vertices at once
// whose edge is the cheapest within two edges around, sets aside what is that close to them, and looks again until nobody is
// left: what greed finds, too.
#include "gpu/cleap/pool.h"

namespace cordillera::gpu::cleap {

enum CentreState : std::uint8_t { kOpen = 0, kSetAside = 1, kCentre = 2 };

inline constexpr std::uint64_t kNoOffer = ~std::uint64_t{0};

/// By edge: as OfferToEnds, but only edges within a share of the cheapest are offered.
struct OfferCheap {
  OfferToEnds offer;
  std::uint32_t most;  ///< class of cost
  CORDILLERA_HD void operator()(std::size_t e) const {
    if (class_of_key(offer.key[e]) <= most) offer(e);
  }
};

/// f(v, and its neighbours).
template <class F>
CORDILLERA_HD void each_around(const Arrays& mesh, std::int32_t v, const F& f) {
  all_triangles_at(mesh, v, [&](std::int32_t triangle) {
    for (int k = 0; k < 3; ++k) f(mesh.corner[3 * triangle + k]);
    return true;
  });
}

/// By vertex: the least offer around; those that are not open have none.
struct LeastAround {
  Arrays mesh;
  const std::uint64_t* offer;
  const std::uint8_t* state;  ///< null: asked already
  std::uint64_t* least;
  CORDILLERA_HD void operator()(std::size_t v) const {
    std::uint64_t found = kNoOffer;
    each_around(mesh, static_cast<std::int32_t>(v), [&](std::int32_t w) {
      if ((!state || state[w] == kOpen) && offer[w] < found) found = offer[w];
    });
    least[v] = found;
  }
};
/// By vertex: nobody within two edges has a lesser offer. Both ends of one edge may be centres of it.
struct BecomeCentre {
  const std::uint64_t* offer;
  const std::uint64_t* least;
  std::uint8_t* state;
  std::uint32_t* any;
  CORDILLERA_HD void operator()(std::size_t v) const {
    if (state[v] != kOpen || offer[v] == kNoOffer || least[v] != offer[v]) return;
    state[v] = kCentre;
    raise_to(any, 1);
  }
};
/// By vertex, twice: who is next to a centre, and then next to those.
struct IsNear {
  Arrays mesh;
  const std::uint8_t* from;  ///< states, or what the first time found
  std::uint8_t which;
  std::uint8_t* near;
  CORDILLERA_HD void operator()(std::size_t v) const {
    std::uint8_t found = 0;
    each_around(mesh, static_cast<std::int32_t>(v), [&](std::int32_t w) {
      if (from[w] == which) found = 1;
    });
    near[v] = found;
  }
};
struct SetAside {
  const std::uint8_t* near;
  std::uint8_t* state;
  CORDILLERA_HD void operator()(std::size_t v) const {
    if (near[v] && state[v] == kOpen) state[v] = kSetAside;
  }
};
struct IsOfCentre {
  Arrays mesh;
  const std::uint64_t* offer;
  const std::uint8_t* state;
  CORDILLERA_HD bool operator()(std::uint32_t e) const {
    for (int k = 0; k < 2; ++k) {
      const std::int32_t v = mesh.edge[e].n[k];
      if (state[v] == kCentre && static_cast<std::uint32_t>(offer[v]) == scattered(e)) return true;
    }
    return false;
  }
};

}  // namespace cordillera::gpu::cleap
