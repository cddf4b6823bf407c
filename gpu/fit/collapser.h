#pragma once
// Waves of collapses down to a count: evaluate what may have become cheap, take the cheapest share as candidates, let those
// collapse that are the least around them, several rounds of this for one evaluation.
#include <algorithm>

#include "gpu/fit/collapse_steps.h"
#include "gpu/fit/lock_steps.h"
#include "gpu/fit/quadric_cost.h"
#include "gpu/fit/recipe.h"
#include "gpu/fit/sample_cost.h"
#include "gpu/fit/threshold.h"
#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

template <class Device, class Samples>
class Collapser {
 public:
  Collapser(Device& device, WorkMesh<Device>& work, const Samples& samples)
      : device_(device), work_(work), samples_(samples), threshold_(device) {}

  /// Until so many triangles are left, or nothing more can go. error: room for a float a sample.
  void collapse(std::uint64_t target, const CollapseRules& rules, float* error, std::size_t samples);

  int waves() const { return waves_; }

 private:
  template <class T>
  using Array = typename Device::template Array<T>;
  using List = std::span<const std::uint32_t>;

  void start(bool has_planes);
  List list(Array<std::uint32_t>& to, std::size_t count) { return {to.data(), count}; }
  /// f(what finds a vertex' cheapest edge)
  template <class F>
  void with_costs(const F& f) {
    if (rules_.cost == CostOf::samples)
      f(EvaluateBySamples<Samples>{work_.mesh(), work_.wave(), samples_, error_, choice_, rules_.limit});
    else
      f(EvaluateByQuadric<Samples>{work_.mesh(), work_.wave(), samples_, choice_, rules_.limit});
  }
  void evaluate(List vertices) {
    with_costs([&](const auto& costs) { device_.each(vertices.size(), Listed{costs, vertices.data()}); });
  }
  void evaluate_stale(std::uint32_t most_class) {
    const std::size_t all = work_.ids();
    evaluate(list(stale_, device_.select(all, IsStaleUnder{work_.wave(), most_class}, work_.room(stale_, all))));
  }
  /// Winners among the candidates, whole or cut to what is still to go.
  List decide(List candidates, std::uint64_t target);
  List cut_short(List winners, std::uint64_t excess);
  std::uint64_t removed_by(List winners);
  void apply(List winners);
  bool wave(std::uint64_t target, double pool);
  void last_one();

  Device& device_;
  WorkMesh<Device>& work_;
  Samples samples_;
  Threshold<Device> threshold_;
  CollapseRules rules_;
  float* error_ = nullptr;
  EdgeChoice choice_ = EdgeChoice::all;
  std::uint32_t wave_number_ = 0, round_ = 0;
  int waves_ = 0;
  Array<std::uint32_t> stale_, candidates_, winners_, touched_, border_, removal_;
  Array<std::uint64_t> keys_;
  Array<Bid> bids_;
};

template <class Device, class Samples>
void Collapser<Device, Samples>::collapse(std::uint64_t target, const CollapseRules& rules, float* error, std::size_t samples) {
  rules_ = rules;
  error_ = error;
  if (work_.triangles() <= target) return;
  if (rules.cost == CostOf::samples) {
    device_.zero(error, samples);
    device_.each(work_.ids(), MeasureErrors<Samples>{work_.mesh(), samples_, error});
  }
  start(rules.has_planes);
  double pool = rules.pool;
  while (work_.triangles() > target + 1) {
    if (wave(target, pool))
      pool = rules.pool;
    else if (pool < 1)
      pool = 1;
    else
      break;
  }
  if (work_.triangles() == target + 1) last_one();
}

template <class Device, class Samples>
void Collapser<Device, Samples>::start(bool has_planes) {
  wave_number_ = round_ = 0;
  device_.each(work_.ids(), StartVertex{work_.mesh(), work_.wave(), has_planes});
  evaluate_stale(kCostClasses);
}

template <class Device, class Samples>
bool Collapser<Device, Samples>::wave(std::uint64_t target, double pool) {
  if (work_.close_up()) wave_number_ = round_ = 0;
  if (round_ + static_cast<std::uint32_t>(rules_.rounds) >= 0xffffu) {
    device_.each(work_.ids(), ForgetRounds{work_.wave()});
    wave_number_ = round_ = 0;
  }
  ++wave_number_;
  ++waves_;
  const std::size_t all = work_.ids();
  const std::uint32_t most = threshold_.of_share(work_.wave(), all, pool);
  evaluate_stale(most);
  const std::size_t count = device_.select(all, IsCandidateUnder{work_.wave(), most}, work_.room(candidates_, all));
  if (count == 0) return false;
  const List winners = decide(list(candidates_, count), target);
  apply(winners);
  return !winners.empty();
}

