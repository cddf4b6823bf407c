#pragma once
// The pool of a pass (section 4.3): costs, the edges that are tried, the order in which they are.
#include <cmath>
#include <vector>

#include "gpu/cleap/pool.h"
#include "gpu/cleap/shuffle.h"
#include "gpu/cleap/super_independent.h"

namespace cordillera::gpu::cleap {

template <class Device>
class PoolMaker {
  template <class T>
  using Array = typename Device::template Array<T>;

 public:
  explicit PoolMaker(Device& device) : device_(device) {}

  /// Of a mesh that is connected. data() holds the edges in order.
  template <class Metric>
  std::uint32_t make(const Arrays& mesh, const Options& options, std::uint64_t pass) {
    std::uint32_t* const number = room(number_, mesh.edges);
    std::uint32_t count = mesh.edges;
    if (options.selection == Selection::unsorted) {
      device_.each(mesh.edges, NumberEdges{number});
    } else {
      std::uint64_t* const key = room(key_, mesh.edges);
      device_.each(mesh.edges, PriceEdge<Metric>{mesh, key, number});
      count = chosen(mesh, options, key, number);
    }
    shuffle(options, count, options.seed + pass);
    return count;
  }
  const std::uint32_t* data() const { return number_.data(); }

 private:
  std::uint32_t chosen(const Arrays& mesh, const Options& options, std::uint64_t* key, std::uint32_t* number) {
    const auto wanted = static_cast<std::uint32_t>(std::ceil(options.pool * mesh.edges));
    switch (options.selection) {
      case Selection::histogram:
        return static_cast<std::uint32_t>(device_.select(mesh.edges, IsCheap{key, threshold(mesh, key, wanted)}, number));
      case Selection::vertex_best: {
        std::uint64_t* const best = room(best_, mesh.vertices);
        device_.each(mesh.vertices, ForgetBest{best});
        device_.each(mesh.edges, OfferToEnds{mesh, key, best});
        return static_cast<std::uint32_t>(device_.select(mesh.edges, IsBestAtBothEnds{mesh, best}, number));
      }
      case Selection::super_independent:
        return centres(mesh, OfferCheap{{mesh, key, room(best_, mesh.vertices)}, threshold(mesh, key, wanted)}, number);
      default:
        device_.sort_by_key(key, number, mesh.edges);
        return std::isinf(options.most_cost) ? wanted : std::min(wanted, within(mesh, key, options.most_cost));
    }
  }

  std::uint32_t within(const Arrays& mesh, const std::uint64_t* key, double most_cost) {
    std::uint32_t *const bins = room(bins_, kCostClasses), found[2] = {};
    device_.zero(bins, 2);
    device_.histogram(mesh.edges, IsDearer{key, std::bit_cast<std::uint32_t>(static_cast<float>(most_cost))}, bins, 2);
    device_.copy_out(found, bins, 2);
    return found[0];
  }

  std::uint32_t centres(const Arrays& mesh, const OfferCheap& offers, std::uint32_t* number) {
    std::uint64_t* const offer = offers.offer.best;
    std::uint64_t *const near = room(least_[0], mesh.vertices), *const far = room(least_[1], mesh.vertices);
    std::uint8_t* const state = room(state_, mesh.vertices);
    std::uint8_t *const first = room(near_[0], mesh.vertices), *const second = room(near_[1], mesh.vertices);
    std::uint32_t* const any = room(bins_, kCostClasses);
    device_.each(mesh.vertices, ForgetBest{offer});
    device_.each(mesh.edges, offers);
    device_.zero(state, mesh.vertices);
    for (std::uint32_t some = 1; some > 0;) {
      device_.zero(any, 1);
      device_.each(mesh.vertices, LeastAround{mesh, offer, state, near});
      device_.each(mesh.vertices, LeastAround{mesh, near, nullptr, far});
      device_.each(mesh.vertices, BecomeCentre{offer, far, state, any});
      device_.each(mesh.vertices, IsNear{mesh, state, kCentre, first});
      device_.each(mesh.vertices, IsNear{mesh, first, 1, second});
      device_.each(mesh.vertices, SetAside{second, state});
      device_.copy_out(&some, any, 1);
    }
    return static_cast<std::uint32_t>(device_.select(mesh.edges, IsOfCentre{mesh, offer, state}, number));
  }

  /// The class up to which so many edges lie, at least.
  std::uint32_t threshold(const Arrays& mesh, const std::uint64_t* key, std::uint32_t wanted) {
    std::uint32_t* const bins = room(bins_, kCostClasses);
    device_.zero(bins, kCostClasses);
    device_.histogram(mesh.edges, ClassOfKey{key}, bins, kCostClasses);
    std::vector<std::uint32_t> found(kCostClasses);
    device_.copy_out(found.data(), bins, kCostClasses);
    std::uint32_t sum = 0, k = 0;
    while (k + 1 < kCostClasses && (sum += found[k]) < wanted) ++k;
    return k;
  }

  void shuffle(const Options& options, std::uint32_t count, std::uint64_t seed) {
    if (options.shuffle == Shuffle::none || count < 2) return;
    if (options.shuffle == Shuffle::keyed) {
      device_.each(count, Permute{KeyedPermutation(count, seed), number_.data(), room(shuffled_, count)});
      std::swap(number_, shuffled_);
      return;
    }
    std::vector<std::uint32_t> pool(count);
    device_.copy_out(pool.data(), number_.data(), count);
    fisher_yates(pool, seed);
    device_.copy_in(number_.data(), pool.data(), count);
    device_.copy_out(pool.data(), number_.data(), 1);  // the copy may not outlive the vector
  }
  Device& device_;
  Array<std::uint64_t> key_, best_, least_[2];
  Array<std::uint8_t> state_, near_[2];
  Array<std::uint32_t> number_, shuffled_, bins_;
};

}  // namespace cordillera::gpu::cleap
