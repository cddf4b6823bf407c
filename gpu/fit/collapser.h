#pragma once
// Waves of collapses down to a count: evaluate what may have become cheap, take the cheapest share as candidates, let those
// collapse that are the least around them, several rounds of this for one evaluation.
#include <utility>

#include "gpu/fit/cutter.h"
#include "gpu/fit/recipe.h"
#include "gpu/fit/steps/collapse_steps.h"
#include "gpu/fit/steps/lock_steps.h"
#include "gpu/fit/steps/quadric_cost.h"
#include "gpu/fit/steps/sample_cost.h"
#include "gpu/fit/threshold.h"
#include "gpu/fit/work_mesh.h"

namespace cordillera::gpu::fit {

template <class Device, class Samples>
class Collapser {
 public:
  Collapser(Device& device, WorkMesh<Device>& work, const Samples& samples)
      : device_(device), work_(work), samples_(samples), threshold_(device), cutter_(device, work) {}

  /// Until so many triangles are left, or nothing more can go. error: room for a float a sample.
  void collapse(std::uint64_t target, const CollapseRules& rules, float* error, std::size_t samples);

 private:
  template <class T>
  using Array = typename Device::template Array<T>;

  void start(bool has_planes);
  Count estimated();
  void evaluate_stale(Count most_class);
  void waves(std::uint64_t target, std::uint64_t enough);
  void wave(Progress* progress);
  /// Winners among the candidates.
  Vertices decide(Vertices candidates);
  Vertices cut_short(Vertices winners, std::uint64_t excess);
  void apply(Vertices winners);
  void last_one();