template <class Device, class Samples>
typename Collapser<Device, Samples>::List Collapser<Device, Samples>::decide(List candidates, std::uint64_t target) {
  Bid* const bids = work_.room(bids_, candidates.size());
  device_.each(candidates.size(), MakeBid{work_.mesh(), work_.wave(), candidates.data(), bids});
  for (int k = 0; k < rules_.rounds; ++k, ++round_) {
    const Lock lock{work_.mesh(), work_.wave(), bids, round_, wave_number_};
    device_.each(candidates.size(), Offer{lock});
    device_.each(candidates.size(), Decide{lock, rules_.cost == CostOf::carried_planes});
  }
  std::uint32_t* const to = work_.room(winners_, candidates.size());
  const std::size_t count = device_.select(candidates.size(), IsWinner{work_.wave(), candidates.data()}, to);
  device_.each(count, PickFrom{candidates.data(), to});
  const List winners = list(winners_, count);
  const std::uint64_t removed = removed_by(winners), excess = work_.triangles() - target;
  if (removed <= excess) {
    work_.count(-static_cast<std::int64_t>(count), -static_cast<std::int64_t>(removed));
    return winners;
  }
  return cut_short(winners, excess);
}

template <class Device, class Samples>
std::uint64_t Collapser<Device, Samples>::removed_by(List winners) {
  std::uint32_t border = 0;
  device_.zero(work_.room(border_, 1), 1);
  device_.each(winners.size(), CountBorder{work_.mesh(), work_.wave(), winners.data(), border_.data()});
  device_.copy_out(&border, border_.data(), 1);
  return 2 * winners.size() - border;
}

/// The cheapest winners, as many as the count bears.
template <class Device, class Samples>
typename Collapser<Device, Samples>::List Collapser<Device, Samples>::cut_short(List winners, std::uint64_t excess) {
  const std::size_t count = winners.size();
  device_.each(count,
               DescribeWinner{work_.mesh(), work_.wave(), winners.data(), work_.room(keys_, count), work_.room(removal_, count)});
  std::vector<std::uint64_t> keys(count);
  std::vector<std::uint32_t> removal(count), vertex(count), order(count);
  device_.copy_out(keys.data(), keys_.data(), count);
  device_.copy_out(removal.data(), removal_.data(), count);
  device_.copy_out(vertex.data(), winners.data(), count);
  for (std::uint32_t i = 0; i < count; ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&](std::uint32_t a, std::uint32_t b) { return keys[a] < keys[b]; });
  std::vector<std::uint32_t> taken;
  std::int64_t removed = 0;
  for (const std::uint32_t i : order) {
    if (static_cast<std::uint64_t>(removed) + removal[i] > excess) continue;
    removed += removal[i];
    taken.push_back(vertex[i]);
  }
  device_.each(count, ForgetWinner{work_.wave(), winners.data()});
  device_.copy_in(winners_.data(), taken.data(), taken.size());
  work_.count(-static_cast<std::int64_t>(taken.size()), -removed);
  return list(winners_, taken.size());
}

template <class Device, class Samples>
void Collapser<Device, Samples>::apply(List winners) {
  const MeshView mesh = work_.mesh();
  const WaveView wave = work_.wave();
  device_.each(winners.size(), Listed{Collapse{mesh, wave}, winners.data()});
  const std::size_t all = work_.ids();
  const List touched = list(touched_, device_.select(all, IsTouched{wave}, work_.room(touched_, all)));
  device_.each(touched.size(), Listed{MendRow{mesh, wave}, touched.data()});
  if (rules_.polish) {
    device_.each(winners.size(), Listed{Relocate<Samples>{mesh, samples_, 2, rules_.limit}, winners.data()});
  }
  if (rules_.cost == CostOf::samples) {
    device_.each(winners.size(), RenewErrors<Samples>{mesh, samples_, error_, winners.data()});
  }
  if (rules_.cost == CostOf::carried_planes)
    device_.each(winners.size(), Listed{FollowVertex{mesh, wave}, winners.data()});
  else
    device_.each(touched.size(), Listed{RenewPlanes{mesh, wave}, touched.data()});
}

/// An odd triangle is left: only a collapse along the border takes one alone.
template <class Device, class Samples>
void Collapser<Device, Samples>::last_one() {
  choice_ = EdgeChoice::border;
  const std::uint64_t target = work_.triangles() - 1;
  start(false);
  while (work_.triangles() > target && wave(target, 1)) {
  }
  choice_ = EdgeChoice::all;
}

}  // namespace cordillera::gpu::fit