  Device& device_;
  WorkMesh<Device>& work_;
  Samples samples_;
  Threshold<Device> threshold_;
  CollapseRules rules_;
  float* error_ = nullptr;
  EdgeChoice choice_ = EdgeChoice::all;
  std::uint32_t wave_number_ = 0, round_ = 0;
  Array<std::uint32_t> stale_, candidates_, winners_, touched_, border_;
  Array<Bid> bids_;
  Cutter<Device> cutter_;
};

template <class Device, class Samples>
void Collapser<Device, Samples>::collapse(std::uint64_t target, const CollapseRules& rules, float* error, std::size_t samples) {
  rules_ = rules;
  error_ = error;
  if (work_.triangles() <= target) return;
  if (rules.cost == CostOf::samples) {
    device_.zero(error, samples);
    device_.each_star({work_.ids()}, work_.crowd(), MeasureErrors<Samples>{work_.mesh(), samples_, error});
  }
  start(rules.has_planes);
  waves(target, target + 1);
  if (work_.triangles() == target + 1) last_one();
}

template <class Device, class Samples>
void Collapser<Device, Samples>::start(bool has_planes) {
  wave_number_ = round_ = 0;
  device_.each(work_.ids(), StartVertex{work_.mesh(), work_.wave(), has_planes});
  if (rules_.cost == CostOf::samples && rules_.first_look < 1)
    evaluate_stale(estimated());
  else
    evaluate_stale({kCostClasses});
}

/// Costs by the planes, and the class up to which those are to be looked at closely.
template <class Device, class Samples>
Count Collapser<Device, Samples>::estimated() {
  const std::size_t all = work_.ids();
  const FitMesh mesh = work_.mesh();
  const WaveView wave = work_.wave();
  const Vertices stale = device_.list({all}, IsStaleUnder{wave, {kCostClasses}}, work_.room(stale_, all));
  device_.each_of(stale, EvaluateByQuadric<Samples>{mesh, wave, samples_, choice_, rules_.limit});
  device_.each_of(stale, TakeAsEstimate{wave});
  return threshold_.of_share(wave, all, rules_.first_look, work_.fresh_progress());
}

template <class Device, class Samples>
void Collapser<Device, Samples>::evaluate_stale(Count most_class) {
  const std::size_t all = work_.ids();
  const Vertices stale = device_.list({all}, IsStaleUnder{work_.wave(), most_class}, work_.room(stale_, all));
  if (rules_.cost == CostOf::samples) {
    device_.each_edge(stale, work_.crowd(),
                      EvaluateBySamples<Samples>{work_.mesh(), work_.wave(), samples_, error_, choice_, rules_.limit});
  } else {
    device_.each_of(stale, EvaluateByQuadric<Samples>{work_.mesh(), work_.wave(), samples_, choice_, rules_.limit});
  }
}

/// Series of waves, with what only a host does between them.
template <class Device, class Samples>
void Collapser<Device, Samples>::waves(std::uint64_t target, std::uint64_t enough) {
  while (work_.triangles() > enough) {
    if (work_.close_up()) wave_number_ = round_ = 0;
    const Progress end = work_.until_halt(target, enough, [&](Progress* progress) { wave(progress); });
    if (end.halt == Halt::cut) apply(cut_short({{end.winners}, winners_.data()}, end.triangles - target));
    if (end.halt == Halt::stuck) return;
  }
}

template <class Device, class Samples>
void Collapser<Device, Samples>::wave(Progress* progress) {
  if (round_ + static_cast<std::uint32_t>(rules_.rounds) >= 0xffffu) {
    device_.each(work_.ids(), ForgetRounds{work_.wave()});
    wave_number_ = round_ = 0;
  }
  ++wave_number_;
  const std::size_t all = work_.ids();
  const Count most = threshold_.of_share(work_.wave(), all, rules_.pool, progress);
  evaluate_stale(most);
  const Vertices candidates = device_.list({all}, IsCandidateUnder{work_.wave(), most}, work_.room(candidates_, all));
  const Vertices winners = decide(candidates);
  const Vertices along = device_.list(winners, IsAlongBorder{work_.mesh(), work_.wave()}, work_.room(border_, all));
  device_.each(1, CommitCollapses{progress, winners.count, along.count, rules_.pool >= 1});
  apply({{winners.count.most, &progress->going}, winners.list});
}

template <class Device, class Samples>
Vertices Collapser<Device, Samples>::decide(Vertices candidates) {
  Bid* const bids = work_.room(bids_, candidates.count.most);
  device_.each(candidates.count, MakeBid{work_.mesh(), work_.wave(), candidates.list, bids});
  for (int k = 0; k < rules_.rounds; ++k, ++round_) {
    const Lock lock{work_.mesh(), work_.wave(), bids, round_, wave_number_};
    device_.each(candidates.count, Offer{lock});
    device_.each(candidates.count, Decide{lock, rules_.cost == CostOf::carried_planes});
  }
  return device_.list(candidates, IsWinner{work_.wave()}, work_.room(winners_, candidates.count.most));
}

/// The cheapest winners, as many as the count bears.
template <class Device, class Samples>
Vertices Collapser<Device, Samples>::cut_short(Vertices winners, std::uint64_t excess) {
  device_.each_of(winners, ForgetWinner{work_.wave()});
  const CutResult cut =
      cutter_.cut(winners_.data(), winners.count.most, IsAlongBorder{work_.mesh(), work_.wave()}, {.budget = excess});
  work_.count(-static_cast<std::int64_t>(cut.taken), -static_cast<std::int64_t>(cut.sum));
  return {{cut.taken}, winners.list};
}

template <class Device, class Samples>
void Collapser<Device, Samples>::apply(Vertices winners) {
  const FitMesh mesh = work_.mesh();
  const WaveView wave = work_.wave();
  device_.each_of(winners, Collapse{mesh, wave});
  const std::size_t all = work_.ids();
  const Vertices touched = device_.list({all}, IsTouched{wave}, work_.room(touched_, all));
  device_.each_of(touched, MendRow{mesh, wave});
  if (rules_.polish) device_.each_star(winners, work_.crowd(), Relocate<Samples>{mesh, samples_, 2, rules_.limit});
  if (rules_.cost == CostOf::samples) device_.each_star(winners, work_.crowd(), RenewErrors<Samples>{mesh, samples_, error_});
  if (rules_.cost == CostOf::carried_planes)
    device_.each_of(winners, FollowVertex{mesh, wave});
  else
    device_.each_of(touched, RenewPlanes{mesh, wave});
}

/// An odd triangle is left: only a collapse along the border takes one alone.
template <class Device, class Samples>
void Collapser<Device, Samples>::last_one() {
  choice_ = EdgeChoice::border;
  const double pool = std::exchange(rules_.pool, 1.0);
  const std::uint64_t target = work_.triangles() - 1;
  start(false);
  waves(target, target);
  rules_.pool = pool;
  choice_ = EdgeChoice::all;
}

}  // namespace cordillera::gpu::fit
